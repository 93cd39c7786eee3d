"""Gusts with the Kaimal spectrum of IEC 61400-1 (Kaimal et al. 1972), as a seeded sum of sines that the mean wind carries along.

f S(f) / sigma^2 = 4 n / (1 + 6 n)^(5/3), n = f L / U, whose integral over all f is sigma^2. The length L is 8.1 x 0.7 z up to 60 m above
the sea, 56.7 m at 10 m. Gusts change the speed, not the direction; they are equal across the wind, and travel along it with the mean
speed (Taylor's frozen turbulence).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oilsim.core.quantity import quantity, require

Double = NDArray[np.float64]

# [m] length of the Kaimal spectrum at 10 m above the sea; paper (IEC 61400-1:2005, B.2); 8.1 x 0.7 x 10
LENGTH = 56.7


def kaimal_spectrum(frequency: Double, speed: float, deviation: float, length: float = LENGTH) -> Double:
    """Compute S(f) (N,) [m2/s] at frequencies (N,) [Hz] for a mean speed [m/s], standard deviation [m/s] and length L [m]."""
    time = length / speed
    return deviation**2 * 4.0 * time / (1.0 + 6.0 * np.asarray(frequency, np.float64) * time) ** (5.0 / 3.0)


class GustComponents(NamedTuple):
    """Sines of a gusty wind, each (M,).

    amplitude over the mean speed [-]; frequency [rad/s]; wave_number [1/m] along the wind; phase [rad]
    """

    amplitude: Double
    frequency: Double
    wave_number: Double
    phase: Double


@dataclass(frozen=True, kw_only=True)
class KaimalGusts:
    """Gusts of a wind.

    intensity          standard deviation of the speed over its mean [-], in the band between the two frequencies
    length             L of the spectrum [m]
    lowest_frequency   [Hz] below which the wind counts as its mean
    highest_frequency  [Hz] above which gusts are smaller than bodies
    count              number of sines
    seed               of their phases
    Raises ValueError for values that are not allowed.
    """

    intensity: float = quantity("", default=0.12, at_least=0.0, at_most=0.5)
    length: float = quantity("m", default=LENGTH, above=0.0)
    lowest_frequency: float = quantity("Hz", default=1.0 / 600.0, above=0.0)
    highest_frequency: float = quantity("Hz", default=1.0, above=0.0)
    count: int = quantity("", default=100, at_least=1, at_most=10000, whole=True)
    seed: int = quantity("", default=1, at_least=0, whole=True)

    def __post_init__(self) -> None:
        require("gusts", KaimalGusts, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        if not self.lowest_frequency < self.highest_frequency:
            yield f"lowest_frequency is {self.lowest_frequency:g} Hz, allowed: below highest_frequency = {self.highest_frequency:g} Hz"

    def components(self, speed: float) -> GustComponents:
        """Return the sines of a wind of this mean speed [m/s], above 0: (M,) each, [-], [rad/s], [1/m], [rad].

        Each holds the variance of a band of frequencies; all of them together hold intensity^2.
        """
        edges = np.geomspace(self.lowest_frequency, self.highest_frequency, self.count + 1)
        below = 1.0 - (1.0 + 6.0 * edges * self.length / speed) ** (-2.0 / 3.0)
        variance = np.diff(below) / (below[-1] - below[0]) * self.intensity**2
        random = np.random.default_rng(self.seed)
        frequency = edges[:-1] * (edges[1:] / edges[:-1]) ** random.uniform(
            size=self.count
        )  # a seeded place in each band
        phase = random.uniform(0.0, 2.0 * np.pi, self.count)
        omega = 2.0 * np.pi * frequency
        return GustComponents(np.sqrt(2.0 * variance), omega, omega / speed, phase)

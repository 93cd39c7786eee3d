"""JONSWAP spectra (Hasselmann et al. 1973), short-crested or long-crested, as components with seeded phases.

S(f) = m0 N x^-5 exp(-5/4 x^-4) gamma^b / fp, x = f / fp, b = exp(-(x - 1)^2 / (2 s^2)), s = 0.07 below the peak and 0.09 above it, with N
such that the whole spectrum holds m0 = Hs^2 / 16. Components are linear waves: a second-order correction of spectra is not offered.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from oilsim.core.quantity import quantity, require
from oilsim.sea.flows import Flow
from oilsim.sea.regular_waves import SEEN_FROM, STRETCHINGS, chosen, steepest_height, water_numbers
from oilsim.sea.wave_components import StillWater, WaveComponents

Double = NDArray[np.float64]

# [1] frequencies over that of the peak between which the shape is integrated; numerical; less than 1e-5 of m0 lies outside
RANGE = (0.3, 100.0)
# [1] points of that integral; numerical; moments are exact to 1e-6
POINTS = 20001
# [1] lowest frequency of a component over that of the peak; numerical; 1e-8 of m0 lies below
LOWEST = 0.5
# [1] highest frequency of a component, over that of the peak, unless another is given; numerical; 0.2 % of m0 lies above
CUT = 4.5
# [s] peak periods up to which, and from which, the steepest seas have one steepness; paper (DNV-RP-C205, sec. 3.5.4); observed limits
SEA_PERIODS = (8.0, 15.0)
# [1] steepness 2 pi Hs / (g Tp^2) of the steepest seas of those periods; paper (DNV-RP-C205, sec. 3.5.4); observed limits
STEEPEST_SEAS = (1.0 / 15.0, 1.0 / 25.0)
# [1] largest Hs over the depth; paper (Thornton and Guza 1982); Hrms = 0.42 h in saturated surf
DEPTH_LIMITED = 0.6
# [1] golden ratio - 1; theory; the multiples of it, less whole numbers, fill an interval evenly
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


# [1] points of the integral over directions; numerical; quantiles are exact to 1e-5 rad
POINTS = 20001


def shape(x: Double, peakedness: float) -> Double:
    """Compute x^-5 exp(-5/4 x^-4) gamma^b (N,) [-] at x = f / fp (N,) [-]."""
    width = np.where(x <= 1.0, 0.07, 0.09)
    return x**-5.0 * np.exp(-1.25 * x**-4.0) * peakedness ** np.exp(-0.5 * ((x - 1.0) / width) ** 2)


@cache
def _integrals(peakedness: float) -> tuple[Double, Double, Double]:
    """Return x, and the integrals of the shape and of x times the shape up to it, (POINTS,) [-]."""
    x = np.geomspace(*RANGE, POINTS)
    y = shape(x, peakedness)
    sums = (np.append(0.0, np.cumsum(0.5 * (g[1:] + g[:-1]) * np.diff(x))) for g in (y, x * y))
    zeroth, first = sums
    return x, zeroth, first


def spectrum(frequency: Double, significant_height: float, peak_period: float, peakedness: float) -> Double:
    """Compute S(f) (N,) [m2/Hz] at frequencies (N,) [Hz], of significant height [m], peak period [s] and peakedness gamma [-]."""
    _, zeroth, _ = _integrals(peakedness)
    m0 = significant_height**2 / 16.0
    return m0 * peak_period / zeroth[-1] * shape(np.asarray(frequency, np.float64) * peak_period, peakedness)


@dataclass(frozen=True, kw_only=True)
class JonswapWaves:
    """A sea of many linear waves with a JONSWAP spectrum.

    significant_height  Hs [m]
    peak_period         Tp [s]; `seen_from` the water or the ground
    direction           [rad] the sea runs to, counter-clockwise from +x
    peakedness          gamma [-]; 1: Pierson-Moskowitz
    spread              s of the spreading cos^2s(theta / 2) [-]; None: long-crested
    highest_frequency   [Hz] the spectrum is cut here, Stokes drift included; by default 4.5 / Tp
    count               number of components
    seed                of phases and directions
    stretching          "wheeler", or "none": the values at the still level hold above it
    Raises ValueError for values that are not allowed.
    """

    significant_height: float = quantity("m", at_least=0.0)
    peak_period: float = quantity("s", above=0.0)
    direction: float = quantity("rad", default=0.0)
    peakedness: float = quantity("", default=3.3, at_least=1.0, at_most=10.0)
    spread: float | None = quantity("", default=None, above=0.0, at_most=1000.0)
    highest_frequency: float | None = quantity("Hz", default=None, above=0.0)
    count: int = quantity("", default=100, at_least=1, at_most=10000, whole=True)
    seed: int = quantity("", default=1, at_least=0, whole=True)
    stretching: str = "wheeler"
    seen_from: str = "water"

    def __post_init__(self) -> None:
        require("waves", JonswapWaves, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        yield from chosen("stretching", self.stretching, STRETCHINGS)
        yield from chosen("seen_from", self.seen_from, SEEN_FROM)
        if self.peak_period > 0.0 and not 1.0 < self._cut <= RANGE[1]:
            low, high = 1.0 / self.peak_period, RANGE[1] / self.peak_period
            given = f"highest_frequency is {self.highest_frequency:g} Hz"
            yield f"{given}, allowed: above 1 / peak_period = {low:.4g} Hz, at most {high:.4g} Hz"

    @property
    def _cut(self) -> float:
        """Highest frequency over that of the peak."""
        return CUT if self.highest_frequency is None else self.highest_frequency * self.peak_period

    def components(self, water: StillWater, flow: Flow | None, shear_exponent: float) -> WaveComponents:
        """Return the components, each array (M,): [m], [1/m], [rad/s], [rad] as in `WaveComponents`.

        A component holds the energy of its band of frequencies, at the band's centre of energy. Bands widen with frequency, so that the sea
        does not repeat itself. Each takes one direction (Miles and Funke 1989), an even fraction of the spreading function.
        Raises ValueError for a sea that is too steep for the water.
        """
        self._check_steepness(water)
        x, zeroth, first = _integrals(self.peakedness)
        edges = np.geomspace(LOWEST, self._cut, self.count + 1)
        energy, moment = np.diff(np.interp(edges, x, zeroth)), np.diff(np.interp(edges, x, first))
        periods = self.peak_period * energy / moment
        amplitude = np.sqrt(2.0 * self.significant_height**2 / 16.0 * energy / zeroth[-1])
        random = np.random.default_rng(self.seed)
        phase = random.uniform(0.0, 2.0 * np.pi, self.count)
        fraction = np.remainder(random.uniform() + GOLDEN * np.arange(self.count), 1.0)
        direction = self.direction + direction_quantiles(fraction, self.spread)
        k, sigma, share = water_numbers(periods, direction, self.seen_from, water, flow, shear_exponent)
        return WaveComponents(amplitude, k, sigma, phase, np.cos(direction), np.sin(direction), share)

    def _check_steepness(self, water: StillWater) -> None:
        """Raise ValueError for a sea higher than seas of its period, or of its depth, are observed to be."""
        steepness = float(np.interp(self.peak_period, SEA_PERIODS, STEEPEST_SEAS))
        k = float(water_numbers(np.array([self.peak_period]), np.zeros(1), "water", water, None, 0.0)[0][0])
        limits = {
            "seas of this peak period (DNV-RP-C205)": steepness * water.gravity * self.peak_period**2 / (2.0 * math.pi),
            "breaking waves of the peak period (Miche 1944)": steepest_height(k, water.depth),
            "seas of this depth (Thornton and Guza 1982)": DEPTH_LIMITED * water.depth,
        }
        reason = min(limits, key=lambda name: limits[name])
        if self.significant_height > limits[reason]:
            raise ValueError(
                f"waves: significant_height is {self.significant_height:g} m at peak_period = {self.peak_period:g} s in water of "
                f"{water.depth:g} m, allowed: up to {limits[reason]:.4g} m, the limit of {reason}"
            )


def spreading(theta: Double, spread: float) -> Double:
    """Compute D(theta) (N,) [1/rad] at angles (N,) [rad] from the mean direction; spread s [-]."""
    scale = math.exp(math.lgamma(spread + 1.0) - math.lgamma(spread + 0.5)) / (2.0 * math.sqrt(math.pi))
    return scale * np.abs(np.cos(0.5 * theta)) ** (2.0 * spread)


def direction_quantiles(fraction: Double, spread: float | None) -> Double:
    """Return the angles (N,) [rad] below which the given fractions (N,) [-] of the energy lie; zeros for a spread of None."""
    if spread is None:
        return np.zeros_like(fraction)
    theta = np.linspace(-math.pi, math.pi, POINTS)
    density = spreading(theta, spread)
    below = np.append(0.0, np.cumsum(0.5 * (density[1:] + density[:-1])))
    return np.interp(fraction, below / below[-1], theta)

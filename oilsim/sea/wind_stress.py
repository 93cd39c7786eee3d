"""Stress of the wind on the sea, and the drift of the sea's upper layer that it keeps up.

Gusts with the Kaimal spectrum of IEC 61400-1 (Kaimal et al. 1972), as a seeded sum of sines that the mean wind carries along.

f S(f) / sigma^2 = 4 n / (1 + 6 n)^(5/3), n = f L / U, whose integral over all f is sigma^2. The length L is 8.1 x 0.7 z up to 60 m above
the sea, 56.7 m at 10 m. Gusts change the speed, not the direction; they are equal across the wind, and travel along it with the mean
speed (Taylor's frozen turbulence).

Langmuir cells: rows along the wind into which the surface water converges, and with it what floats (Langmuir 1938; Leibovich 1983).

With y across the wind from the nearest row, the surface velocity is -V sin(2 pi y / spacing) across the wind and J cos(2 pi y / spacing)
along it. Cells form where the turbulent Langmuir number La = (u*_water / u_stokes)^0.5 is below about 0.5 (McWilliams et al. 1997) and the
wind blows with 3 m/s or more (Leibovich 1983). They are modelled: regular, of one spacing, fixed to the water, without end,
and along the mean wind, also where a table turns the wind.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from oilsim.core.physical_constants import AIR_DENSITY
from oilsim.core.quantity import quantity, require

Double = NDArray[np.float64]
Speed = TypeVar("Speed", float, Double)

# [1] drift of the surface over the friction speed in the air; paper (Wu 1975); measured in a flume, 0.53
SURFACE_DRIFT = 0.53
# [1] von Karman's constant; paper (Hogstrom 1988); 0.40
KARMAN = 0.40


def drag_coefficient(speed: Speed) -> Speed:
    """Return C_D [-] of the sea for the wind speed U [m/s] at 10 m, a number or (N,): (0.8 + 0.065 U) 1e-3 (Wu 1982)."""
    return (0.8 + 0.065 * speed) * 1e-3


def wind_stress(speed: float) -> float:
    """Return the stress [Pa] of a wind of `speed` U [m/s] at 10 m on the sea: rho_air C_D U^2."""
    return AIR_DENSITY * drag_coefficient(speed) * speed * speed


def friction_speed(speed: float, density: float = AIR_DENSITY) -> float:
    """Return (stress / density)^0.5 [m/s]: by default in the air, with a water's density [kg/m3] in the water."""
    return math.sqrt(wind_stress(speed) / density)


class DriftLayer(NamedTuple):
    """The drifting layer under one wind.

    thickness [m]; surface [m/s] drift there; slope [m/s] and roughness z0 [m] of the profile surface - slope ln(1 + d / z0); toward_x,
    toward_y [-]: its direction.
    """

    thickness: float
    surface: float
    slope: float
    roughness: float
    toward_x: float
    toward_y: float


@dataclass(frozen=True, kw_only=True)
class WindDrift:
    """The layer that the wind drags along: a logarithmic profile from the surface down to `layer`, where it ends.

    u(d) = 0.53 u*_air - u*_water / 0.40 ln(1 + d / z0) (Wu 1975 at the surface; law of the wall below it), d the depth below the surface,
    with z0 such that u(layer) = 0. The layer's depth is modelled: sources give decimetres.

    layer  [m] depth at which the drift ends
    Raises ValueError for values that are not allowed.
    """

    layer: float = quantity("m", default=0.5, above=0.0, at_most=10.0)

    def __post_init__(self) -> None:
        require("wind drift", WindDrift, vars(self))

    def roughness(self, density: float) -> float:
        """Return z0 [m] in water of `density` [kg/m3]; it does not depend on the wind."""
        return self.layer / math.expm1(SURFACE_DRIFT * KARMAN * math.sqrt(density / AIR_DENSITY))

    def velocity(self, depth: Double, wind: Double, density: float) -> Double:
        """Compute the drift (N, 2) [m/s] at depths (N,) [m] below the surface in the mean wind (2,) [m/s] at 10 m."""
        layer, depth = self.layer_under(wind, density), np.asarray(depth, np.float64)
        profile = np.maximum(layer.surface - layer.slope * np.log1p(depth / layer.roughness), 0.0)
        return np.asarray(profile[..., None] * np.array([layer.toward_x, layer.toward_y]))

    def layer_under(self, wind: Double, density: float) -> DriftLayer:
        """Return the layer under the mean wind (2,) [m/s] at 10 m, in water of `density` [kg/m3]; one at rest without wind."""
        speed = math.hypot(*wind)
        if speed == 0.0:
            return DriftLayer(self.layer, 0.0, 0.0, 1.0, 0.0, 0.0)
        return DriftLayer(
            thickness=self.layer,
            surface=SURFACE_DRIFT * friction_speed(speed),
            slope=friction_speed(speed, density) / KARMAN,
            roughness=self.roughness(density),
            toward_x=float(wind[0]) / speed,
            toward_y=float(wind[1]) / speed,
        )


# [m] length of the Kaimal spectrum at 10 m above the sea; paper (IEC 61400-1:2005, B.2); 8.1 x 0.7 x 10
LENGTH = 56.7


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


# [1] turbulent Langmuir number below which cells form; paper (McWilliams et al. 1997); about 0.3 in open seas, shear wins above 0.5
LARGEST_NUMBER = 0.5
# [m/s] weakest wind with cells; paper (Leibovich 1983); 3 m/s
WEAKEST_WIND = 3.0


def langmuir_number(wind_speed: float, stokes_drift: float, density: float) -> float:
    """Return the turbulent Langmuir number (u*_water / u_stokes)^0.5 [-]; infinite without a Stokes drift [m/s]."""
    return math.sqrt(friction_speed(wind_speed, density) / stokes_drift) if stokes_drift > 0.0 else math.inf


@dataclass(frozen=True, kw_only=True)
class LangmuirCells:
    """Rows of converging water.

    spacing      [m] between rows
    convergence  V over the wind speed [-]; about 1 % is observed for the downwelling of cells as deep as wide
    jet          J over the wind speed [-]: the rows drift so much faster than the mean
    seed         of the place of the rows
    Raises ValueError for values that are not allowed.
    """

    spacing: float = quantity("m", default=10.0, above=0.0)
    convergence: float = quantity("", default=0.01, at_least=0.0, at_most=0.1)
    jet: float = quantity("", default=0.01, at_least=0.0, at_most=0.1)
    seed: int = quantity("", default=1, at_least=0, whole=True)

    def __post_init__(self) -> None:
        require("langmuir cells", LangmuirCells, vars(self))

    def velocity(self, points: Double, to: Double, speed: float) -> Double:
        """Compute the surface velocity of the cells (N, 2) [m/s] at `points` (N, 2) [m], which move with the current.

        to (2,): unit vector along the wind, which gives the rows; speed [m/s] of the wind.
        """
        offset = np.random.default_rng(self.seed).uniform(0.0, self.spacing)
        across = points[:, 1] * to[0] - points[:, 0] * to[1] - offset
        angle = (2.0 * np.pi / self.spacing) * across
        sideways = -self.convergence * speed * np.sin(angle)
        ahead = self.jet * speed * np.cos(angle)
        return np.stack([ahead * to[0] - sideways * to[1], ahead * to[1] + sideways * to[0]], -1)

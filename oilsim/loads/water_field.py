"""The sea as the loads on a body need it: where its surface is, and how water and air move at any point and time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from oilsim.physical_constants import AIR_DENSITY, GRAVITY, SEA_WATER_DENSITY
from oilsim.quantity import quantity, require

Array = NDArray[np.float64]


class WaterField(Protocol):
    """An analytic sea; every method is vectorised over points, and times are in seconds."""

    def elevation(self, points: Array, time: float) -> Array:
        """Return the height (n,) [m] of the surface at places (n, 2) [m]."""

    def velocity(self, points: Array, time: float) -> Array:
        """Return the water's velocity (n, 3) [m/s] at points (n, 3) [m]."""

    def acceleration(self, points: Array, time: float) -> Array:
        """Return the water's acceleration (n, 3) [m/s2] at points (n, 3) [m]."""

    def wind(self, points: Array, time: float) -> Array:
        """Return the wind's velocity (n, 2) [m/s] at places (n, 2) [m]."""


@dataclass(frozen=True, kw_only=True)
class SteadyWater:
    """Water with a flat surface and a uniform current, under a uniform wind.

    level [m]; current, wind (2,) [m/s] towards which they go.
    """

    level: float = quantity("m", default=0.0)
    current: tuple[float, float] = quantity("m/s", default=(0.0, 0.0))
    uniform_wind: tuple[float, float] = quantity("m/s", default=(0.0, 0.0))

    def __post_init__(self) -> None:
        require("steady water", SteadyWater, vars(self))

    def elevation(self, points: Array, time: float) -> Array:
        """Return the level (n,) [m]."""
        return np.full(len(points), self.level)

    def velocity(self, points: Array, time: float) -> Array:
        """Return the current (n, 3) [m/s]."""
        return np.tile((*self.current, 0.0), (len(points), 1))

    def acceleration(self, points: Array, time: float) -> Array:
        """Return zeros (n, 3) [m/s2]."""
        return np.zeros((len(points), 3))

    def wind(self, points: Array, time: float) -> Array:
        """Return the wind (n, 2) [m/s]."""
        return np.tile(self.uniform_wind, (len(points), 1))


@dataclass(frozen=True, kw_only=True)
class Fluids:
    """Densities of water and air [kg/m3] and the acceleration of free fall [m/s2] that loads are computed with."""

    water_density: float = quantity("kg/m3", default=SEA_WATER_DENSITY, above=0.0)
    air_density: float = quantity("kg/m3", default=AIR_DENSITY, at_least=0.0)
    gravity: float = quantity("m/s2", default=GRAVITY, above=0.0)

    def __post_init__(self) -> None:
        require("fluids", Fluids, vars(self))

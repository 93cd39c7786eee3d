"""Stress of the wind on the sea, and the drift of the sea's upper layer that it keeps up."""

from __future__ import annotations

import math
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

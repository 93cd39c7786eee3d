"""Fay's three regimes of a slick that spreads on calm water, and how one becomes the next.

A slick of volume V spreads by gravity against inertia, then by gravity against the drag of the boundary layer below it, then by surface
tension against that drag (Fay 1971; Hoult 1972). From a point at time 0 its radius is

    gravity-inertia   R = 1.14 (D g V t^2)^(1/4)
    gravity-viscous   R = 0.98 (D g V^2 t^(3/2) / nu^(1/2))^(1/6)
    surface tension   R = 1.60 (sigma^2 t^3 / (rho^2 nu))^(1/4)

with D = 1 - density of oil / density of water, sigma [N/m] the spreading tension, rho [kg/m3] and nu [m2/s] of water. A slick in a run
does not begin as a point, meets others and is cut by booms. So each law is used as a speed of the front at the present radius, from the
balance of forces behind it, of which the law is the solution from a point:

    gravity-inertia   R dR/dt = 1.14^2 / 2 (D g V)^(1/2)
    gravity-viscous   R dR/dt = 0.98^6 / 4 D g V^2 t^(1/2) / (nu^(1/2) R^4)
    surface tension   R dR/dt = 1.60^2 3/4 sigma t^(1/2) / (rho nu^(1/2))

Join: of the two that resist gravity, the one that lets it spread more slowly counts; of the two that drive, the stronger one:
max(min(gravity-inertia, gravity-viscous), surface tension). Against the largest or smallest of the three laws, the radius is 5 % low where
the first two cross and 18 % high where the last two do; both differences fade as t^(-3/2). The film stops to spread at the area
1e5 V^(3/4) [m2, m3] (Fay 1971), where the oil has lost the parts that drive it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST
from oilsim.core.physical_constants import GRAVITY

Array = NDArray[np.float64]

# [1] coefficient of the radius in the regime of gravity and inertia; paper (Fay 1971, Hoult 1972); axisymmetric slick
INERTIAL = 1.14
# [1] coefficient of the radius in the regime of gravity and viscosity; paper (Fay 1971, Hoult 1972); axisymmetric slick
VISCOUS = 0.98
# [1] coefficient of the radius in the regime of surface tension; paper (Fay 1971, Hoult 1972); axisymmetric slick
TENSILE = 1.60
# [m^(-1/4)] final area over V^(3/4); paper (Fay 1971); the film ceases to spread there
FINAL_AREA = 1e5


def gravity_inertia_radius(time: float, volume: float, buoyancy: float) -> float:
    """Compute the radius [m] at `time` [s] of `volume` [m3] of oil with D = `buoyancy` [-], in gravity against inertia."""
    return INERTIAL * (buoyancy * GRAVITY * volume * time**2) ** 0.25


def gravity_viscous_radius(time: float, volume: float, buoyancy: float, water_viscosity: float) -> float:
    """Compute the radius [m] at `time` [s] of `volume` [m3] in gravity against drag; kinematic `water_viscosity` [m2/s]."""
    return VISCOUS * (buoyancy * GRAVITY * volume**2 * time**1.5 / math.sqrt(water_viscosity)) ** (1.0 / 6.0)


def surface_tension_radius(time: float, tension: float, water_density: float, water_viscosity: float) -> float:
    """Compute the radius [m] at `time` [s] under a spreading `tension` [N/m] against drag, in water of that density and viscosity."""
    return TENSILE * (tension**2 * time**3 / (water_density**2 * water_viscosity)) ** 0.25


def joined_radius(
    time: float, volume: float, buoyancy: float, tension: float, water_density: float, water_viscosity: float
) -> float:
    """Compute the radius [m] by which the three laws are usually drawn: max(min(first, second), third)."""
    inertial = gravity_inertia_radius(time, volume, buoyancy)
    viscous = gravity_viscous_radius(time, volume, buoyancy, water_viscosity)
    return max(min(inertial, viscous), surface_tension_radius(time, tension, water_density, water_viscosity))


def final_thickness(volume: Array) -> Array:
    """Compute the thickness [m] at which volumes (N,) [m3] of oil, each alone, cease to spread (Fay 1971): V / (1e5 V^(3/4))."""
    return np.asarray(volume**0.25 / FINAL_AREA)


@njit(**FAST)
def spreading_rate(radius, age, volume, buoyancy, tension, water_density, water_viscosity):
    """Compute R dR/dt [m2/s] of a slick of `radius` [m] and `volume` [m3] at its `age` [s]; 0 at its final area. See the module."""
    if math.pi * radius * radius >= FINAL_AREA * volume**0.75:
        return 0.0
    layer = math.sqrt(age / water_viscosity)  # 1 / [m/s]: time over thickness of the boundary layer
    inertial = 0.5 * INERTIAL**2 * math.sqrt(buoyancy * GRAVITY * volume)
    viscous = 0.25 * VISCOUS**6 * buoyancy * GRAVITY * volume * volume * layer / radius**4
    tensile = 0.75 * TENSILE**2 * tension / water_density * layer
    return max(min(inertial, viscous), tensile)

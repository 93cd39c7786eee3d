"""The profile of the oil that a current holds against a boom.

The head of the slick stands where the water comes to rest below it: its thickness is h_f = U^2 / (2 g'), with g' = g (1 - rho_o / rho_w)
and U [m/s] the speed of the water normal to the boom. Behind the head the interfacial stress C_f rho_w U^2 / 2 thickens the slick towards
the boom: with x [m] from the head, h^2 = h_f^2 + K x, K = C_f (rho_w / rho_o) U^2 / g' [m]. Oil of V' [m2] per metre of front then is

    h_b = (h_f^3 + 1.5 K V')^(1/3) thick at the boom [m],   L = (h_b^2 - h_f^2) / K long [m].

Range: a slender slick (L > 5 h_b) of quiescent oil in water deeper than five drafts. Source: balance of forces on a floating layer; a thin
slick without friction has h_f everywhere. This is a closure: C_f is 0.005 by default; values from 0.003 to 0.016 are plausible.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.core.physical_constants import GRAVITY

Array = NDArray[np.float64]


def head_thickness(speed: Array, reduced_gravity: Array) -> Array:
    """Compute the thickness of the slick's head, h_f = U^2 / (2 g') [m]; speed U (P,) [m/s], reduced_gravity g' (P,) [m/s2]."""
    return np.asarray(speed * speed / (2.0 * reduced_gravity))


def thickening(speed: Array, reduced_gravity: Array, density_ratio: Array, friction: float) -> Array:
    """Compute K = C_f (rho_w / rho_o) U^2 / g' (P,) [m].

    speed U (P,) [m/s]; reduced_gravity (P,) [m/s2]; density_ratio rho_o / rho_w (P,) [-]; friction C_f [-].
    """
    return np.asarray(friction / density_ratio * speed * speed / reduced_gravity)


def boom_thickness(head: Array, growth: Array, volume_per_front: Array) -> Array:
    """Compute the thickness at the boom h_b (P,) [m] of oil with a head h_f (P,) [m], growth K (P,) [m] and V' (P,) [m2]."""
    return np.asarray(np.cbrt(head**3 + 1.5 * growth * volume_per_front))


def distance_to(thickness: Array, growth: Array, local: Array) -> Array:
    """Compute the distance from the boom (N,) [m] at which a slick that is h_b (N,) [m] thick there is `local` (N,) [m] thick.

    growth K (N,) [m].
    """
    return np.asarray((thickness**2 - local**2) / growth)


def reduced_gravity(density: Array, water_density: float) -> Array:
    """Compute g' = g (1 - rho_o / rho_w) (P,) [m/s2] of oil with density (P,) [kg/m3]."""
    return np.asarray(GRAVITY * (1.0 - density / water_density))

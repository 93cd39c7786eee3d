"""The profile of a slick that a current presses against a boom (closure: a force balance, no thickness read from particles).

The water flows at U under oil at rest. At the slick's front, where the water stops, the surface rises by U^2 / (2 g). The oil's surface
stands as high, so that Delta h_f = U^2 / (2 g): the front is h_f thick. Behind it, the friction 0.5 rho_w C_f U^2 on the slick's underside
is carried by the force of a floating layer, 0.5 rho_o g' h^2 per metre of front. Hence, at the distance x behind the front,

    h^2 = h_f^2 + K x,    K = C_f (rho_w / rho_o) U^2 / g'  [m].

Range: slender slicks, longer than five times their thickness at the boom, in water deeper than five drafts, and below the onset of
entrainment. Sources: front in deep water by Bernoulli's law at the stagnation point; thickening by friction after Wilkinson, J. Hydraul.
Div. ASCE 99 (1973) 701. C_f falls along the slick and rises with the oil's viscosity and with waves on the interface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from booms.losses.liquids import OilOnWater

Array = NDArray[np.float64]

# [-] C_f of a slick's underside; assumed: evidence spans 0.003 to 0.016; a flat plate has 0.0036 at a Reynolds number of 3.5e6
FRICTION = 0.005


def front_thickness(speed: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the thickness of a slick's front, h_f = U^2 / (2 g') [m]; speed U (S,) [m/s]."""
    return np.asarray(np.square(speed) / (2.0 * oil.reduced_gravity))


def thickening(speed: ArrayLike, oil: OilOnWater) -> Array:
    """Compute K = C_f (rho_w / rho_o) U^2 / g' [m], by which h^2 grows for each metre behind the front; speed U (S,) [m/s]."""
    ratio = oil.water_density / oil.oil_density
    return np.asarray(FRICTION * ratio * np.square(speed) / oil.reduced_gravity)


def boom_thickness(speed: ArrayLike, held: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the thickness at the boom, h_b = (h_f^3 + 3/2 K V')^(1/3) [m].

    speed U (S,) [m/s]; held V' (S,) [m2], oil per metre of front: the integral of h over the slick is 2 (h_b^3 - h_f^3) / (3 K).
    """
    front = front_thickness(speed, oil)
    return np.asarray(np.cbrt(front**3 + 1.5 * thickening(speed, oil) * np.asarray(held)))


def slick_length(speed: ArrayLike, held: ArrayLike, oil: OilOnWater) -> Array:
    """Compute the length of the slick before the boom, L = (h_b^2 - h_f^2) / K [m]; 0 without flow or oil.

    speed U (S,) [m/s]; held V' (S,) [m2].
    """
    front, growth = front_thickness(speed, oil), thickening(speed, oil)
    rise = boom_thickness(speed, held, oil) ** 2 - front**2
    return np.asarray(np.divide(rise, growth, out=np.zeros_like(rise), where=growth > 0.0))

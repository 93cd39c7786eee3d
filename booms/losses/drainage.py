"""Drainage: oil that is sucked under the skirt's foot, or that the slick's own weight pushes under it (closure).

The water runs along the slick's underside and round the foot at k U. By Bernoulli's law along the interface, oil is held at the foot while
(k^2 - 1) U^2 / (2 g') is less than the water between slick and foot, so the slick may be h_c = d - (k^2 - 1) h_f thick at the boom. A
front that is itself sucked under, k^2 h_f > d, bounds the speed: U = sqrt(2 g' d) / k. A plate with a base pressure of -1 has k = sqrt 2;
runs of this program with 2.5 to 16 particles of draft give 1.6 to 1.9. Thicker oil runs out like an outlet of its own depth, and no slower
than the water that takes it along (form assumed): so oil that hardly floats goes with the water.
Range: upright or leaning plate in water deeper than five drafts. Source: own derivation; the rate's form and its 0.6 are assumed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from booms.losses.liquids import OilOnWater
from booms.losses.slick import front_thickness

Array = NDArray[np.float64]

# [-] k, speed at the foot over that of the undisturbed water; theory: a plate with a base pressure coefficient of -1
SUCTION = math.sqrt(2.0)
# [-] of an outlet; assumed: that of a sharp edge
OUTFLOW = 0.6


def suction_limit(draft: ArrayLike, oil: OilOnWater, suction: float = SUCTION) -> Array:
    """Compute the speed at which the slick's front is sucked under the foot, sqrt(2 g' d) / k [m/s]; draft d (S,) [m]."""
    return np.asarray(np.sqrt(2.0 * oil.reduced_gravity * np.asarray(draft)) / suction)


def held_thickness(speed: ArrayLike, draft: ArrayLike, oil: OilOnWater, suction: float = SUCTION) -> Array:
    """Compute the thickness that a skirt holds, h_c = d - (k^2 - 1) h_f [m], 0 where suction takes it all.

    speed U (S,) [m/s]; draft d (S,) [m], from the waterline down to the foot.
    """
    return np.asarray(np.maximum(0.0, np.asarray(draft) - (suction**2 - 1.0) * front_thickness(speed, oil)))


def drainage_rate(speed: ArrayLike, thickness: ArrayLike, held: ArrayLike, depth: float, oil: OilOnWater) -> Array:
    """Compute the oil that drains, q = 0.6 min(h_b - h_c, d) max(sqrt(g' h), U) [m2/s per metre of boom], 0 while h_b <= h_c.

    speed U (S,) [m/s] of the water that goes under the foot; thickness h_b (S,) [m] at the boom, h its part above the foot; held h_c (S,)
    [m]; depth d [m] of the skirt.
    """
    deep = np.asarray(thickness)
    excess = np.clip(deep - np.asarray(held), 0.0, depth)
    return np.asarray(OUTFLOW * excess * np.maximum(np.sqrt(oil.reduced_gravity * np.minimum(deep, depth)), speed))

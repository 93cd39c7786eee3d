"""Splash-over and submergence: what flows over a float whose top is below the local surface (closure on a resolved motion).

The boom's pose gives its top, the particles give the surface before it; f is their difference. While f < 0, water and oil run over the
top as over a broad weir, q = 1.7 (-f)^1.5 [m2/s], and the oil on the surface makes up min(1, h_b / -f) of it. Range: overflow
that is long against its depth; wave length over height above 10. Source: broad-crested weir, (2/3)^1.5 sqrt(g) = 1.7.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim.core.physical_constants import GRAVITY

Array = NDArray[np.float64]

# [m^0.5/s] of a broad-crested weir, (2/3)^1.5 sqrt(g); theory
WEIR = (2.0 / 3.0) ** 1.5 * GRAVITY**0.5


def overflow_rate(freeboard: ArrayLike, thickness: ArrayLike) -> Array:
    """Compute the oil that runs over the top [m2/s per metre of boom].

    freeboard f (S,) [m] of the top above the local surface, negative under it; thickness h_b (S,) [m] of the oil at the boom.
    """
    depth = np.maximum(0.0, -np.asarray(freeboard, np.float64))
    share = np.minimum(1.0, np.divide(thickness, depth, out=np.ones_like(depth), where=depth > 0.0))
    return np.asarray(WEIR * depth**1.5 * share)

"""The smoothing kernel: cubic spline with compact support (Monaghan 1992), in two and three dimensions.

    W(r) = sigma [2 (1 - q)^3 - 8 (1/2 - q)^3],  q = r / H,  (.)^3 cut to 0 below 0,  H the support radius

sigma = 8 / (pi H^3) in three dimensions and 40 / (7 pi H^2) in two, so that the integral of W is 1. The truncated powers
need no branch, so that inner loops vectorise. On a square or cubic lattice of spacing H / 2 the sum of W d^dimension is 1
to 1e-3.
"""

from __future__ import annotations

import math

from numba import njit

FAST = {"nogil": True, "cache": True, "fastmath": True, "error_model": "numpy"}


def normalisation(support_radius: float, dimension: int) -> float:
    """sigma of the kernel [1/m3; 1/m2 in two dimensions]."""
    if dimension == 3:
        return 8.0 / (math.pi * support_radius**3)
    return 40.0 / (7.0 * math.pi * support_radius**2)


@njit(inline="always", **FAST)
def kernel(q, sigma):
    """W at q = r / H; zero from q = 1 on. sigma as from `normalisation`."""
    outer = max(1.0 - q, 0.0)
    inner = max(0.5 - q, 0.0)
    return sigma * (2.0 * outer * outer * outer - 8.0 * inner * inner * inner)


@njit(inline="always", **FAST)
def kernel_slope(q, sigma):
    """dW/dq at q = r / H, never positive; dW/dr is this over H."""
    outer = max(1.0 - q, 0.0)
    inner = max(0.5 - q, 0.0)
    return sigma * (24.0 * inner * inner - 6.0 * outer * outer)

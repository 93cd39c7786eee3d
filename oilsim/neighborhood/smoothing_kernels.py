"""The smoothing kernel: Wendland's C2 function (Wendland 1995) with compact support, in two and three dimensions.

    W(r) = sigma (1 - q)^4 (1 + 4 q),   (dW/dq) / q = -20 sigma (1 - q)^3,   q = r / H,  H the support radius

The constant sigma makes the sum of W d^dimension over a square or cubic lattice of spacing d equal to 1, so that water on a lattice has
exactly its rest density; the integral of W is then 1 to 0.7 %. H = 2.75 d is the narrowest support at which water came to rest: the noise
left after 3 s in a column 24 particles deep is 0.5 % of sqrt(g H) at 2.5 d and 0.09 % at 2.75 d. Two layers of wall particles still fill
this support.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from oilsim.backend.jit import inlined
from oilsim.backend.simd import positive

# [d] support radius; measured; the narrowest at which water comes to rest (see the module's docstring)
SUPPORT = 2.75
ONE, FOUR, TWENTY = np.float32(1.0), np.float32(4.0), np.float32(20.0)


@inlined
def kernel(q, sigma):
    """Return W [1/m3; 1/m2 in two dimensions] at q = r / H, numbers, lanes or arrays; 0 from q = 1 on; sigma as from `normalisation`."""
    outer = positive(ONE - q)
    square = outer * outer
    return sigma * square * square * (ONE + FOUR * q)


@inlined
def kernel_slope_over_q(q, sigma):
    """Return (dW/dq) / q at q = r / H, never positive and finite at 0; grad W = x / H^2 times this; sigma as from `normalisation`."""
    outer = positive(ONE - q)
    return -TWENTY * sigma * outer * outer * outer


def lattice(step: float, dimension: int, reach: float = SUPPORT) -> np.ndarray:
    """Return lattice points (K, 3) within a cube of half width `reach` about the origin, `step` apart; all in spacings d [-]."""
    axis = np.arange(-np.ceil(reach / step), np.ceil(reach / step) + 1) * step
    plane = axis if dimension == 3 else np.zeros(1)
    return np.stack(np.meshgrid(axis, plane, axis, indexing="ij"), axis=-1).reshape(-1, 3)


@lru_cache
def normalisation(spacing: float, dimension: int) -> float:
    """Return sigma [1/m3; 1/m2 in two dimensions] for a spacing d [m]: the sum of W d^dimension over the lattice is 1."""
    q = np.linalg.norm(lattice(1.0, dimension), axis=1) / SUPPORT
    return float(1.0 / (kernel(q, 1.0).sum() * spacing**dimension))


def steepest_slope(spacing: float, dimension: int) -> float:
    """Return the largest |grad W| [1/m4; 1/m3 in two dimensions], that at q = 1/4, for a spacing d [m]."""
    return -0.25 * float(kernel_slope_over_q(np.float64(0.25), normalisation(spacing, dimension))) / (SUPPORT * spacing)


@lru_cache
def lattice_moment(dimension: int) -> float:
    """Return m_0 [1]: the trace of M = sum_j V x_ij (x) grad W_ij on the lattice over the dimension; an exact gradient would have 1."""
    points = lattice(1.0, dimension)
    sigma = normalisation(1.0, dimension)
    squares = (points**2).sum(axis=1)
    slopes = -kernel_slope_over_q(np.sqrt(squares) / SUPPORT, sigma) / SUPPORT**2
    return float((slopes * squares).sum() / dimension)


@lru_cache
def lattice_stiffness(dimension: int) -> float:
    """Return c [1], the largest omega^2 d^2 rho / p of particles that swing about their lattice under the pressure p.

    Pair vectors are V grad W / m. Layers that move against each other, u = e cos(pi z), change no density. The pressure's force is
    -(2 p / m rho) sum_j V grad grad W_ij (u_i - u_j), with grad grad W = (W' / r) 1 + (W'' - W' / r) e e^T. No wave is shorter; the stiffer
    of the directions of e counts.
    """
    points = lattice(1.0, dimension)
    squares = (points**2).sum(axis=1)
    points, q = points[squares > 0.0], np.sqrt(squares[squares > 0.0]) / SUPPORT
    sigma, outer = normalisation(1.0, dimension), np.maximum(1.0 - q, 0.0)
    against = (points[:, 2] % 2.0 == 1.0) * 4.0 / lattice_moment(dimension)  # 2 (1 - cos(pi z)) / m
    isotropic = -20.0 * sigma * outer**3 / SUPPORT**2
    along = 60.0 * sigma * q * outer**2 / (SUPPORT * q) ** 2 / SUPPORT**2
    return float((against[:, None] * (isotropic[:, None] + along[:, None] * points**2)).sum(axis=0)[[0, 2]].max())


@lru_cache
def lattice_diagonal(dimension: int) -> float:
    """Return V^2 sum |grad W|^2 on the lattice of spacing 1, the pairs' part of the diagonal (Qiu et al. 2021, Eq. 13)."""
    points = lattice(1.0, dimension)
    sigma = normalisation(1.0, dimension)
    squares = (points**2).sum(axis=1)
    slopes = -kernel_slope_over_q(np.sqrt(squares) / SUPPORT, sigma) / SUPPORT**2
    return float((slopes**2 * squares).sum())

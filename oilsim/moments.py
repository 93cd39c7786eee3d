"""Symmetric 3x3 matrices as tuples xx, xy, xz, yy, yz, zz: inverse and smallest eigenvalue, for moment matrices of particles."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.smoothing_kernels import FAST

TINY = np.float32(1e-12)


@njit(inline="always", **FAST)
def inverse(m):
    """Inverse of m; grows without bound as m becomes singular."""
    xx, xy, xz, yy, yz, zz = m
    cxx, cxy, cxz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    factor = np.float32(1.0) / (xx * cxx + xy * cxy + xz * cxz + TINY)
    return (
        factor * cxx,
        factor * cxy,
        factor * cxz,
        factor * (xx * zz - xz * xz),
        factor * (xy * xz - xx * yz),
        factor * (xx * yy - xy * xy),
    )


@njit(inline="always", **FAST)
def smallest_eigenvalue(m):
    """Smallest eigenvalue of m, by the trigonometric solution of its characteristic cubic (Smith 1961)."""
    xx, xy, xz, yy, yz, zz = m
    mean = (xx + yy + zz) / np.float32(3.0)
    ax, ay, az = xx - mean, yy - mean, zz - mean
    across = xy * xy + xz * xz + yz * yz
    size = math.sqrt((ax * ax + ay * ay + az * az + np.float32(2.0) * across) / np.float32(6.0)) + TINY
    determinant = ax * (ay * az - yz * yz) - xy * (xy * az - yz * xz) + xz * (xy * yz - ay * xz)
    cosine = max(min(determinant / (np.float32(2.0) * size * size * size), np.float32(1.0)), np.float32(-1.0))
    return mean + np.float32(2.0) * size * math.cos((math.acos(cosine) + np.float32(2.0 * np.pi)) / np.float32(3.0))

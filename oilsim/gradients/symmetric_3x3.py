"""Determinant, inverse and smallest eigenvalue of symmetric 3x3 matrices, given as six numbers xx, xy, xz, yy, yz, zz."""

from __future__ import annotations

import math

import numpy as np

from oilsim.backend.jit import inlined

# [1] added to denominators that may vanish; theory; far below what moment matrices of 1 are rounded by
TINY = np.float32(1e-12)
# [1] coefficients of a polynomial for cos((2 asin s + 2 pi) / 3) on 0 <= s <= 1; theory (Chebyshev interpolation); error below 2e-7
THIRD = tuple(np.float32(c) for c in (-0.5000002, -0.5773319, 0.1108055, -0.0514748, 0.0263997, -0.0105018, 0.0021035))


@inlined
def determinant(m):
    """Return the determinant of m."""
    xx, xy, xz, yy, yz, zz = m
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)


@inlined
def inverse(m):
    """Return the inverse of m as six numbers; it grows without bound as m becomes singular."""
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


@inlined
def smallest_eigenvalue(m):
    """Return the smallest eigenvalue of m, by the trigonometric solution of its characteristic cubic (Smith 1961).

    The function cos((acos c + 2 pi) / 3) is smooth in s = sqrt((1 - c) / 2). The polynomial THIRD in s replaces its slow calls.
    """
    xx, xy, xz, yy, yz, zz = m
    mean = (xx + yy + zz) / np.float32(3.0)
    ax, ay, az = xx - mean, yy - mean, zz - mean
    across = xy * xy + xz * xz + yz * yz
    size = math.sqrt((ax * ax + ay * ay + az * az + np.float32(2.0) * across) / np.float32(6.0)) + TINY
    determinant = ax * (ay * az - yz * yz) - xy * (xy * az - yz * xz) + xz * (xy * yz - ay * xz)
    cosine = determinant / (np.float32(2.0) * size * size * size)
    s = math.sqrt(max(min(np.float32(0.5) - np.float32(0.5) * cosine, np.float32(1.0)), np.float32(0.0)))
    third = THIRD[0] + s * (THIRD[1] + s * (THIRD[2] + s * (THIRD[3] + s * (THIRD[4] + s * (THIRD[5] + s * THIRD[6])))))
    return mean + np.float32(2.0) * size * third

"""Rotations of many bodies at once, without the overhead of one object for each, or of array operations on a few rows."""

from __future__ import annotations

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.backend.jit import njit
from oilsim.loads.body_axes import rotation_matrices


@njit(nogil=True, cache=True, error_model="numpy")
def cross(first: Array, second: Array) -> Array:
    """Compute first x second, both (B, 3) of any unit [-]."""
    result = np.empty((len(first), 3))
    for n in range(len(first)):
        (a, b, c), (x, y, z) = first[n], second[n]
        result[n, 0], result[n, 1], result[n, 2] = b * z - c * y, c * x - a * z, a * y - b * x
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def turned(first: Array, second: Array) -> Array:
    """Multiply quaternions `first` and `second` (B, 4) xyzw: the product turns by `second`, and then by `first`."""
    result = np.empty((len(first), 4))
    for n in range(len(first)):
        (a, b, c, d), (x, y, z, w) = first[n], second[n]
        result[n, 0] = d * x + w * a + b * z - c * y
        result[n, 1] = d * y + w * b + c * x - a * z
        result[n, 2] = d * z + w * c + a * y - b * x
        result[n, 3] = d * w - a * x - b * y - c * z
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def in_world(orientation: Array, tensor: Array) -> Array:
    """Compute R T R^T (B, 3, 3) of `tensor` (B, 3, 3) [-], of any unit, along the axes of bodies with quaternions `orientation` (B, 4)."""
    rotation = rotation_matrices(orientation)
    result = np.zeros((len(orientation), 3, 3))
    for n in range(len(orientation)):
        for row in range(3):
            for axis in range(3):
                along = 0.0
                for other in range(3):
                    along += rotation[n, row, other] * tensor[n, other, axis]
                for column in range(3):
                    result[n, row, column] += along * rotation[n, column, axis]
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def applied(tensor: Array, vector: Array) -> Array:
    """Compute T v (B, K) of `tensor` (B, K, K) and `vector` (B, K), of any units [-]."""
    result = np.zeros(vector.shape)
    for n in range(len(vector)):
        for row in range(vector.shape[1]):
            for column in range(vector.shape[1]):
                result[n, row] += tensor[n, row, column] * vector[n, column]
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def places_of(rows: tuple[int, ...], points: Array, pose: Array) -> tuple[Array, Array]:
    """Return places (P, 3) [m] of points (P, 3) [m] along the axes of bodies, and arms (P, 3) [m] from their centres of mass; pose (B, 7).

    rows: of the bodies; for -1, the world, a point is the place itself.
    """
    place, arm = points.copy(), points.copy()
    for end in range(len(rows)):
        if rows[end] < 0:
            continue
        x, y, z, w = pose[rows[end], 3:]
        a, b, c = points[end]
        # R p = p + 2 q x (q x p + w p)
        d, e, f = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c
        arm[end, 0] += 2.0 * (y * f - z * e)
        arm[end, 1] += 2.0 * (z * d - x * f)
        arm[end, 2] += 2.0 * (x * e - y * d)
        for axis in range(3):
            place[end, axis] = pose[rows[end], axis] + arm[end, axis]
    return place, arm

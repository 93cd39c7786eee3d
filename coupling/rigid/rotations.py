"""Rotations of many bodies at once, without the overhead of an object for each, or of array operations on a few rows."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]


@njit(nogil=True, cache=True, error_model="numpy")
def rotation_matrices(orientation: Array) -> Array:
    """Matrices (B, 3, 3), body axes to world axes, of unit quaternions (B, 4), x y z w."""
    result = np.empty((len(orientation), 3, 3))
    for n in range(len(orientation)):
        x, y, z, w = orientation[n]
        result[n, 0, 0], result[n, 0, 1], result[n, 0, 2] = (
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        )
        result[n, 1, 0], result[n, 1, 1], result[n, 1, 2] = (
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        )
        result[n, 2, 0], result[n, 2, 1], result[n, 2, 2] = (
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        )
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def cross(first: Array, second: Array) -> Array:
    """first x second, both (B, 3)."""
    result = np.empty((len(first), 3))
    for n in range(len(first)):
        (a, b, c), (x, y, z) = first[n], second[n]
        result[n, 0], result[n, 1], result[n, 2] = b * z - c * y, c * x - a * z, a * y - b * x
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def turned(first: Array, second: Array) -> Array:
    """Products (B, 4) of the quaternions (B, 4) xyzw: the turn `second`, and then `first`."""
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
    """R T R^T (B, 3, 3) of tensors (B, 3, 3) along the axes of bodies of orientations (B, 4)."""
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
    """T v (B, K) of tensors (B, K, K) and vectors (B, K)."""
    result = np.zeros(vector.shape)
    for n in range(len(vector)):
        for row in range(vector.shape[1]):
            for column in range(vector.shape[1]):
                result[n, row] += tensor[n, row, column] * vector[n, column]
    return result

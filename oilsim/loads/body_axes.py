"""Vectors and matrices along the axes of bodies, for kernels: of a quaternion, into a body, the cross product, and what acts at an arm."""

from __future__ import annotations

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.backend.jit import njit


@njit(nogil=True, cache=True, error_model="numpy")
def write_matrix(orientation: Array, result: Array) -> None:
    """Write the matrix (3, 3), body axes to world axes, of a unit quaternion (4,) xyzw to `result`."""
    x, y, z, w = orientation[0], orientation[1], orientation[2], orientation[3]
    result[0, 0], result[0, 1], result[0, 2] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)
    result[1, 0], result[1, 1], result[1, 2] = 2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)
    result[2, 0], result[2, 1], result[2, 2] = 2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)


@njit(nogil=True, cache=True, error_model="numpy")
def rotation_matrices(orientation: Array) -> Array:
    """Compute matrices (B, 3, 3), body axes to world axes, of unit quaternions (B, 4) xyzw."""
    result = np.empty((len(orientation), 3, 3))
    for n in range(len(orientation)):
        write_matrix(orientation[n], result[n])
    return result


@njit(nogil=True, cache=True, error_model="numpy")
def into_body(turn: Array, vector: Array, result: Array) -> None:
    """Write R^T `vector` (3,), of any unit, as [m/s], along a body's axes, to `result` (3,)."""
    for own in range(3):
        result[own] = turn[0, own] * vector[0] + turn[1, own] * vector[1] + turn[2, own] * vector[2]


@njit(nogil=True, cache=True, error_model="numpy")
def cross(a: Array, b: Array, result: Array) -> None:
    """Write a x b, both (3,) of any unit, as [m] and [N], to `result` (3,)."""
    result[0] = a[1] * b[2] - a[2] * b[1]
    result[1] = a[2] * b[0] - a[0] * b[2]
    result[2] = a[0] * b[1] - a[1] * b[0]


@njit(nogil=True, cache=True, error_model="numpy")
def spread(matrix: Array, arm: Array, values: Array) -> None:
    """Add J^T diag(`values`) J to a matrix (6, 6), with J = [1, -arm x] the velocity at `arm` (3,) [m] by the twist; values (3,)."""
    for axis in range(3):
        value, after, before = values[axis], (axis + 1) % 3, (axis + 2) % 3
        # J's row of this axis is (e_axis, e_after arm_before - e_before arm_after)
        one, other = value * arm[before], -value * arm[after]
        matrix[axis, axis] += value
        matrix[axis, 3 + after] += one
        matrix[3 + after, axis] += one
        matrix[axis, 3 + before] += other
        matrix[3 + before, axis] += other
        matrix[3 + after, 3 + after] += one * arm[before]
        matrix[3 + before, 3 + before] -= other * arm[after]
        matrix[3 + after, 3 + before] -= one * arm[after]
        matrix[3 + before, 3 + after] -= one * arm[after]

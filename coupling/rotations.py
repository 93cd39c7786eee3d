"""Rotations of many bodies at once, without the overhead of an object for each."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def rotation_matrices(orientation: Array) -> Array:
    """Matrices (B, 3, 3), body axes to world axes, of unit quaternions (B, 4), x y z w."""
    x, y, z, w = 2.0 * orientation[:, None, :].T * orientation.T  # x[k] (B,) = 2 q_x q_k, and so on
    result = np.empty((len(orientation), 3, 3))
    result[:, 0, 0], result[:, 0, 1], result[:, 0, 2] = 1.0 - y[1] - z[2], x[1] - w[2], x[2] + w[1]
    result[:, 1, 0], result[:, 1, 1], result[:, 1, 2] = x[1] + w[2], 1.0 - x[0] - z[2], y[2] - w[0]
    result[:, 2, 0], result[:, 2, 1], result[:, 2, 2] = x[2] - w[1], y[2] + w[0], 1.0 - x[0] - y[1]
    return result


def cross(first: Array, second: Array) -> Array:
    """first x second, both (B, 3); several times faster than numpy's own for few rows."""
    (a, b, c), (x, y, z) = first.T, second.T
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=1)


def turned(first: Array, second: Array) -> Array:
    """Products (B, 4) of the quaternions (B, 4) xyzw: the turn `second`, and then `first`."""
    axis, real, other_axis, other_real = first[:, :3], first[:, 3:], second[:, :3], second[:, 3:]
    vector = real * other_axis + other_real * axis + cross(axis, other_axis)
    return np.hstack([vector, real * other_real - (axis * other_axis).sum(axis=1, keepdims=True)])

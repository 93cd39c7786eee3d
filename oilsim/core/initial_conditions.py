"""Blocks, cylinders and balls of liquid as regular lattices of particles, one rest volume each."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

# [1] particles of one block; numerical; their positions alone take 24 GB
MOST_PARTICLES = 1e9


def block(lower: ArrayLike, upper: ArrayLike, spacing: float, dimension: int = 3) -> NDArray[np.float64]:
    """Return positions (N, 3) [m] that fill a box with round(extent / spacing) particles along each axis, centred in it.

    lower, upper: corners of the box, (3,) each [m]. In two dimensions y is 0. ValueError where the box is too thin for one particle, or
    holds more than `MOST_PARTICLES`, and for a spacing that is not above 0.
    """
    low, high = np.asarray(lower, np.float64), np.asarray(upper, np.float64)
    if not (math.isfinite(spacing) and spacing > 0.0):
        raise ValueError(f"block: spacing is {spacing:g}, allowed: above 0 m")
    filled = [axis for axis in range(3) if dimension == 3 or axis != 1]
    total = math.prod(float(high[axis] - low[axis]) / spacing for axis in filled if high[axis] - low[axis] > spacing)
    if not total <= MOST_PARTICLES:
        raise ValueError(
            f"block has {total:.3g} particles at a spacing of {spacing:g} m, allowed: up to {MOST_PARTICLES:.0e}"
        )
    axes = []
    for axis in range(3):
        if axis not in filled:
            axes.append(np.zeros(1))
            continue
        count = round((high[axis] - low[axis]) / spacing)
        if count < 1:
            raise ValueError(
                f"block is {high[axis] - low[axis]} m along {'xyz'[axis]}, allowed: half the particle spacing {spacing} m or more"
            )
        axes.append(0.5 * (low[axis] + high[axis]) + (np.arange(count) - 0.5 * (count - 1)) * spacing)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def cylinder(
    base_center: ArrayLike, axis: ArrayLike, radius: float, height: float, spacing: float
) -> NDArray[np.float64]:
    """Return positions (N, 3) [m] of a lattice inside a cylinder that stands on `base_center` (3,) [m] and points along `axis` (3,).

    radius, height and spacing in [m]. ValueError for an axis that is 0, or a cylinder too short for one particle.
    """
    direction = np.asarray(axis, np.float64)
    length = np.linalg.norm(direction)
    if not length > 0.0:
        raise ValueError(f"cylinder axis is {direction.tolist()}, allowed: a vector that is not 0")
    direction = direction / length
    helper = np.eye(3)[np.argmin(np.abs(direction))]
    first = np.cross(direction, helper)
    first /= np.linalg.norm(first)
    second = np.cross(direction, first)
    local = block((-radius, -radius, 0.0), (radius, radius, height), spacing)
    local = local[np.hypot(local[:, 0], local[:, 1]) <= radius]
    return np.asarray(base_center, np.float64) + local @ np.stack([first, second, direction])


def sphere(center: ArrayLike, radius: float, spacing: float, dimension: int = 3) -> NDArray[np.float64]:
    """Return positions (N, 3) [m] of a lattice inside a ball about `center` (3,) [m]; in two dimensions a disc in x and z."""
    local = block((-radius,) * 3, (radius,) * 3, spacing, dimension)
    return np.asarray(center, np.float64) + local[np.linalg.norm(local, axis=1) <= radius]

"""Wrenches of forces that act beside the centre of mass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.jit import njit

Double = NDArray[np.float64]


@njit(nogil=True, cache=True, error_model="numpy")
def add_force_at(wrench: Double, arm: Double, force: Double) -> None:
    """Add `force` (3,) [N] at `arm` (3,) [m] from the centre of mass to a wrench (6,) [N, N m] about it."""
    for axis in range(3):
        after, before = (axis + 1) % 3, (axis + 2) % 3
        wrench[axis] += force[axis]
        wrench[3 + axis] += arm[after] * force[before] - arm[before] * force[after]

"""The stage of a step that moves particles by their velocities."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float32]


def advect(position: Real, velocity: Real, time_step: float) -> None:
    """Move particles at `position` (3, N) [m], in place, by their `velocity` (3, N) [m/s]."""
    position += np.float32(time_step) * velocity


def wrap_periodic(position: Real, lower: Sequence[float], period: Sequence[np.float32] | None) -> None:
    """Bring particles at `position` (3, N) [m], in place, that crossed a periodic side back in at the other.

    lower (3,): corner of the domain [m]; period (3,): lengths of the axes that repeat [m], 0 of the others; None if none does.
    """
    for axis, length in enumerate(period or ()):
        if length > 0.0:
            position[axis] -= length * np.floor((position[axis] - np.float32(lower[axis])) / length)

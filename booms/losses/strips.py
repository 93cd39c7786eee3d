"""The oil before each segment of a boom: which particle the water carries to which segment, and how much of it the boom holds up."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


def segments_ahead(points: Array, line: Array, flow: Array) -> NDArray[np.int64]:
    """Return, for each point (N, 2) [m], the segment of `line` (S + 1, 2) to which the water carries it; -1 for none.

    flow (2,) [m/s]: of the water relative to the boom. The segment is the first that a straight way along the flow meets. Without flow, and
    where the way meets none, it is the nearest one within a segment's length.
    """
    found = np.empty(len(points), np.int64)
    speed = float(np.hypot(*flow))
    direction = np.asarray(flow, np.float64) / speed if speed > 1e-3 else np.zeros(2)
    _find_segments(np.ascontiguousarray(points), np.ascontiguousarray(line), direction, found)
    return found


@njit(nogil=True, cache=True, error_model="numpy")
def _find_segments(points: Array, line: Array, direction: Array, found: NDArray[np.int64]) -> None:
    """Fill found (N,); see `segments_ahead`. direction (2,) is a unit vector or 0."""
    for i in range(len(points)):
        first, nearest, choice, beside = 1e300, 1e300, -1, -1
        for k in range(len(line) - 1):
            ax, ay = line[k, 0] - points[i, 0], line[k, 1] - points[i, 1]
            ex, ey = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
            across = direction[0] * ey - direction[1] * ex
            if abs(across) > 1e-12:
                way = (ax * ey - ay * ex) / across
                along = (ax * direction[1] - ay * direction[0]) / across
                if way >= 0.0 and 0.0 <= along <= 1.0 and way < first:
                    first, choice = way, k
            length = ex * ex + ey * ey
            part = min(max(-(ax * ex + ay * ey) / max(length, 1e-30), 0.0), 1.0)
            gap = math.hypot(ax + part * ex, ay + part * ey)
            if gap < nearest and gap * gap <= length:
                nearest, beside = gap, k
        found[i] = choice if choice >= 0 else beside


def standing_share(
    velocity: Array, segment: NDArray[np.int64], normal: Array, boom_velocity: Array, speed: Array
) -> Array:
    """Return how far each particle (N,) is held up, from 0, it moves with the water, to 1, it stands before its segment.

    1 - (v - v_segment) . n / U, within 0 and 1. velocity (N, 2) [m/s]; segment (N,) from 0 on; normal (S, 2) outward; boom_velocity (S, 2)
    and speed U (S,) [m/s] of the water against the segment. A slick that the water carries along is not torn by it.
    """
    drift = ((velocity - boom_velocity[segment]) * normal[segment]).sum(axis=1)
    against = speed[segment]
    share = 1.0 - np.divide(drift, against, out=np.ones_like(drift), where=against > 0.0)
    return np.asarray(np.clip(share, 0.0, 1.0))

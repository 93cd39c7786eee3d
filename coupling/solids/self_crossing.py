"""Finds triangles of a surface that pass through each other.

Two triangles cross if an edge of one passes through the other: its ends lie on both sides of the other's plane, and it meets that plane
in the triangle. Triangles that share corners or touch do not cross. The pairs that may cross are found by a sweep along one axis over the
triangles' boxes.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

TOUCHING = 1e-7  # of the surface's size: how far an edge must reach to both sides to pass through
ROUNDING = 1e-12  # of the surface's size: an edge so near a border of two triangles passes through one of them, in spite of rounding


def crossing_triangles(vertices: Array, faces: Integers) -> tuple[int, int] | None:
    """Return the indices of two triangles that pass through each other, None if there are none.

    vertices: (V, 3); faces: (F, 3). The unit is free.
    """
    triangles = np.ascontiguousarray(vertices[faces], dtype=np.float64)
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    size = float(np.max(high.max(axis=0) - low.min(axis=0)))
    axis = int(np.argmin((high - low).sum(axis=0) / np.maximum(np.ptp(low, axis=0), 1e-300)))
    order = np.argsort(low[:, axis], kind="stable")
    first = _sweep(axis, low[order], high[order], triangles[order], faces[order].astype(np.int64), TOUCHING * size)
    return None if first[0] < 0 else (int(order[first[0]]), int(order[first[1]]))


@njit(nogil=True, cache=True, error_model="numpy")
def _sweep(axis, low, high, triangles, faces, tolerance):
    """Return the first pair of crossing triangles, in the order of `low` along `axis`; (-1, -1) if there is none."""
    one, other = (axis + 1) % 3, (axis + 2) % 3
    for i in range(len(low)):
        for j in range(i + 1, len(low)):
            if low[j, axis] > high[i, axis]:
                break
            if low[j, one] > high[i, one] or low[i, one] > high[j, one]:
                continue
            if low[j, other] > high[i, other] or low[i, other] > high[j, other]:
                continue
            shared = 0
            for corner in range(3):
                own = faces[i, corner]
                shared += own == faces[j, 0] or own == faces[j, 1] or own == faces[j, 2]
            if shared >= 2:  # neighbours meet in their edge only
                continue
            if _passes(i, j, triangles, faces, tolerance) or _passes(j, i, triangles, faces, tolerance):
                return i, j
    return -1, -1


@njit(nogil=True, cache=True, error_model="numpy", inline="always")
def _cross(ax, ay, az, bx, by, bz):
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@njit(nogil=True, cache=True, error_model="numpy")
def _passes(i, j, triangles, faces, tolerance):
    """Tell whether an edge of triangle i that has no corner of j passes through triangle j."""
    t = triangles[j]
    nx, ny, nz = _cross(
        t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2], t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    )
    area = np.sqrt(nx * nx + ny * ny + nz * nz)
    if area <= tolerance * tolerance:
        return False
    nx, ny, nz = nx / area, ny / area, nz / area
    for corner in range(3):
        following = (corner + 1) % 3
        begin, end = faces[i, corner], faces[i, following]
        if begin == faces[j, 0] or begin == faces[j, 1] or begin == faces[j, 2]:
            continue
        if end == faces[j, 0] or end == faces[j, 1] or end == faces[j, 2]:
            continue
        p, q = triangles[i, corner], triangles[i, following]
        above = nx * (p[0] - t[0, 0]) + ny * (p[1] - t[0, 1]) + nz * (p[2] - t[0, 2])
        below = nx * (q[0] - t[0, 0]) + ny * (q[1] - t[0, 1]) + nz * (q[2] - t[0, 2])
        if above * below >= 0.0 or min(abs(above), abs(below)) <= tolerance:
            continue
        share = above / (above - below)
        x, y, z = p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1]), p[2] + share * (q[2] - p[2])
        if _is_within(x, y, z, t, nx, ny, nz, tolerance * (ROUNDING / TOUCHING)):
            return True
    return False


@njit(nogil=True, cache=True, error_model="numpy")
def _is_within(x, y, z, t, nx, ny, nz, tolerance):
    """Tell whether a point of the plane of triangle t, which has the unit normal n, lies in t or within `tolerance` of it."""
    for side in range(3):
        a, b = t[side], t[(side + 1) % 3]
        ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        length = max(np.sqrt(ex * ex + ey * ey + ez * ez), 1e-300)
        cx, cy, cz = _cross(ex, ey, ez, x - a[0], y - a[1], z - a[2])
        if (cx * nx + cy * ny + cz * nz) / length < -tolerance:
            return False
    return True

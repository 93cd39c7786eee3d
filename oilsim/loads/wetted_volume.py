"""Volume of a closed mesh below a plane, and its centre.

With q a point of the plane, every piece of the wetted surface makes a tetrahedron with q:

    V = sum (a . (b x c)) / 6,   V r = sum (a . (b x c)) / 6 (a + b + c) / 4,   a, b, c from q.

The lid that would close the wetted surface lies in the plane and makes tetrahedra without volume (divergence theorem), so it is not
needed. Its area is minus the sum of the wetted surface's area vectors along the plane's normal. Triangles that cross the plane are
clipped; the result is exact for a mesh of flat triangles.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(nogil=True, cache=True, error_model="numpy")
def _tetrahedron(a, b, c, normal, total):
    """Add volume and moment of the tetrahedron 0, a, b, c (3,) [m], and its part of the lid, to `total` (5,) [m3, m4, m2]."""
    volume = (
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    ) / 6.0
    total[0] += volume
    for axis in range(3):
        total[1 + axis] += 0.25 * volume * (a[axis] + b[axis] + c[axis])
        after, before = (axis + 1) % 3, (axis + 2) % 3
        area = (b[after] - a[after]) * (c[before] - a[before]) - (b[before] - a[before]) * (c[after] - a[after])
        total[4] -= 0.5 * area * normal[axis]


@njit(nogil=True, cache=True, error_model="numpy")
def _crossing(above, below, height_above, height_below):
    """Return the point (3,) [m] at height 0 on the edge between two points."""
    share = height_above / (height_above - height_below)
    return above + share * (below - above)


@njit(nogil=True, cache=True, error_model="numpy")
def wetted_volume(triangles: Array, point: Array, normal: Array) -> Array:
    """Return volume [m3], moment [m4] about `point`, and area of the lid [m2], (5,), of the mesh below a plane.

    triangles (T, 3, 3) [m], closed and outward; point (3,) [m] of the plane; normal (3,), a unit vector to its dry side.
    """
    total, corner, height = np.zeros(5), np.empty((3, 3)), np.empty(3)
    for triangle in triangles:
        below = 0
        for k in range(3):
            height[k] = 0.0
            for axis in range(3):
                corner[k, axis] = triangle[k, axis] - point[axis]
                height[k] += corner[k, axis] * normal[axis]
            below += height[k] < 0.0
        if below == 3:
            _tetrahedron(corner[0], corner[1], corner[2], normal, total)
        elif below > 0:
            odd = 0  # the corner that is alone on its side
            while (height[odd] < 0.0) != (below == 1):
                odd += 1
            a, b, c = corner[odd], corner[(odd + 1) % 3], corner[(odd + 2) % 3]
            ab = _crossing(a, b, height[odd], height[(odd + 1) % 3])
            ac = _crossing(a, c, height[odd], height[(odd + 2) % 3])
            if below == 1:
                _tetrahedron(a, ab, ac, normal, total)
            else:
                _tetrahedron(ab, b, c, normal, total)
                _tetrahedron(ab, c, ac, normal, total)
    return total

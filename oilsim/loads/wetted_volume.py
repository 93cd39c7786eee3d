"""Volume of a closed mesh below a plane, and its centre.

With q a point of the plane, every piece of the wetted surface makes a tetrahedron with q:

    V = sum (a . (b x c)) / 6,   V r = sum (a . (b x c)) / 6 (a + b + c) / 4,   a, b, c from q.

The lid that would close the wetted surface lies in the plane and makes tetrahedra without volume (divergence theorem), so it is not
needed. Its area is minus the sum of the wetted surface's area vectors along the plane's normal. Triangles that cross the plane are
clipped; the result is exact for a mesh of flat triangles.
"""

from __future__ import annotations

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.backend.jit import njit


@njit(nogil=True, cache=True, error_model="numpy")
def _add_tetrahedron(a, b, c, normal, total):
    """Add volume and moment of the tetrahedron 0, a, b, c (3,) [m], and its part of the lid, to `total` (5,) [m3, m4, m2].

    With n = (b - a) x (c - a), twice the area vector of the face, the volume is a . n / 6.
    """
    n_x = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
    n_y = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
    n_z = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    volume = (a[0] * n_x + a[1] * n_y + a[2] * n_z) / 6.0
    total[0] += volume
    for axis in range(3):
        total[1 + axis] += 0.25 * volume * (a[axis] + b[axis] + c[axis])
    total[4] -= 0.5 * (n_x * normal[0] + n_y * normal[1] + n_z * normal[2])


@njit(nogil=True, cache=True, error_model="numpy")
def _crossing(above, below, height_above, height_below):
    """Return the point at height 0 on the edge between two points (3,) [m], as three numbers."""
    share = height_above / (height_above - height_below)
    return (
        above[0] + share * (below[0] - above[0]),
        above[1] + share * (below[1] - above[1]),
        above[2] + share * (below[2] - above[2]),
    )


@njit(nogil=True, cache=True, error_model="numpy")
def wetted_volume(triangles: Array, point: Array, normal: Array) -> Array:
    """Return volume [m3], moment [m4] about `point`, and area of the lid [m2], (5,), of the mesh below a plane.

    triangles (T, 3, 3) [m], closed and outward; point (3,) [m] of the plane; normal (3,), a unit vector to its dry side.
    """
    total = np.empty(5)
    add_wetted_volume(triangles, point, normal, total, np.empty((3, 3)))
    return total


@njit(nogil=True, cache=True, error_model="numpy")
def add_wetted_volume(triangles, point, normal, total, corner):
    """Write the result of `wetted_volume` to `total` (5,) [m3, m4, m2], with its `triangles`, `point` and `normal`.

    corner (3, 3) [m] is room for a triangle.
    """
    total[:] = 0.0
    level = point[0] * normal[0] + point[1] * normal[1] + point[2] * normal[2]
    for t in range(len(triangles)):
        triangle = triangles[t]
        first = triangle[0, 0] * normal[0] + triangle[0, 1] * normal[1] + triangle[0, 2] * normal[2] - level
        second = triangle[1, 0] * normal[0] + triangle[1, 1] * normal[1] + triangle[1, 2] * normal[2] - level
        third = triangle[2, 0] * normal[0] + triangle[2, 1] * normal[1] + triangle[2, 2] * normal[2] - level
        height = (first, second, third)
        below = int(first < 0.0) + int(second < 0.0) + int(third < 0.0)
        if below == 0:
            continue
        for k in range(3):
            for axis in range(3):
                corner[k, axis] = triangle[k, axis] - point[axis]
        if below == 3:
            _add_tetrahedron(corner[0], corner[1], corner[2], normal, total)
            continue
        odd = 0  # the corner that is alone on its side
        while (height[odd] < 0.0) != (below == 1):
            odd += 1
        b_row, c_row = (odd + 1) % 3, (odd + 2) % 3
        a, b, c = corner[odd], corner[b_row], corner[c_row]
        ab = _crossing(a, b, height[odd], height[b_row])
        ac = _crossing(a, c, height[odd], height[c_row])
        if below == 1:
            _add_tetrahedron(a, ab, ac, normal, total)
        else:
            _add_tetrahedron(ab, b, c, normal, total)
            _add_tetrahedron(ab, c, ac, normal, total)

"""The part of a wall that is wet: sums over wall particles end at the free surface, where the liquid beside them ends.

A wall continues the liquid into the solid (`boundary_particles`). Where the liquid ends, above the water's edge, there is nothing to
continue: the wall is dry there and does not press. So a wall particle b counts for a liquid particle i with the share

    w_ib = min(1, max(0, 1/2 + (s_i - x_ib . n_i) / d)),

n_i the outward normal and s_i the depth of i below the plane of the free surface. Both follow from the same sums as the density near a free
surface (`density_feedback`): g_i / |g_i| = -n_i, and |g_i| d / (1 + e_i) tells s_i. The sums depend on w in turn. They begin with the plane
that the liquid's neighbours alone tell along the wall, and ROUNDS substitutions leave less than a hundredth of what the first one changes.
With it a particle at a wall has the sums of one far from it: on a lattice at rest the particle in the water's edge feels 0.2 % of gravity,
and 16 % with the whole wall.

A gap that is too narrow for particles looks like a free surface too. But liquid at a free surface is hardly pressed, and what bears more
than HEAD times the weight of the water above it lies at no surface. So the plane recedes by the excess of the pressure's head h_i:

    s_i + max(0, h_i - HEAD (s_i + d))    in place of s_i.

Distances from a wall (`wall_contact`) are those from the whole wall. Relaxation counts the whole wall too, which keeps the particles in the
water's edge a quarter of a spacing off it: at rest there is no compression that it could mend.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.float32 import HALF, ONE, ZERO
from oilsim.backend.jit import inlined
from oilsim.backend.simd import positive
from oilsim.neighborhood.smoothing_kernels import SUPPORT, plane_integral

# [1] the plane of no free surface: the whole of a wall counts; layout; see `wet_share`
WHOLE = (ZERO, ZERO, ZERO, ONE)
# [1] substitutions that find the plane of the free surface; numerical; see the module's docstring
ROUNDS = 2
# [1] |g_i| d below which no free surface is near; measured; in the layer below the uppermost one it is 0.05, and disorder of water at rest
# makes 0.015 at most beside walls
LEAST = np.float32(0.04)
# [1] head of the pressure, over that of the water above, from which a particle lies at no free surface; numerical; twice the weight is what
# water bears that is thrown up with the acceleration of gravity
HEAD = np.float32(2.0)
# [1] distances from a free surface at which its sums are computed; numerical; steps of 0.04 d
PLACES = 64
# [1] entries of the tables made of them; numerical; as many as places
ENTRIES = 64


class FlatSurface(NamedTuple):
    """Sums of a particle at even distances from a flat free surface, from the surface down (PLACES,).

    distance     s [d]
    missing      share of the kernel that lies beyond the surface [1]
    ratio        |g| d / (1 + e) [1], which falls with s
    """

    distance: NDArray[np.float64]
    missing: NDArray[np.float64]
    ratio: NDArray[np.float64]


class DepthTable(NamedTuple):
    """Depth s below a flat free surface at even steps of |g| d / (1 + e), from 0 deep inside to its value at the surface.

    depth (ENTRIES,)    [d]
    per_slope           entries per unit of |g| / (1 + e) [m]
    spacing             d [m]
    head (N,)           head of the particles' pressure [d]
    """

    depth: NDArray[np.float32]
    per_slope: np.float32
    spacing: np.float32
    head: NDArray[np.float32]


@lru_cache
def flat_surface(dimension: int) -> FlatSurface:
    """Return the sums below a flat free surface, with the kernel's integrals for those over particles."""
    distance = np.linspace(0.0, SUPPORT, PLACES)
    slope = np.array([plane_integral(float(s), dimension) for s in distance])
    missing = np.concatenate([np.cumsum((0.5 * (slope[1:] + slope[:-1]) * np.diff(distance))[::-1])[::-1], [0.0]])
    return FlatSurface(distance, missing, slope / (1.0 - missing))


@lru_cache
def depth_table(spacing: float, dimension: int) -> DepthTable:
    """Return the table of depths for a particle spacing d [m], without the heads of particles."""
    distance, _, ratio = flat_surface(dimension)
    depth = np.interp(np.linspace(0.0, ratio[0], ENTRIES), ratio[::-1], distance[::-1])
    return DepthTable(
        depth.astype(np.float32), np.float32((ENTRIES - 1) / float(ratio[0]) * spacing), np.float32(spacing),
        np.empty(0, np.float32),
    )  # fmt: skip


def no_surface(count: int) -> NDArray[np.float32]:
    """Return planes (N, 4) of `count` particles that have no free surface near: all walls are wet."""
    return np.full((count, 4), WHOLE, np.float32)


@inlined
def wet_share(plane, dx, dy, dz):
    """Return w_ib [1] of lanes of wall particles; plane: n_i / d (3) [1/m] and s_i / d + 1/2 [1]; dx, dy, dz: lanes of x_i - x_b [m]."""
    place = dx * plane[0] + dy * plane[1] + dz * plane[2] + plane[3]
    return positive(place) - positive(place - ONE)


@inlined
def along_wall(slope, push):
    """Return the part of the liquid's gradient sum, `slope` (3) [1/m], that is normal to that of the walls, `push` (3) [1/m]."""
    square = push[0] * push[0] + push[1] * push[1] + push[2] * push[2] + np.float32(1e-12)
    share = (slope[0] * push[0] + slope[1] * push[1] + slope[2] * push[2]) / square
    return slope[0] - share * push[0], slope[1] - share * push[1], slope[2] - share * push[2]


@inlined
def place_plane(i, planes, content, gradient, depths):
    """Set row i of `planes` (N, 4) to the plane of the free surface, or to none where none is near; returns whether there is one.

    content: 1 + e_i [1]; gradient: g_i (3) [1/m]; depths: a `DepthTable`.
    """
    plane = planes[i]
    gx, gy, gz = gradient
    length = np.float32(math.sqrt(gx * gx + gy * gy + gz * gz))
    if length * depths.spacing < LEAST:
        plane[0], plane[1], plane[2], plane[3] = WHOLE
        return False
    place = min(depths.per_slope * length / content, np.float32(ENTRIES - 1))
    entry = min(np.int64(place), np.int64(ENTRIES - 2))
    depth = depths.depth[entry] + (place - np.float32(entry)) * (depths.depth[entry + 1] - depths.depth[entry])
    scale = -ONE / (length * depths.spacing)
    depth += max(depths.head[i] - HEAD * (depth + ONE), ZERO)
    plane[0], plane[1], plane[2], plane[3] = gx * scale, gy * scale, gz * scale, depth + HALF
    return True

"""Estimates a submerged body's added mass: the mass of liquid that the body accelerates along with itself.

With e_i the direction from the body's surface to a point i of a lattice about it, m_i the liquid's mass that the point stands for, r_i the
surface point and the row j_i = (e_i, r_i x e_i),

    A = sum_i m_i j_i j_i^T    over the points within the depth l of the surface,

the kinetic energy of liquid that follows the normal velocity of the surface. l = c S^(1/2) with S the body's whole surface, c S in
two dimensions (per metre). For a sphere the exact A needs c = 0.101, for a disc 0.169; in two dimensions a cylinder needs 0.117
and a plate 0.196. The value used lies between them, and A is right within a factor of two. The estimate serves to choose how a body is
coupled; no exchange of forces relies on it.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from oilsim import BoundaryParticles, block

Array = npt.NDArray[np.float64]

DEPTH = {3: 0.13, 2: 0.15}  # c
PATCH = {3: 4, 2: 2}  # nearest wall particles from whose mean a point is seen
FINEST = 32  # points of the lattice along the body at most


def added_mass(boundary: BoundaryParticles, spacing: float, dimension: int, density: float) -> Array:
    """Return A (6, 6) [kg, kg m, kg m2] in the body's frame, about its origin, in liquid of `density` [kg/m3; kg/m2 in two dimensions].

    The wall particles of `boundary` continue a lattice of `spacing` [m] half a spacing behind the surface.
    """
    facing = boundary.area > 0.0
    position = boundary.position
    surface = float(boundary.area.sum())
    depth = DEPTH[dimension] * (math.sqrt(surface) if dimension == 3 else surface)
    low, high = position.min(axis=0), position.max(axis=0)
    step = max(spacing, float((high - low).max()) / FINEST)
    margin = (depth + step) * np.array((1.0, float(dimension == 3), 1.0))
    points = block(low - margin, high + margin, step, dimension=dimension)
    # behind the first layer a second one is nearer, or, where the body is thin, the other side's first
    points = points[facing[cKDTree(position).query(points)[1]]]
    distance, index = cKDTree(position[facing]).query(points, range(1, min(PATCH[dimension], int(facing.sum())) + 1))
    height = distance[:, 0] - 0.5 * spacing  # above the surface
    share = np.clip((depth - height) / step + 0.5, 0.0, 1.0) * (height > 0.0)
    away = points - position[facing][index].mean(axis=1)
    direction = away / np.maximum(np.linalg.norm(away, axis=1), 1e-9 * depth)[:, None]
    rows = np.hstack([direction, np.cross(points - height[:, None] * direction, direction)])
    return np.asarray(np.einsum("i,ij,ik->jk", density * step**dimension * share, rows, rows))

"""The shape of surfaces at their wall points, for `oilsim.boundaries.wall_curvature`.

A plane through the points of the wall's face within NEAR gives the normal, and the quadric
through those within FIT, whose normals agree, gives S. Where points lie farther off it than ROUGH, as at edges, and where the wall is flat,
S is 0.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from oilsim.backend.arrays import Array, Ints
from oilsim.boundaries.wall_curvature import entries, matrices

Ends = tuple[Ints, Ints]

# [d] from a point of a wall, within which its face's points make a plane; numerical; the nearest ones on all sides
NEAR = 1.75
# [d] within which they make a quadric; numerical; the kernel's reach
FIT = 2.75
# [1] cosine between normals of one face; numerical; sides that meet at right angles have 0, a wall of radius 4 d has 0.8 across FIT
ALIKE = 0.8
# [d] root mean square of the points' distances from the quadric, from which a wall has no shape; numerical; 0.02 for a radius of 4 d
ROUGH = 0.05
# [1] standard deviations that a curvature must be from 0; numerical; sampled flat sides have fewer, but for one point in a hundred
SURE = 5.0
# [1/d] curvature below which a wall is flat; numerical; a radius of 1000 d
FLAT = 1e-3
# [1/d] curvature from which a bend counts as an edge; numerical; rows along a right angle and beside it lie on a quadric of 1.4
EDGE = 0.3
# [1] added to the diagonal of the fit, which vanishes for the axis that a plane has not; numerical; far below sums over points
RIDGE = 1e-9


def surface_shape(position: Array, area: Array, spacing: float, dimension: int = 3) -> Array | None:
    """Return normals [1] and shape operators [1/m] of wall points (M, 3) [m], (M, 9), as in `BoundaryParticles`; None for flat faces.

    Points with an area (M,) [m2] make up the face; others have the shape of the face point that is nearest to them. spacing: d [m].
    """
    face = area > 0.0
    points = position[face] / spacing
    if len(points) == 0:
        return None
    pairs = pairs_within(points, FIT)
    moments = plane_moments(points, pairs_within(points, NEAR))
    if dimension == 2:
        moments[:, 1, 1] = FIT**2 * len(points)  # the axis that is absent comes last
    size, axes = np.linalg.eigh(moments)
    normal = np.where((size[:, 1] > size[:, 0])[:, None], axes[:, :, 0], 0.0)
    frame = axes.transpose(0, 2, 1)
    operator = _shape_operators(quadric_sums(points, pairs, frame), frame, 6 if dimension == 3 else 3)
    curved = np.any(operator != 0.0, axis=1)
    alike = np.bincount(pairs[0], np.asarray(curved)[pairs[1]]) / np.bincount(pairs[0])
    operator[alike < 0.5] = 0.0  # a sampled flat side has curved points near its edges, but one by one
    if not operator.any():
        return None
    shapes = np.zeros((len(position), 9))
    shapes[face] = found = np.concatenate([normal, operator / spacing], axis=1)
    shapes[~face] = _of_nearest(position[~face] / spacing, points, found, spacing)
    return shapes


def _shape_operators(sums: Array, frame: Array, unknowns: int) -> Array:
    """Return the shape operators (K, 6) [1/d] of the quadrics that fit the sums (K, 6, 8) of `quadric_sums`; 0 where none fits.

    unknowns: number of the coefficients that are not 0.
    """
    count, inverse = sums[:, 0, 0], np.linalg.inv(sums[:, :, :6] + RIDGE * np.eye(6))
    solved = (inverse @ sums[:, :, 6:7])[:, :, 0]
    squares = np.maximum(sums[:, 0, 7] - (solved * sums[:, :, 6]).sum(axis=1), 0.0)
    rough = np.sqrt(squares / count)
    sure = np.abs(solved[:, [3, 5]] / np.sqrt(inverse[:, [3, 5], [3, 5]])).max(axis=1) > SURE * rough
    bend = np.zeros((len(sums), 3, 3))
    bend[:, 1, 1], bend[:, 1, 2], bend[:, 2, 1], bend[:, 2, 2] = solved[:, 3], solved[:, 4], solved[:, 4], solved[:, 5]
    bend /= FIT
    most = np.abs(bend).max(axis=(1, 2))
    curved = (count > unknowns) & sure & (FIT * rough < ROUGH) & (most > FLAT) & (most < EDGE)
    return np.where(curved[:, None], entries(frame.transpose(0, 2, 1) @ bend @ frame), 0.0)


def _of_nearest(places: Array, face: Array, shapes: Array, spacing: float) -> Array:
    """Return the shapes (K, 9) at places (K, 3) [d], each of the nearest of the `face` points (F, 3) [d], bent as deep as the place is."""
    _, nearest = cKDTree(face).query(places, distance_upper_bound=FIT)
    found = np.concatenate([shapes, np.zeros((1, 9))])[nearest]  # the last row where none is near
    beside = np.concatenate([face, np.zeros((1, 3))])[nearest]
    depth = spacing * ((places - beside) * found[:, :3]).sum(axis=1)
    matrix = matrices(found[:, 3:])
    found[:, 3:] += entries(depth[:, None, None] * matrix @ matrix)
    return found


def pairs_within(points: Array, radius: float) -> Ends:
    """Return the ends, (P,) each, of all pairs of points (K, 3) within a radius, in their unit: both ways, and each with itself."""
    one, other = cKDTree(points).query_pairs(radius, output_type="ndarray").T
    own = np.arange(len(points))
    return np.concatenate([own, one, other]), np.concatenate([own, other, one])


def plane_moments(points: Array, pairs: Ends) -> Array:
    """Return sums (K, 3, 3) of (x - m)(x - m)^T over the points (K, 3) that are paired with each, m being their mean, in their unit."""
    first, last = pairs
    away = points[last] - points[first]
    count, total = np.bincount(first), _sums(first, away)
    return _sums(first, away[:, :, None] * away[:, None]) - total[:, :, None] * total[:, None] / count[:, None, None]


def quadric_sums(points: Array, pairs: Ends, frame: Array) -> Array:
    """Return sums (K, 6, 8) of p p^T, p h and, in the first row, h^2 over the points (K, 3) [d] paired with each whose normals agree.

    frame (K, 3, 3): normal and two tangents of each point [1]. With the tangential places a, b and the height h of a point, all over FIT:
    p = (1, a, b, a^2/2, a b, b^2/2).
    """
    alike = np.abs((frame[pairs[0], 0] * frame[pairs[1], 0]).sum(axis=1)) >= ALIKE
    first, last = pairs[0][alike], pairs[1][alike]
    h, a, b = np.einsum("pij,pj->ip", frame[first], points[last] - points[first]) / FIT
    powers = np.stack([np.ones_like(a), a, b, 0.5 * a * a, a * b, 0.5 * b * b], axis=1)
    squares = np.zeros_like(powers)
    squares[:, 0] = h * h
    columns = np.concatenate([powers, h[:, None]], axis=1)
    products = np.concatenate([powers[:, :, None] * columns[:, None], squares[:, :, None]], axis=2)
    return _sums(first, products)


def _sums(owner: Ints, values: Array) -> Array:
    """Add up values (P, ...) by their owners (P,): (K, ...)."""
    flat = values.reshape(len(values), -1).T
    added = np.stack([np.bincount(owner, column).astype(np.float64) for column in flat], axis=1)
    return added.reshape(-1, *values.shape[1:])

"""Curved walls, which liquid that flies straight comes nearer to than its velocity tells.

In a step a particle at the velocity u against a wall of shape S flies straight, and the wall comes in on it by dt^2 u . S u / 2. The wall
points b therefore seem to move along their normals n_b, which adds to the rate of compression

    C_i += -w dt / 2 sum_b (G_ib . n_b) u . S_b u / (1 - h_b u . S_b u / |u|^2),    h_b = (x_i - x_b) . n_b,

with the pair vectors G_ib [1/m] and the walls' weight w of `pressure.pressure_gradient`. S_b [1/m] is the shape operator, z = t . S t / 2
the height of the wall along n_b at the tangential place t: 1/R across an axis, above 0 in a bucket and below 0 round a pile, 0 along it;
its product with n_b does not ask to which side n_b points. The divisor takes the curvature from the wall point to the particle. Moving
bodies count with the velocity of their centre: a wheel that turns in its own shape does not come in.

Without it relaxation pushes liquid in a round bucket back by omega^2 r dt^2 / 2 a step, and liquid that is put elsewhere takes the flow's
velocity there: the bucket takes 0.87 omega^2 dt of its angular momentum a second, whatever the spacing.

The shape is found once for each boundary: a plane through the points of the wall's face within NEAR gives the normal, and the quadric
through those within FIT, whose normals agree, gives S. Where points lie farther off it than ROUGH, as at edges, and where the wall is flat,
S is 0.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from oilsim.backend.jit import FAST, HALF, ONE, ZERO
from oilsim.boundaries.boundary_particles import BoundaryParticles
from oilsim.neighborhood.neighbor_search import nearest_images

Real = NDArray[np.float32]
Double = NDArray[np.float64]
Ends = tuple[NDArray[np.int64], NDArray[np.int64]]

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
# [1] least divisor; numerical; particles are never so far inside a bend that is resolved
LEAST = np.float32(0.25)
# [1] largest share of the volume that a step's curvature asks for; measured; for strain, in `density.density_feedback`
LARGEST = np.float32(0.05)
# [m2/s2] keeps a divisor from being 0; numerical; far below any square
TINY = np.float32(1e-30)


@njit(**FAST)
def add_wall_curvature(begin, end, neighborhood, wall_gradient, curvature, owners, velocity, scales, rate):
    """Add to rate (N,) [1/s] by how much curved walls come in (see above).

    neighborhood                the `Neighborhood`
    wall_gradient (3, Q)        G_ib [1/m]
    curvature (M, 9)            n_b [1] and S_b [1/m] as xx, xy, xz, yy, yz, zz
    owners                      owner (M - R,) of the last wall points, and velocity (3, bodies) of the bodies' centres [m/s]
    velocity (3, N)             v_i [m/s]
    scales                      time step [s] and w [1]
    """
    walls, points, others = neighborhood.walls, neighborhood.points, neighborhood.wall_points
    owner, carried = owners
    resting, time_step, weight = others.shape[0] - owner.size, scales[0], scales[1]
    for i in range(begin, end):
        inflow = ZERO
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = np.int64(walls.neighbor[k])
            nx, ny, nz, xx, xy, xz, yy, yz, zz = curvature[b]
            if xx == ZERO and yy == ZERO and zz == ZERO:
                continue
            ux, uy, uz = velocity[0, i], velocity[1, i], velocity[2, i]
            if b >= resting:
                body = owner[b - resting]
                ux, uy, uz = ux - carried[0, body], uy - carried[1, body], uz - carried[2, body]
            bend = xx * ux * ux + yy * uy * uy + zz * uz * uz
            bend += (ONE + ONE) * (xy * ux * uy + xz * ux * uz + yz * uy * uz)
            dx, dy, dz = points[i, 0] - others[b, 0], points[i, 1] - others[b, 1], points[i, 2] - others[b, 2]
            if neighborhood.period is not None:
                dx, dy, dz = nearest_images(dx, dy, dz, neighborhood.period)
            height = nx * dx + ny * dy + nz * dz
            square = ux * ux + uy * uy + uz * uz
            across = wall_gradient[0, k] * nx + wall_gradient[1, k] * ny + wall_gradient[2, k] * nz
            inflow -= across * bend / max(ONE - height * bend / max(square, TINY), LEAST)
        most = LARGEST / time_step
        rate[i] += max(min(HALF * weight * time_step * inflow, most), -most)


class WallCurvature:
    """The shapes of all boundaries, in the order in which `walls.Walls` has their points.

    rows    (M, 9) normals [1] and shape operators [1/m] in the world, as `add_wall_curvature` takes them; None where every wall is flat
    """

    def __init__(self, spacing: float, dimension: int) -> None:
        """Start without walls; spacing: d [m]."""
        self._spacing, self._dimension = spacing, dimension
        self._shapes: dict[int, Double] = {}
        self._local: Double = np.empty((0, 9))  # of moving bodies, in their own frames
        self.rows: Real | None = None

    def add(self, handle: int, boundary: BoundaryParticles) -> None:
        """Find the shape of a boundary."""
        self._shapes[handle] = surface_shape(boundary, self._spacing, self._dimension)

    def remove(self, handle: int) -> None:
        """Forget the shape of a boundary."""
        del self._shapes[handle]

    def arrange(self, resting: list[int], moving: list[int], order: NDArray[np.uint32]) -> None:
        """Lay out the shapes of the boundaries at rest, whose points lie in `order`, and of those that move."""
        still, self._local = (
            np.concatenate([np.empty((0, 9)), *(self._shapes[h] for h in group)]) for group in (resting, moving)
        )
        rows = np.concatenate([still[order], self._local])
        self.rows = rows.astype(np.float32) if rows[:, 3:].any() else None

    def turn(self, turn: Double) -> None:
        """Turn the shapes of moving bodies by the matrices `turn` (K, 3, 3) [1] of their points."""
        if self.rows is not None and self._local[:, 3:].any():
            matrix = _matrices(self._local[:, 3:])
            moving = self.rows[len(self.rows) - len(turn) :]
            moving[:, :3] = np.einsum("kij,kj->ki", turn, self._local[:, :3])
            moving[:, 3:] = _six(turn @ matrix @ turn.transpose(0, 2, 1))


def surface_shape(boundary: BoundaryParticles, spacing: float, dimension: int) -> Double:
    """Return normals [1] and shape operators [1/m] of the points of a boundary, (M, 9), in its frame; 0 where it has no smooth face.

    Points with an area make up the face; others have the shape of the face point that is nearest to them. spacing: d [m].
    """
    shapes, face = np.zeros((len(boundary.position), 9)), boundary.area > 0.0
    points = boundary.position[face] / spacing
    if boundary.is_flat or len(points) == 0:  # a tank of 150,000 wall particles would take six seconds
        return shapes
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
        return shapes
    shapes[face] = found = np.concatenate([normal, operator / spacing], axis=1)
    shapes[~face] = _of_nearest(boundary.position[~face] / spacing, points, found, spacing)
    return shapes


def _shape_operators(sums: Double, frame: Double, unknowns: int) -> Double:
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
    return np.where(curved[:, None], _six(frame.transpose(0, 2, 1) @ bend @ frame), 0.0)


def _of_nearest(places: Double, face: Double, shapes: Double, spacing: float) -> Double:
    """Return the shapes (K, 9) at places (K, 3) [d], each of the nearest of the `face` points (F, 3) [d], bent as deep as the place is."""
    _, nearest = cKDTree(face).query(places, distance_upper_bound=FIT)
    found = np.concatenate([shapes, np.zeros((1, 9))])[nearest]  # the last row where none is near
    beside = np.concatenate([face, np.zeros((1, 3))])[nearest]
    depth = spacing * ((places - beside) * found[:, :3]).sum(axis=1)
    matrix = _matrices(found[:, 3:])
    found[:, 3:] += _six(depth[:, None, None] * matrix @ matrix)
    return found


def _matrices(six: Double) -> Double:
    """Return symmetric matrices (K, 3, 3) of their entries (K, 6): xx, xy, xz, yy, yz, zz."""
    return six[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)


def _six(matrix: Double) -> Double:
    """Return the entries (K, 6) of symmetric matrices (K, 3, 3): xx, xy, xz, yy, yz, zz."""
    return matrix.reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]]


def pairs_within(points: Double, radius: float) -> Ends:
    """Return the ends, (P,) each, of all pairs of points (K, 3) within a radius, in their unit: both ways, and each with itself."""
    one, other = cKDTree(points).query_pairs(radius, output_type="ndarray").T
    own = np.arange(len(points))
    return np.concatenate([own, one, other]), np.concatenate([own, other, one])


def plane_moments(points: Double, pairs: Ends) -> Double:
    """Return sums (K, 3, 3) of (x - m)(x - m)^T over the points (K, 3) that are paired with each, m being their mean, in their unit."""
    first, last = pairs
    away = points[last] - points[first]
    count, total = np.bincount(first), _sums(first, away)
    return _sums(first, away[:, :, None] * away[:, None]) - total[:, :, None] * total[:, None] / count[:, None, None]


def quadric_sums(points: Double, pairs: Ends, frame: Double) -> Double:
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


def _sums(owner: NDArray[np.int64], values: Double) -> Double:
    """Add up values (P, ...) by their owners (P,): (K, ...)."""
    flat = values.reshape(len(values), -1).T
    added = np.stack([np.bincount(owner, column).astype(np.float64) for column in flat], axis=1)
    return added.reshape(-1, *values.shape[1:])

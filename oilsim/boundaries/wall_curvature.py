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

A boundary brings its shape along (`BoundaryParticles.curvature`), since it is the same in every step.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array, Index, Real
from oilsim.backend.jit import FAST, HALF, ONE, ZERO
from oilsim.boundaries.boundary_particles import BoundaryParticles
from oilsim.neighborhood.neighbor_search import nearest_images

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

    def __init__(self) -> None:
        """Start without walls."""
        self._local: Array = np.empty((0, 9))  # of moving bodies, in their own frames
        self.rows: Real | None = None

    def arrange(self, resting: Iterable[BoundaryParticles], moving: Iterable[BoundaryParticles], order: Index) -> None:
        """Lay out the shapes of the boundaries at rest, whose points lie in `order`, and of those that move."""
        still, self._local = (
            np.concatenate([np.empty((0, 9)), *(_shape_of(each) for each in group)]) for group in (resting, moving)
        )
        rows = np.concatenate([still[order], self._local])
        self.rows = rows.astype(np.float32) if rows[:, 3:].any() else None

    def turn(self, turn: Array) -> None:
        """Turn the shapes of moving bodies by the matrices `turn` (K, 3, 3) [1] of their points."""
        if self.rows is not None and self._local[:, 3:].any():
            matrix = matrices(self._local[:, 3:])
            moving = self.rows[len(self.rows) - len(turn) :]
            moving[:, :3] = np.einsum("kij,kj->ki", turn, self._local[:, :3])
            moving[:, 3:] = entries(turn @ matrix @ turn.transpose(0, 2, 1))


def _shape_of(boundary: BoundaryParticles) -> Array:
    """Return the shape (M, 9) of a boundary, 0 where it says that it is flat."""
    return np.zeros((len(boundary.position), 9)) if boundary.curvature is None else boundary.curvature


def matrices(six: Array) -> Array:
    """Return symmetric matrices (K, 3, 3) of their entries (K, 6), in their unit: xx, xy, xz, yy, yz, zz."""
    return six[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)


def entries(matrix: Array) -> Array:
    """Return the entries (K, 6) of symmetric matrices (K, 3, 3), in their unit: xx, xy, xz, yy, yz, zz."""
    return matrix.reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]]

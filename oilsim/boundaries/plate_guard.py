"""Plates thinner than a particle, which no particle crosses.

The walls' coverage of the kernel tells the distance from a thick wall (`wall_contact`). A plate of one spacing d seems 0.15 d farther than
it is, and from 0.1 d below its face on the slopes of its two sides cancel: liquid under a head of some spacings sinks in. So each point b
of such a plate has a normal n_b, and a particle has a height h = n_b . (x_i - x_b) over the plate, whose sign tells its side. Wherever a
particle goes, by relaxation or in the coming advection, it may come as near to the plate's middle plane as the face, FACE. If it is nearer
already, it may come no nearer:

    (u_i - u_b) . n_b sign h >= -(|h| - FACE d)+,     u: displacements, u_b of the body at x_i,

where the way through that level passes the point within BESIDE d.

The contact is inelastic, and the body receives the impulse that the particle loses. The rule looks at each plate by itself: beside the line
where two plates meet, the plates act one after the other, and a particle that finds no way then moves with the plate.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.arrays import Array, Real
from oilsim.backend.jit import FAST, HALF, ONE, ZERO
from oilsim.backend.thread_team import Team
from oilsim.boundaries.contacts import BodyPairs
from oilsim.boundaries.walls import Walls
from oilsim.neighborhood.neighbor_search import nearest_images

Period = tuple[np.float32, np.float32, np.float32] | None

# [d] from the middle plane to the face of the thinnest plate that particles meet; theory; half a particle
FACE = np.float32(0.5)
# [d] across, within which a point of a plate stands for it; measured; gaps between the points of 12 plates leave places 0.80 d from all
# (beyond a rim, whose points are half a spacing inside, it reaches less far than a particle that touches the edge)
BESIDE = np.float32(0.85)
# [1] plates that may stop a particle one after the other in a step; numerical; three meet at a corner
PLATES = 4
# [m2] keeps a divisor from being 0; numerical; far below any square
TINY = np.float32(1e-30)


class Plates(NamedTuple):
    """Points of walls, and which of them stand for plates.

    points          (M, 4), places of all points of walls [m]
    normal (3, K)   unit normals [1] of the points of plates, 0 of others; of the points of moving bodies, which are the last
    spacing         d [m]
    period          lengths of periodic axes [m], None if there are none
    """

    points: Real
    normal: Real
    spacing: np.float32
    period: Period


@njit(**FAST)
def worst_meeting(pairs, plates, places, of, carried, moved):
    """Return the pair whose plate a particle goes into farthest, how far [m], and the plate's normal on the particle's side.

    places (N, 4), carried (3, P), moved (3, N) [m] as for `hold_back`; of: the particle, its first pair, and the one after its last. The
    way is 0 if it meets no plate.
    """
    i, first, last = of
    face, beside = FACE * plates.spacing, BESIDE * BESIDE * plates.spacing * plates.spacing
    resting = plates.points.shape[0] - plates.normal.shape[1]
    worst, found, wx, wy, wz = ZERO, first, ZERO, ZERO, ZERO
    for n in range(first, last):
        b = np.int64(pairs.point[n])
        nx, ny, nz = plates.normal[0, b - resting], plates.normal[1, b - resting], plates.normal[2, b - resting]
        if nx == ZERO and ny == ZERO and nz == ZERO:
            continue
        dx, dy, dz = nearest_images(
            places[i, 0] - plates.points[b, 0], places[i, 1] - plates.points[b, 1], places[i, 2] - plates.points[b, 2],
            plates.period,
        )  # fmt: skip
        height = nx * dx + ny * dy + nz * dz
        if height < ZERO:
            height, nx, ny, nz = -height, -nx, -ny, -nz
        ux, uy, uz = moved[0, i] - carried[0, n], moved[1, i] - carried[1, n], moved[2, i] - carried[2, n]
        approach = -(nx * ux + ny * uy + nz * uz)
        room = max(height - face, ZERO)
        if approach - room <= worst:
            continue
        share = min(room / (approach + TINY), ONE)
        ax, ay, az = dx + share * ux, dy + share * uy, dz + share * uz
        level = nx * ax + ny * ay + nz * az
        if ax * ax + ay * ay + az * az - level * level < beside:
            worst, found, wx, wy, wz = approach - room, n, nx, ny, nz
    return found, worst, wx, wy, wz


@njit(**FAST)
def hold_back(pairs, plates, places, carried, moved, push):
    """Shorten the ways `moved` (3, N) [m] of particles so that none leads into a plate; `push` (3, P) becomes the change by each pair [m].

    pairs           the step's `BodyPairs`
    plates          the `Plates`
    places          (N, 4), where the ways begin [m]
    carried (3, P)  way of the body of each pair at the particle's place [m], where a plate that turns moves otherwise than at its point
    """
    first, count = 0, pairs.particle.size
    while first < count:
        i, last = pairs.particle[first], first
        while last < count and pairs.particle[last] == i:
            last += 1
        for turn in range(PLATES + 1):
            found, worst, wx, wy, wz = worst_meeting(pairs, plates, places, (i, first, last), carried, moved)
            if worst <= ZERO:
                break
            if turn < PLATES:
                wx, wy, wz = worst * wx, worst * wy, worst * wz
            else:
                wx = carried[0, found] - moved[0, i]
                wy = carried[1, found] - moved[1, i]
                wz = carried[2, found] - moved[2, i]
            moved[0, i] += wx
            moved[1, i] += wy
            moved[2, i] += wz
            push[0, found] += wx
            push[1, found] += wy
            push[2, found] += wz
        first = last


@njit(**FAST)
def ways_of_bodies(begin, end, pairs, places, walls, moved, turning, carried):
    """Fill carried (3, P) with the ways [m] of bodies at the particles of the pairs begin to end.

    pairs           the step's `BodyPairs`
    places (N, 4), moved (3, N)   where the ways of particles begin, and these [m]
    walls           places (M, 4) of all points of walls [m], and lengths of periodic axes [m] or None
    turning         twists (bodies, 6) [m/s, rad/s], and dt [s]

    A body that turns by w dt turns its plates, too. A particle's way less this one is what the body sees of it, to second order in dt.
    To first order, liquid that turns with a vessel would come nearer to its walls by w^2 r dt^2 / 2 every step, and liquid that
    slides along them by w dt of its way.
    """
    (points, period), (twists, step) = walls, turning
    for n in range(begin, end):
        i, b, twist = pairs.particle[n], pairs.point[n], twists[pairs.body[n]]
        dx, dy, dz = nearest_images(
            places[i, 0] - points[b, 0], places[i, 1] - points[b, 1], places[i, 2] - points[b, 2], period
        )
        ux, uy, uz = step * twist[0], step * twist[1], step * twist[2]
        wx, wy, wz = step * twist[3], step * twist[4], step * twist[5]
        ax, ay, az = (
            pairs.arm[0, n] + dx + moved[0, i] - ux,
            pairs.arm[1, n] + dy + moved[1, i] - uy,
            pairs.arm[2, n] + dz + moved[2, i] - uz,
        )
        tx, ty, tz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
        carried[0, n] = ux + tx - HALF * (wy * tz - wz * ty)
        carried[1, n] = uy + ty - HALF * (wz * tx - wx * tz)
        carried[2, n] = uz + tz - HALF * (wx * ty - wy * tx)


class PlateGuard:
    """Keeps the particles of one step on their side of plates; `present` tells whether there are any."""

    def __init__(
        self, team: Team, walls: Walls, pairs: BodyPairs, period: Period, spacing: float, dimension: int
    ) -> None:
        """Begin with the step's `pairs`; period: lengths of periodic axes [m], None if there are none; spacing d [m]."""
        self._team, self._walls, self._pairs, self._period = team, walls, pairs, period
        self._spacing, self._dimension = np.float32(spacing), dimension
        self.present = walls.normal is not None and bool(pairs.particle.size)

    def keep_sides(self, before: Real, points: Real, position: Real) -> None:
        """Take back the part of a relaxation that led particles into plates.

        before (3, N) [m]: positions before it; points (N, 4): room for them; position (3, N) [m], which is changed.
        """
        points[: before.shape[1], :3] = before.T
        moved = position[:, : before.shape[1]] - before
        pushed = self._hold_back(points, np.zeros_like(self._pairs.arm), moved)
        held = self._pairs.particle[pushed.any(axis=0)]
        position[:, held] = before[:, held] + moved[:, held]

    def stop(self, points: Real, velocity: Real, density: Real, time_step: float) -> None:
        """Take from velocities (3, N) [m/s] what would lead into plates in the next `time_step` [s]; bodies receive the impulses.

        points (N, 4): present places [m]; density (N,) [kg/m3] of the particles.
        """
        pairs, step = self._pairs, np.float32(time_step)
        moved = step * velocity[:, : density.size]
        carried = np.empty((3, pairs.particle.size), np.float32)
        turning = self._walls.twists().astype(np.float32), step
        self._team.run(
            ways_of_bodies,
            pairs.particle.size,
            pairs,
            points,
            (self._walls.points, self._period),
            moved,
            turning,
            carried,
        )
        pushed = self._hold_back(points, carried, moved)
        hit = np.flatnonzero(pushed.any(axis=0))
        if hit.size:
            stopped = pairs.particle[hit]
            velocity[:, stopped] = moved[:, stopped] / step
            mass = float(self._spacing) ** self._dimension * density[stopped].astype(np.float64)
            self._walls.receive(self._impulses(points, hit, -mass / time_step * pushed[:, hit]))

    def _impulses(self, points: Real, hit: NDArray[np.integer], lost: Array) -> Array:
        """Return the impulses (bodies, 6) [N s, N m s] of the momenta `lost` (3, K) [kg m/s] to the pairs `hit` (K,)."""
        pairs, arm, impulses = self._pairs, self._arms(points, hit), self._walls.zero_forces()
        np.add.at(impulses, pairs.body[hit], np.hstack([lost.T, np.cross(arm, lost.T)]))
        return impulses

    def _arms(self, points: Real, chosen: NDArray[np.integer]) -> Array:
        """Return the places (K, 3) [m] of the particles of the `chosen` pairs (K,) from the centres of mass of their bodies."""
        pairs = self._pairs
        way = (points[pairs.particle[chosen], :3] - self._walls.points[pairs.point[chosen], :3]).astype(np.float64)
        for axis, length in enumerate(self._period or ()):
            if length > 0.0:
                way[:, axis] -= length * np.round(way[:, axis] / length)
        return pairs.arm[:, chosen].T + way

    def _hold_back(self, points: Real, carried: Real, moved: Real) -> Real:
        walls, push = self._walls, np.zeros_like(carried)
        assert walls.normal is not None  # `present` tells so
        plates = Plates(walls.points, walls.normal, self._spacing, self._period)
        hold_back(self._pairs, plates, points, carried, moved, push)
        return push

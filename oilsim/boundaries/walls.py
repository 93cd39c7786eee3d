"""All wall particles of a fluid: those at rest sorted once, those of moving bodies placed by their poses each step.

Sign of the impulse: fluid particle i that presses with kappa_i on wall particles b receives -V rho_ref kappa_i V_b grad W_ib and the body
the opposite, P = V rho_ref sum_i kappa_i J_i with J_i = sum_b V_b (grad W_ib, r_b x grad W_ib), r_b the arm from the centre of mass.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from oilsim.backend.jit import FAST, inlined
from oilsim.boundaries.boundary_particles import BoundaryParticles
from oilsim.neighborhood.neighbor_search import NeighborSearch, Pairs, indices

Real = NDArray[np.float32]
Double = NDArray[np.float64]
Index = NDArray[np.uint32]


class Contacts(NamedTuple):
    """Fluid particles that touch moving bodies: particle (K,), body (K,) slot, jacobian (K, 6) J of the module's docstring [1/m, 1].

    reach (K, 6, 3): the part of the wrench that comes by the pressure of the particle's neighbours (see `rigid_response`); or (0, 6, 3).
    """

    particle: NDArray[np.uint32]
    body: NDArray[np.uint16]
    jacobian: Real
    reach: Real


NO_CONTACTS = Contacts(
    np.empty(0, np.uint32), np.empty(0, np.uint16), np.empty((0, 6), np.float32), np.empty((0, 6, 3), np.float32)
)


@inlined
def add_wrench(wrench, owner, arm, b, fx, fy, fz):
    """Add a force at the arm of moving wall particle b to row `owner` of `wrench` (bodies, 6)."""
    wrench[owner, 0] += fx
    wrench[owner, 1] += fy
    wrench[owner, 2] += fz
    wrench[owner, 3] += arm[1, b] * fz - arm[2, b] * fy
    wrench[owner, 4] += arm[2, b] * fx - arm[0, b] * fz
    wrench[owner, 5] += arm[0, b] * fy - arm[1, b] * fx


@njit(**FAST)
def find_touching(walls, count, resting, touches):
    """Mark the particles that have a moving wall particle within reach; lists name those at rest first."""
    for i in range(count):
        last = walls.start[i] + np.int64(walls.number[i]) - 1
        touches[i] = walls.number[i] > 0 and walls.neighbor[last] >= resting


@njit(**FAST)
def find_contacts(touching, walls, wall_gradient, resting, owner, arm, particle, body, jacobian):
    """Gather J_i for each touching particle and moving body within its reach; returns the number of contacts."""
    found = 0
    for i in touching:
        first = found
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            if b < resting:
                continue
            c = first
            while c < found and body[c] != owner[b - resting]:
                c += 1
            if c == found:
                particle[c] = i
                body[c] = owner[b - resting]
                jacobian[c] = 0.0
                found += 1
            add_wrench(jacobian, c, arm, b - resting, wall_gradient[0, k], wall_gradient[1, k], wall_gradient[2, k])
    return found


def rotation_matrix(orientation: ArrayLike) -> Double:
    """Rotations (..., 3, 3) of quaternions (..., 4) x, y, z, w."""
    quaternion = np.asarray(orientation, np.float64)
    x, y, z, w = np.moveaxis(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rotated(orientation: Double, turn: Double) -> Double:
    """Quaternions (B, 4) after rotation vectors `turn` (B, 3) [rad] in the world frame."""
    half = 0.5 * np.linalg.norm(turn, axis=1)
    ax, ay, az = 0.5 * np.sinc(half / np.pi) * turn.T
    aw = np.cos(half)
    x, y, z, w = orientation.T
    result = np.stack(
        [
            aw * x + ax * w + ay * z - az * y,
            aw * y - ax * z + ay * w + az * x,
            aw * z + ax * y - ay * x + az * w,
            aw * w - ax * x - ay * y - az * z,
        ],
        axis=1,
    )
    return result / np.linalg.norm(result, axis=1, keepdims=True)


def chosen_blocks(matrix: Double, rows: list[int]) -> Double:
    """The blocks of 6 by 6 in these rows and columns of a matrix (6 n, 6 n); itself if they are all, in order."""
    if rows == list(range(len(matrix) // 6)):
        return matrix
    axes = [6 * row + axis for row in rows for axis in range(6)]
    return matrix[np.ix_(axes, axes)]


@dataclass
class MovingBody:
    """Motion of one moving boundary during an advance: pose, twist, how it answers, and what it has received."""

    position: Double
    orientation: Double
    twist: Double  # (6,) linear [m/s] and angular [rad/s] velocity
    inverse_mass: Double  # (6, 6) twist per impulse; zeros for prescribed motion
    free_acceleration: Double  # (6,) d(twist)/dt from everything but the fluid
    impulse: Double = field(default_factory=lambda: np.zeros(6))  # [N s, N m s] since the advance began


class Walls:
    """Storage of every wall particle: resting ones first, in cell order, then moving ones body by body."""

    def __init__(self, search: NeighborSearch, lower: ArrayLike, period: tuple[float, float, float] | None) -> None:
        self._search, self._lower, self._period = search, np.asarray(lower, np.float32), period
        self.boundaries: dict[int, BoundaryParticles] = {}
        self.moving: dict[int, MovingBody] = {}
        self._reach: dict[int, float] = {}  # [m] of a boundary's furthest point from its own origin
        self._next = 0
        self._tied: Double | None = None
        self._stale = True
        self._grid = search.grid  # in whose cells those at rest lie
        self.position: Real = np.empty((3, 0), np.float32)
        self.points: Real = np.empty(
            (0, 4), np.float32
        )  # place [m] and volume [m3], side by side for those who gather them
        self.volume: Real = np.empty(0, np.float32)
        self.area: Real = np.empty(0, np.float32)
        self.no_slip: Real | None = None
        self.bodies_hold = False  # whether liquid sticks to any body that moves
        self.resting = 0
        self.arm: Real = np.empty((3, 0), np.float32)
        self.owner: NDArray[np.uint16] = np.empty(0, np.uint16)

    def add(self, boundary: BoundaryParticles) -> int:
        """Add a boundary at rest; returns its handle."""
        handle = self._next
        self._next += 1
        self.boundaries[handle] = boundary
        self._reach[handle] = float(np.linalg.norm(boundary.position, axis=1).max(initial=0.0))
        self._stale = True
        return handle

    def remove(self, handle: int) -> None:
        """Remove a boundary; ValueError for a handle that does not exist."""
        self._require(handle)
        del self.boundaries[handle], self._reach[handle]
        self.moving.pop(handle, None)
        self._tied = None
        self._stale = True

    def set_motion(self, handle: int, body: MovingBody) -> None:
        """From now on the boundary moves as `body`."""
        self._stale |= handle not in self.moving
        self._tied = None
        self.moving[handle] = body

    def stop(self, handles: Iterable[int]) -> None:
        """Bring boundaries back to where they were added, at rest."""
        for handle in handles:
            del self.moving[handle]
            self._tied, self._stale = None, True

    def _require(self, handle: int) -> None:
        if handle not in self.boundaries:
            raise ValueError(f"boundary {handle} does not exist, allowed: {sorted(self.boundaries)}")

    @property
    def count(self) -> int:
        """Number of wall particles."""
        return sum(len(boundary.position) for boundary in self.boundaries.values())

    @property
    def layout(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Handles of the resting and of the moving boundaries, in the order of their particles."""
        return tuple(h for h in self.boundaries if h not in self.moving), tuple(self.moving)

    @property
    def moving_position(self) -> Real:
        """A copy of the positions (3, M) [m] of all moving wall particles."""
        return self.position[:, self.resting :].copy()

    def twists(self) -> Double:
        """Twists (bodies, 6) [m/s, rad/s] of the moving bodies."""
        return np.array([body.twist for body in self.moving.values()]).reshape(-1, 6)

    def largest_speed(self, lower: ArrayLike, upper: ArrayLike, time_step: float) -> float:
        """Of any point of the moving bodies [m/s] that may reach into the domain between two corners [m] within `time_step` [s]."""
        if not self.moving:
            return 0.0
        places = np.array([body.position for body in self.moving.values()])
        outside = places - np.clip(places, lower, upper)
        if self._period is not None:
            outside[:, np.array(self._period) > 0.0] = 0.0
        reach, twists = np.array([self._reach[handle] for handle in self.moving]), self.twists()
        linear = np.linalg.norm(twists[:, :3], axis=1)
        inside = np.linalg.norm(outside, axis=1) <= reach + time_step * linear
        return float((linear + reach * np.linalg.norm(twists[:, 3:], axis=1))[inside].max(initial=0.0))

    def drift(self, time_step: float) -> None:
        """Move the bodies' poses by their twists."""
        if not self.moving:
            return
        turns = time_step * self.twists()[:, 3:]
        orientations = rotated(np.array([body.orientation for body in self.moving.values()]), turns)
        for body, orientation in zip(self.moving.values(), orientations, strict=True):
            body.position = body.position + time_step * body.twist[:3]
            body.orientation = orientation

    def place(self) -> None:
        """Bring all positions up to date with the bodies' poses."""
        if self._stale or self._grid is not self._search.grid:
            self._arrange()
        if not self.moving:
            return
        bodies, owner = self.moving.values(), self.owner
        turn = rotation_matrix([body.orientation for body in bodies])
        arm = np.einsum("mij,jm->im", turn[owner], self._local)
        self.arm[:] = arm
        centre = np.array([body.position for body in bodies])[owner].T
        self.position[:, self.resting :] = self._wrapped(arm + centre)
        self.points[self.resting :, :3] = self.position[:, self.resting :].T

    def point_velocities(self, twists: Double) -> Real:
        """Velocities (3, M) [m/s] of all wall particles where the moving bodies have `twists` (bodies, 6)."""
        velocity = np.zeros_like(self.position)
        twist = twists[self.owner]
        velocity[:, self.resting :] = twist[:, :3].T + np.cross(twist[:, 3:], self.arm.T).T
        return velocity

    def order_moving(self, moving: Real) -> tuple[NDArray[np.uint8], Index | None, Index | None]:
        """Cells from which a wall can be reached with the moving ones at `moving` (3, M); their order and start by cell."""
        if not self.moving:
            return self._near_resting, None, None
        order, start = self._search.order_by_cell(moving)
        return self._search.surroundings(moving, self._near_resting), order + np.uint32(self.resting), start

    def near_moving(self, chosen: NDArray[np.integer], held: NDArray[np.bool_]) -> Pairs:
        """All wall particles within reach of the `chosen` (K,) of the moving ones, themselves too; of those far from what is held none."""
        moving = self.moving_position
        _, order, start = self.order_moving(moving)
        near = self._near_resting
        if held.any():
            near = self._search.surroundings(np.ascontiguousarray(moving[:, held[self.owner]]), near)
        points = np.ascontiguousarray(moving[:, chosen])
        return self._search.list_neighbors("films", points, self.position, self.cell_start, near, order, start)

    def held(self) -> NDArray[np.bool_]:
        """Which of the moving bodies (bodies,) answer no impulse: they are held, or led."""
        count = len(self.moving)
        return np.logical_not(self.inverse_mass().reshape(count, 6, -1).any(axis=(1, 2)))

    def positions(self, handle: int) -> Real:
        """World positions (M, 3) of one boundary; ValueError for a handle that does not exist."""
        self._require(handle)
        points = self.boundaries[handle].position
        body = self.moving.get(handle)
        if body is not None:
            points = points @ rotation_matrix(body.orientation).T + body.position
        return points.astype(np.float32)

    def touching(self, walls: Pairs, count: int) -> NDArray[np.uint32]:
        """Indices of the fluid particles, of `count`, that have a moving wall particle within reach."""
        touches = np.zeros(count, bool)
        if self.moving:
            find_touching(walls, count, self.resting, touches)
        return indices(touches)

    def rest_is_touched(self, walls: Pairs, by_body: NDArray[np.bool_], touching: NDArray[np.uint32]) -> bool:
        """Whether a fluid particle has a wall particle at rest within reach; `touching` a moving one, as `by_body` (N,) marks."""
        if not self.resting:
            return False
        alone = (walls.number[: by_body.size] > 0) & ~by_body
        # lists name those at rest first
        return bool(alone.any() or (walls.neighbor[walls.start[touching]] < self.resting).any())

    def contacts(self, touching: NDArray[np.uint32], walls: Pairs, wall_gradient: Real) -> Contacts:
        """Contacts of the touching particles with moving bodies, from cached wall gradients."""
        room = int(walls.number[touching].sum())
        particle, body = np.empty(room, np.uint32), np.empty(room, np.uint16)
        jacobian = np.empty((room, 6), np.float32)
        found = 0
        if room:
            found = find_contacts(
                touching, walls, wall_gradient, self.resting, self.owner, self.arm, particle, body, jacobian
            )
        return Contacts(particle[:found], body[:found], jacobian[:found], np.empty((0, 6, 3), np.float32))

    def zero_forces(self) -> Double:
        """An empty wrench (bodies, 6) in the order of the moving bodies."""
        return np.zeros((len(self.moving), 6))

    def receive(self, impulses: Double) -> None:
        """Hand impulses (bodies, 6) to the moving bodies, which answer them."""
        if not self.moving:
            return
        answers = (self.inverse_mass() @ impulses.ravel()).reshape(impulses.shape)
        for body, impulse, answer in zip(self.moving.values(), impulses, answers, strict=True):
            body.impulse = body.impulse + impulse
            body.twist = body.twist + answer

    def tie(self, handles: Sequence[int], inverse_mass: Double) -> None:
        """The moving bodies answer together, by `inverse_mass` (6 n, 6 n) in the order of `handles`."""
        place = {handle: n for n, handle in enumerate(handles)}
        self._tied = chosen_blocks(inverse_mass, [place[handle] for handle in self.moving])

    @property
    def tied(self) -> Double | None:
        """The inverse mass (6 n, 6 n) that `tie` gave the moving bodies, in their order; None without."""
        return None if self._tied is None else self._tied.copy()

    def inverse_mass(self) -> Double:
        """Twists by impulses of all moving bodies (6 n, 6 n)."""
        if self._tied is not None:
            return self._tied
        count = len(self.moving)
        matrix = np.zeros((count, 6, count, 6))
        for n, body in enumerate(self.moving.values()):
            matrix[n, :, n, :] = body.inverse_mass
        return matrix.reshape(6 * count, 6 * count)

    def _arrange(self) -> None:
        """Lay out storage after a boundary came, went or began to move."""
        resting = [h for h in self.boundaries if h not in self.moving]
        points = [self.boundaries[h].position.T.astype(np.float32) for h in (*resting, *self.moving)]
        self.position = np.concatenate([np.empty((3, 0), np.float32), *points], axis=1)
        volumes = [self.boundaries[h].volume.astype(np.float32) for h in (*resting, *self.moving)]
        self.volume = np.concatenate([np.empty(0, np.float32), *volumes])
        areas = [self.boundaries[h].area.astype(np.float32) for h in (*resting, *self.moving)]
        self.area = np.concatenate([np.empty(0, np.float32), *areas])
        stick = [
            np.full(len(self.boundaries[h].volume), self.boundaries[h].no_slip, np.float32)
            for h in (*resting, *self.moving)
        ]
        no_slip = np.concatenate([np.empty(0, np.float32), *stick])
        self.resting = sum(len(self.boundaries[h].volume) for h in resting)
        still = self._wrapped(self.position[:, : self.resting].astype(np.float64)).astype(np.float32)
        order, self.cell_start = self._search.order_by_cell(np.ascontiguousarray(still))
        self.position[:, : self.resting] = still[:, order]
        self.volume[: self.resting] = self.volume[order]
        self.area[: self.resting] = self.area[order]
        self.points = np.ascontiguousarray(np.vstack([self.position, self.volume]).T)
        no_slip[: self.resting] = no_slip[order]
        self.no_slip = no_slip if no_slip.any() else None
        self.bodies_hold = bool(no_slip[self.resting :].any())
        self._grid = self._search.grid
        self._near_resting = self._search.surroundings(np.ascontiguousarray(self.position[:, : self.resting]))
        self._local = np.concatenate([np.empty((3, 0)), *(self.boundaries[h].position.T for h in self.moving)], axis=1)
        sizes = [len(self.boundaries[h].volume) for h in self.moving]
        self.owner = np.repeat(np.arange(len(sizes), dtype=np.uint16), sizes)
        self.arm = np.zeros((3, sum(sizes)), np.float32)
        self._stale = False

    def _wrapped(self, points: NDArray[np.floating]) -> NDArray[np.floating]:
        """Points (3, M) brought back into a periodic domain."""
        if self._period is not None:
            for axis, length in enumerate(self._period):
                if length > 0.0:
                    points[axis] -= length * np.floor((points[axis] - self._lower[axis]) / length)
        return points

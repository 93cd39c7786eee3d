"""All wall particles of a fluid, and the moving bodies among their owners.

Particles at rest are sorted by cell once. Particles of moving bodies are placed by the bodies' poses in every step. Bodies receive
impulses and respond with their inverse mass, each by itself or tied together by joints (see `contacts` for the impulses' sign).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim.backend.arrays import Array, Flags, Index, Ints, Real
from oilsim.boundaries.boundary_particles import BoundaryParticles
from oilsim.boundaries.wall_curvature import WallCurvature
from oilsim.neighborhood.neighbor_search import CellOrder, NeighborSearch, Pairs, Sorted

Period = tuple[float, float, float] | None


class WallParticles(NamedTuple):
    """All M wall particles as kernels take them: R at rest in cell order first, then those of moving bodies, body by body.

    position  (3, M) in the world [m]
    points    (M, 4) position [m] and volume [m3; m2 in two dimensions] side by side, for kernels that gather them
    area      (M,) area of wall that a particle stands for [m2; m in two dimensions]
    resting   R, the number of particles at rest
    owner     (M - R,) uint16, slot of the moving body to which a particle belongs
    arm       (3, M - R) from the moving body's centre of mass to the particle [m]
    """

    position: Real
    points: Real
    area: Real
    resting: int
    owner: NDArray[np.uint16]
    arm: Real


def rotation_matrix(orientation: ArrayLike) -> Array:
    """Return the rotation matrices, (3, 3) or (n, 3, 3) [1], of quaternions x, y, z, w, (4,) or (n, 4), of any length but 0."""
    quaternion = np.asarray(orientation, np.float64)
    unit = quaternion / np.sqrt((quaternion * quaternion).sum(axis=-1, keepdims=True))
    x, y, z, w = (unit[..., n] for n in range(4))
    matrix = np.empty((*unit.shape[:-1], 3, 3))  # numpy stacks single numbers ten times as slowly as it sets them
    matrix[..., 0, 0], matrix[..., 0, 1], matrix[..., 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)  # fmt: skip
    matrix[..., 1, 0], matrix[..., 1, 1], matrix[..., 1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)  # fmt: skip
    matrix[..., 2, 0], matrix[..., 2, 1], matrix[..., 2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)  # fmt: skip
    return matrix


def rotated(orientation: Array, turn: Array) -> Array:
    """Return quaternions (B, 4) after rotation by the vectors `turn` (B, 3) [rad] in the world frame."""
    half = 0.5 * np.linalg.norm(turn, axis=1)
    ax, ay, az = 0.5 * np.sinc(half / np.pi) * turn.T
    aw = np.cos(half)
    x, y, z, w = orientation.T
    first, second = aw * x + ax * w + ay * z - az * y, aw * y - ax * z + ay * w + az * x
    third, last = aw * z + ax * y - ay * x + az * w, aw * w - ax * x - ay * y - az * z
    result = np.stack([first, second, third, last], axis=1)
    return result / np.linalg.norm(result, axis=1, keepdims=True)


def _of_particles(boundaries: Iterable[BoundaryParticles], value: Callable[[BoundaryParticles], ArrayLike]) -> Real:
    """Return the `value` of each particle, or of each boundary for all its particles, as (M,) in the order of `boundaries`."""
    values = [np.broadcast_to(value(each), each.volume.shape).astype(np.float32) for each in boundaries]
    return np.concatenate([np.empty(0, np.float32), *values])


@dataclass
class MovingBody:
    """Motion of one moving boundary during an advance: pose, twist, response to impulses, and the impulse received so far.

    position (3,)           centre of mass [m]
    orientation (4,)        quaternion x, y, z, w
    twist (6,)              linear [m/s] and angular [rad/s] velocity
    inverse_mass (6, 6)     twist per impulse [1/kg, 1/(kg m2)]; zeros for prescribed motion
    free_acceleration (6,)  d(twist)/dt from everything but the fluid [m/s2, rad/s2]
    impulse (6,)            impulse and its moment about the centre of mass since the advance began [N s, N m s]
    """

    position: Array
    orientation: Array
    twist: Array
    inverse_mass: Array
    free_acceleration: Array
    impulse: Array = field(default_factory=lambda: np.zeros(6))


class Walls:
    """Stores every wall particle: those at rest first, in cell order, then those of moving bodies, body by body."""

    def __init__(self, search: NeighborSearch, lower: ArrayLike, period: Period) -> None:
        self._search, self._lower, self._period = search, np.asarray(lower, np.float32), period
        self.curvature = WallCurvature()
        self.boundaries: dict[int, BoundaryParticles] = {}
        self.moving: dict[int, MovingBody] = {}
        self._reach: dict[int, float] = {}  # [m] of a boundary's furthest point from its own origin
        self._next = 0
        self._tied: Array | None = None
        self._stale = True
        self._grid = search.grid  # in whose cells those at rest lie
        self.position: Real = np.empty((3, 0), np.float32)
        self.points: Real = np.empty((0, 4), np.float32)
        self.volume: Real = np.empty(0, np.float32)
        self.area: Real = np.empty(0, np.float32)
        self.wetting: Real = np.empty(0, np.float32)  # (M,) cosine of the contact angle [1]
        self.no_slip: Real | None = None
        self.bodies_hold = False  # whether liquid sticks to any body that moves
        self.resting = 0
        self.arm: Real = np.empty((3, 0), np.float32)
        self.normal: Real | None = None  # (3, M - R) of moving bodies' plates [1], if there are any
        self.owner: NDArray[np.uint16] = np.empty(0, np.uint16)

    def add(self, boundary: BoundaryParticles, handle: int | None = None) -> int:
        """Add a boundary at rest and return its handle, a new one if none is given; ValueError for one that another boundary has."""
        handle = self._next if handle is None else handle
        if handle in self.boundaries:
            raise ValueError(f"boundary {handle} exists already, allowed: a handle that none has")
        self._next = max(self._next, handle + 1)
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

    def set_motion(self, handle: int, body: MovingBody) -> float:
        """Let the boundary move as `body` from now on; return the most [m/s] by which that changes the velocity of any of its points."""
        last, change = self.moving.get(handle), body.twist
        if last is None:
            self._stale = True
        else:
            change, body.impulse = body.twist - last.twist, last.impulse
        self._tied = None
        self.moving[handle] = body
        return float(np.linalg.norm(change[:3]) + self._reach[handle] * np.linalg.norm(change[3:]))

    def save_motions(self) -> dict[str, dict[str, Any]]:
        """Return a copy of the fields of each `MovingBody`, by handle as text."""
        return {
            str(handle): {name: np.copy(v) for name, v in vars(body).items()} for handle, body in self.moving.items()
        }

    def restore_motions(self, saved: Mapping[str, Mapping[str, Any]], tied: Array | None) -> None:
        """Let those bodies move that `save_motions` returned, in their order, and bring all others back to rest.

        tied (6 n, 6 n) [1/kg, 1/(kg m2)]: how they respond together; None where each responds by itself.
        """
        self.moving.clear()
        self._tied, self._stale = None, True
        for handle, values in saved.items():
            self.set_motion(int(handle), MovingBody(**{name: np.array(v) for name, v in values.items()}))
        if tied is not None:
            self.tie(list(self.moving), tied)

    def _require(self, handle: int) -> None:
        if handle not in self.boundaries:
            raise ValueError(f"boundary {handle} does not exist, allowed: {sorted(self.boundaries)}")

    @property
    def count(self) -> int:
        """Return the number of wall particles."""
        return sum(len(boundary.position) for boundary in self.boundaries.values())

    @property
    def layout(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Return the handles of the resting and of the moving boundaries, in the order of their particles."""
        return tuple(h for h in self.boundaries if h not in self.moving), tuple(self.moving)

    @property
    def particles(self) -> WallParticles:
        """Return all wall particles as kernels take them: views of the arrays, which `place` brings up to date."""
        return WallParticles(self.position, self.points, self.area, self.resting, self.owner, self.arm)

    @property
    def moving_position(self) -> Real:
        """Return a copy of the positions (3, M - R) [m] of all moving wall particles."""
        return self.position[:, self.resting :].copy()

    def twists(self) -> Array:
        """Return the twists (bodies, 6) [m/s, rad/s] of the moving bodies."""
        return np.array([body.twist for body in self.moving.values()]).reshape(-1, 6)

    def largest_speed(self, lower: ArrayLike, upper: ArrayLike, time_step: float) -> float:
        """Return the largest speed [m/s] of any point of those moving bodies that may reach the domain within `time_step` [s].

        The domain lies between the corners `lower` and `upper` (3,) [m].
        """
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

    def move_freely(self, time_step: float) -> None:
        """Add to the bodies' twists what everything but the fluid does to them in `time_step` [s]."""
        for body in self.moving.values():
            body.twist = body.twist + time_step * body.free_acceleration

    def drift(self, time_step: float) -> None:
        """Move the bodies' poses by their twists for `time_step` [s]."""
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
        self.curvature.turn(turn[owner])
        self.arm[:] = arm
        if self.normal is not None:
            self.normal[:] = np.einsum("mij,jm->im", turn[owner], self._local_normal)
        centre = np.array([body.position for body in bodies])[owner].T
        self.position[:, self.resting :] = self._wrapped(arm + centre)
        self.points[self.resting :, :3] = self.position[:, self.resting :].T

    def point_velocities(self, twists: Array) -> Real:
        """Return the velocities (3, M) [m/s] of all wall particles where the moving bodies have `twists` (bodies, 6) [m/s, rad/s]."""
        velocity = np.zeros_like(self.position)
        twist = twists[self.owner]
        velocity[:, self.resting :] = twist[:, :3].T + np.cross(twist[:, 3:], self.arm.T).T
        return velocity

    def order_moving(self, moving: Real) -> tuple[NDArray[np.uint8], CellOrder | None]:
        """Mark the cells (cells,) from which a wall can be reached with the moving particles at `moving` (3, M - R) [m].

        Also returns the moving particles by cell, counted from the first at rest; None if there are none.
        """
        if not self.moving:
            return self._near_resting, None
        order, start = self._search.order_by_cell(moving)
        return self._search.surroundings(moving, self._near_resting), CellOrder(order + np.uint32(self.resting), start)

    def near_moving(self, chosen: NDArray[np.integer], held: Flags) -> Pairs:
        """List all wall particles within reach of the `chosen` (K,) of the moving ones, themselves included.

        held (bodies,): bodies that no impulse moves; a particle far from them and from walls at rest gets an empty list.
        """
        moving = self.moving_position
        _, by_cell = self.order_moving(moving)
        near = self._near_resting
        if held.any():
            near = self._search.surroundings(np.ascontiguousarray(moving[:, held[self.owner]]), near)
        points = np.ascontiguousarray(moving[:, chosen])
        return self._search.list_neighbors("films", points, Sorted(self.position, self.cell_start), near, by_cell)

    def held(self) -> Flags:
        """Return which of the moving bodies (bodies,) no impulse moves, because they are fixed or their motion is prescribed."""
        count = len(self.moving)
        return np.logical_not(self.inverse_mass().reshape(count, 6, -1).any(axis=(1, 2)))

    def positions(self, handle: int) -> Real:
        """Return the world positions (M, 3) [m] of one boundary; ValueError for a handle that does not exist."""
        self._require(handle)
        points = self.boundaries[handle].position
        body = self.moving.get(handle)
        if body is not None:
            points = points @ rotation_matrix(body.orientation).T + body.position
        return points.astype(np.float32)

    def rest_is_touched(self, walls: Pairs, by_body: Flags, touching: Index) -> bool:
        """Return whether a fluid particle has a wall particle at rest within reach.

        walls: lists of wall neighbours; touching (T,): particles with a moving one within reach, which by_body (N,) marks.
        """
        if not self.resting:
            return False
        alone = (walls.number[: by_body.size] > 0) & ~by_body
        # lists name those at rest first
        return bool(alone.any() or (walls.neighbor[walls.start[touching]] < self.resting).any())

    def zero_forces(self) -> Array:
        """Return wrenches (bodies, 6) [N, N m] of 0 in the order of the moving bodies."""
        return np.zeros((len(self.moving), 6))

    def turns(self) -> tuple[Array, Ints]:
        """Return the twists (T, 6) [m, 1] that leave moving surfaces where they are, world frame, and the numbers (T,) of their bodies."""
        twists, owner = [np.empty((0, 6))], []
        for n, (handle, body) in enumerate(self.moving.items()):
            own = self.boundaries[handle].turns
            if own is not None and len(own):
                twists.append((own.reshape(-1, 3) @ rotation_matrix(body.orientation).T).reshape(-1, 6))
                owner += [n] * len(own)
        return np.concatenate(twists), np.array(owner, np.int64)

    def displaced(self) -> tuple[Array, Array, Ints]:
        """Return arms (K, 3) [m] and volumes (K,) [m3] that make up the moving bodies, and the number (K,) of each one's body."""
        turn = rotation_matrix(np.reshape([body.orientation for body in self.moving.values()], (-1, 4)))[
            self._whole_owner
        ]
        return np.einsum("kij,kj->ki", turn, self._whole[:, :3]), self._whole[:, 3], self._whole_owner

    def lie_within(self, lower: ArrayLike, upper: ArrayLike) -> bool:
        """Tell whether all that the moving bodies displace is known and lies between two corners (3,) [m]."""
        if any(self.boundaries[handle].displaced is None for handle in self.moving):
            return False
        arm, _, owner = self.displaced()
        place = arm + np.array([body.position for body in self.moving.values()]).reshape(-1, 3)[owner]
        return bool((place >= lower).all() and (place <= upper).all())

    def receive(self, impulses: Array) -> None:
        """Give impulses (bodies, 6) [N s, N m s] to the moving bodies, and change their twists by M^-1 P."""
        if not self.moving:
            return
        changes = (self.inverse_mass() @ impulses.ravel()).reshape(impulses.shape)
        for body, impulse, change in zip(self.moving.values(), impulses, changes, strict=True):
            body.impulse = body.impulse + impulse
            body.twist = body.twist + change

    def tie(self, handles: Sequence[int], inverse_mass: Array) -> None:
        """Let the moving bodies respond together, by `inverse_mass` (6 n, 6 n) [1/kg, 1/(kg m2)] in the order of `handles`."""
        place = {handle: n for n, handle in enumerate(handles)}
        rows = [place[handle] for handle in self.moving]
        axes = [6 * row + axis for row in rows for axis in range(6)]
        whole = rows == list(range(len(inverse_mass) // 6))
        self._tied = inverse_mass if whole else inverse_mass[np.ix_(axes, axes)]

    @property
    def tied(self) -> Array | None:
        """Return the inverse mass (6 n, 6 n) [1/kg, 1/(kg m2)] that `tie` gave the moving bodies, in their order; None without."""
        return None if self._tied is None else self._tied.copy()

    def inverse_mass(self) -> Array:
        """Return the inverse mass (6 n, 6 n) of all n moving bodies, twists by impulses [1/kg, 1/(kg m2)]."""
        if self._tied is not None:
            return self._tied
        count = len(self.moving)
        matrix = np.zeros((count, 6, count, 6))
        for n, body in enumerate(self.moving.values()):
            matrix[n, :, n, :] = body.inverse_mass
        return matrix.reshape(6 * count, 6 * count)

    def _arrange(self) -> None:
        """Lay out storage after a boundary was added, was removed or began to move."""
        resting = [h for h in self.boundaries if h not in self.moving]
        points = [self.boundaries[h].position.T.astype(np.float32) for h in (*resting, *self.moving)]
        self.position = np.concatenate([np.empty((3, 0), np.float32), *points], axis=1)
        laid_out = [self.boundaries[h] for h in (*resting, *self.moving)]
        self.volume = _of_particles(laid_out, lambda each: each.volume)
        self.area = _of_particles(laid_out, lambda each: each.area)
        self.wetting = _of_particles(laid_out, lambda each: math.cos(math.radians(each.contact_angle)))
        no_slip = _of_particles(laid_out, lambda each: each.no_slip)
        self.resting = sum(len(self.boundaries[h].volume) for h in resting)
        still = self._wrapped(self.position[:, : self.resting].astype(np.float64)).astype(np.float32)
        order, self.cell_start = self._search.order_by_cell(np.ascontiguousarray(still))
        self.position[:, : self.resting] = still[:, order]
        for values in (self.volume, self.area, self.wetting, no_slip):
            values[: self.resting] = values[order]
        self.points = np.ascontiguousarray(np.vstack([self.position, self.volume]).T)
        self.no_slip = no_slip if no_slip.any() else None
        self.bodies_hold = bool(no_slip[self.resting :].any())
        self._grid = self._search.grid
        self._near_resting = self._search.surroundings(np.ascontiguousarray(self.position[:, : self.resting]))
        wholes = [self.boundaries[h].whole for h in self.moving]
        self._whole = np.concatenate([np.empty((0, 4)), *wholes])
        self._whole_owner = np.repeat(np.arange(len(wholes)), [len(each) for each in wholes])
        self._local = np.concatenate([np.empty((3, 0)), *(self.boundaries[h].position.T for h in self.moving)], axis=1)
        sizes = [len(self.boundaries[h].volume) for h in self.moving]
        self.owner = np.repeat(np.arange(len(sizes), dtype=np.uint16), sizes)
        self.arm = np.zeros((3, sum(sizes)), np.float32)
        self._arrange_normals()
        at_rest, carried = ([self.boundaries[h] for h in group] for group in (resting, self.moving))
        self.curvature.arrange(at_rest, carried, order)
        self._stale = False

    def _arrange_normals(self) -> None:
        """Lay out the normals of moving bodies' plates."""
        bodies = [self.boundaries[h] for h in self.moving]
        own = [np.zeros_like(each.position) if each.normal is None else each.normal for each in bodies]
        self._local_normal = np.concatenate([np.empty((3, 0)), *(normal.T for normal in own)], axis=1)
        self.normal = np.zeros(self._local_normal.shape, np.float32) if self._local_normal.any() else None

    def _wrapped(self, points: NDArray[np.floating]) -> NDArray[np.floating]:
        """Return points (3, M) [m] brought back into a periodic domain, in place."""
        if self._period is not None:
            for axis, length in enumerate(self._period):
                if length > 0.0:
                    points[axis] -= length * np.floor((points[axis] - self._lower[axis]) / length)
        return points

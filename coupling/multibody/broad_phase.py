"""The length of a step of the rigid body engine at which no body moves deep into another one.

The engine detects contact when bodies overlap. A body is too fast for that if one of its points moves, as seen from another body, by more
than FURTHEST of half its thickness in a step; but this matters only near things that it can run into: boxes around the other bodies, and
half-spaces. Bodies that a joint connects do not touch.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.backend.jit import njit
from oilsim.loads.body_axes import rotation_matrices

FURTHEST = 0.0625  # of half its thickness, that a body may go in a step into another one
# [m] between bodies that touch nothing; numerical; the engine makes contacts from 0.02 m on
CLEAR = 0.1


class _Motion(NamedTuple):
    """Bodies now: position (B, 3) [m], rotation (B, 3, 3) from their axes to the world's, twist (B, 6) [m/s, rad/s]."""

    position: Array
    turn: Array
    twist: Array


class _Shapes(NamedTuple):
    """Bodies as `BroadPhase` knows them: bounds (B, 2, 3) [m], radius (B,) [m], half_thickness (B,) [m], touches (B,), apart (B, B)."""

    bounds: Array
    radius: Array
    half_thickness: Array
    touches: Flags
    apart: Flags


class BroadPhase:
    """The bodies of one world in the order of their rows, and the half-spaces."""

    def __init__(self) -> None:
        self._bounds = np.zeros((0, 2, 3))  # [m] along each body's axes, about its centre of mass
        self._radius = np.zeros(0)  # [m] of a sphere about that, which holds them
        self._half_thickness = np.zeros(0)  # [m] of bodies that may run into others, inf of others
        self._touches = np.zeros(0, dtype=bool)
        self._apart: Flags = np.zeros((0, 0), dtype=bool)  # pairs that do not touch
        self._planes = np.zeros((0, 2, 3))  # a point [m] and the normal

    def add_body(self, bounds: Array, *, is_free: bool, touches: bool) -> None:
        """Add the next row; `bounds` (2, 3) [m] about the centre of mass."""
        count = len(self._bounds) + 1
        self._bounds = np.concatenate([self._bounds, bounds[None]])
        self._radius = np.append(self._radius, np.linalg.norm(np.abs(bounds).max(axis=0)))
        half = 0.5 * float(np.ptp(bounds, axis=0).min()) if touches and is_free else math.inf
        self._half_thickness = np.append(self._half_thickness, half)
        self._touches = np.append(self._touches, touches)
        apart = np.eye(count, dtype=bool)
        apart[:-1, :-1] = self._apart
        self._apart = apart

    def add_half_space(self, point: Array, normal: Array) -> None:
        """Add the space behind a plane through `point` (3,) [m]; `normal` (3,) is a unit vector that points out of it."""
        self._planes = np.concatenate([self._planes, np.stack([point, normal])[None]])

    def keep_apart(self, first: int, second: int) -> None:
        """Note that a joint connects the bodies of these rows, which therefore do not touch."""
        self._apart[first, second] = self._apart[second, first] = True

    def rate(self, pose: Array, twist: Array, duration: float) -> float:
        """Return the least number of steps per second for poses (B, 7) [m, 1] and twists (B, 6) [m/s, rad/s]; 0 if one step suffices.

        It keeps bodies from moving deep into others within `duration` [s].
        """
        return float(_fastest_near(_motion(pose, twist), self._shapes, self._planes, duration))

    def any_near(self, pose: Array, twist: Array, duration: float) -> bool:
        """Tell whether a free body could touch anything within `duration` [s]; poses (B, 7) [m, 1], twists (B, 6) [m/s, rad/s].

        False is certain: boxes around the bodies stay CLEAR of each other and of the half-spaces.
        """
        return bool(_any_near(_motion(pose, twist), self._shapes, self._planes, duration))

    @property
    def _shapes(self) -> _Shapes:
        return _Shapes(self._bounds, self._radius, self._half_thickness, self._touches, self._apart)


def _motion(pose: Array, twist: Array) -> _Motion:
    return _Motion(pose[:, :3], rotation_matrices(pose[:, 3:]), twist)


@njit(nogil=True, cache=True, error_model="numpy")
def _in_a_row(position: Array) -> tuple[Array, Ints, Ints]:
    """Return the places (B,) [m] of bodies along the axis on which they lie farthest apart, their order on it, and each one's rank.

    Bodies far from each other on this axis need not be compared: along a boom a body has a few neighbours instead of all others.
    """
    count, widest, axis = len(position), -1.0, 0
    for candidate in range(3 if count else 0):
        width = position[:, candidate].max() - position[:, candidate].min()
        if width > widest:
            widest, axis = width, candidate
    along = position[:, axis].copy()
    order = np.argsort(along)
    rank = np.empty(count, np.int64)
    for place in range(count):
        rank[order[place]] = place
    return along, order, rank


@njit(nogil=True, cache=True, error_model="numpy")
def _any_near(motion: _Motion, shapes: _Shapes, planes: Array, duration: float) -> bool:
    """Tell whether boxes around two bodies, one of them free, or a box and a half-space come nearer than CLEAR within `duration` [s]."""
    position, turn, twist = motion
    bounds, radius, half_thickness, touches, apart = shapes
    count = len(position)
    way, farthest = np.empty(count), 0.0  # [m] of any of a body's points, and with its radius
    for i in range(count):
        way[i] = duration * (_length(twist[i, :3]) + radius[i] * _length(twist[i, 3:]))
        farthest = max(farthest, way[i] + radius[i])
    key, order, rank = _in_a_row(position)
    for i in range(count):
        if half_thickness[i] == math.inf:  # it is not free, or touches nothing
            continue
        for plane in planes:
            height = -CLEAR - way[i]
            for axis in range(3):
                height += plane[1, axis] * (position[i, axis] - plane[0, axis])
            for own in range(3):
                along = 0.0
                for axis in range(3):
                    along += plane[1, axis] * turn[i, axis, own]
                height += min(along * bounds[i, 0, own], along * bounds[i, 1, own])
            if height < 0.0:
                return True
        limit = CLEAR + way[i] + radius[i] + farthest
        for side in (-1, 1):
            place = rank[i] + side
            while 0 <= place < count and abs(key[order[place]] - key[i]) < limit:
                j = order[place]
                place += side
                if apart[i, j] or not touches[j] or (j < i and half_thickness[j] != math.inf):
                    continue
                reach = CLEAR + way[i] + way[j]
                square = 0.0
                for axis in range(3):
                    square += (position[i, axis] - position[j, axis]) ** 2
                if square < (reach + radius[i] + radius[j]) ** 2 and not (
                    _are_parted(position, turn, bounds, i, j, reach) or _are_parted(position, turn, bounds, j, i, reach)
                ):
                    return True
    return False


@njit(nogil=True, cache=True, error_model="numpy")
def _are_parted(position: Array, turn: Array, bounds: Array, i: int, j: int, reach: float) -> bool:
    """Tell whether a face of the box of body i parts it from that of body j by more than `reach` [m] (separating axes)."""
    for face in range(3):
        low, high = 0.0, 0.0  # of box j along the normal of the face, from the centre of body i
        for axis in range(3):
            low += turn[i, axis, face] * (position[j, axis] - position[i, axis])
        high = low
        for own in range(3):
            along = 0.0
            for axis in range(3):
                along += turn[i, axis, face] * turn[j, axis, own]
            one, other = along * bounds[j, 0, own], along * bounds[j, 1, own]
            low, high = low + min(one, other), high + max(one, other)
        if low > bounds[i, 1, face] + reach or high < bounds[i, 0, face] - reach:
            return True
    return False


@njit(nogil=True, cache=True, error_model="numpy")
def _fastest_near(motion: _Motion, shapes: _Shapes, planes: Array, duration: float) -> float:
    """Compute the largest pace [1/s] of a body towards another one or a half-space in reach within `duration` [s], 0 if below 1 / duration.

    The pace is that of its fastest point, as seen from the other body, in the lengths that it may move in a step.
    """
    position, turn, twist = motion
    bounds, radius, half_thickness, touches, apart = shapes
    count = len(position)
    furthest = FURTHEST * half_thickness
    way, way_of_corners = np.empty(count), np.empty(count)  # [m] of its centre, of any of its points
    farthest = 0.0
    for i in range(count):
        way[i] = duration * _length(twist[i, :3])
        way_of_corners[i] = way[i] + duration * _corner_speed(twist[i, 3:], turn[i], bounds[i])
        farthest = max(farthest, way_of_corners[i] + radius[i])
    key, order, rank = _in_a_row(position)
    fastest = 1.0 / duration
    for i in range(count):
        if furthest[i] == math.inf:
            continue
        pace = way_of_corners[i] / duration / furthest[i]
        for plane in planes:
            if pace > fastest and ((position[i] - plane[0]) * plane[1]).sum() < radius[i] + way[i]:
                fastest = pace
        limit = radius[i] + way[i] + farthest
        for side in (-1, 1):
            place = rank[i] + side
            while 0 <= place < count and abs(key[order[place]] - key[i]) < limit:
                j = order[place]
                place += side
                if apart[i, j] or not touches[j]:
                    continue
                reach = radius[i] + way[i] + way_of_corners[j]
                if not _lies_within(position[i], reach, position[j], turn[j], bounds[j], radius[j]):
                    continue
                seen = _length(_velocity_from(twist[j], position[i] - position[j], twist[i]))
                seen += _corner_speed(twist[i, 3:] - twist[j, 3:], turn[i], bounds[i])
                fastest = max(fastest, seen / furthest[i])
    return fastest if fastest * duration > 1.0 else 0.0


@njit(nogil=True, cache=True, error_model="numpy")
def _velocity_from(viewer: Array, place: Array, twist: Array) -> Array:
    """Compute the velocity (3,) [m/s] of a body's centre at `place` [m] as seen from another, turning body `viewer`; twists (6,)."""
    return twist[:3] - viewer[:3] - np.cross(viewer[3:], place)


@njit(nogil=True, cache=True, error_model="numpy")
def _corner_speed(rate: Array, turn: Array, bounds: Array) -> float:
    """Compute a bound [m/s] of |omega x r| in a box of `bounds` (2, 3) about its centre of rotation, at `rate` (3,), world frame."""
    own = np.abs(rate @ turn)
    furthest = np.maximum(np.abs(bounds[0]), np.abs(bounds[1]))
    square = 0.0
    for axis in range(3):
        after, before = (axis + 1) % 3, (axis + 2) % 3
        square += (own[after] * furthest[before] + own[before] * furthest[after]) ** 2
    return math.sqrt(square)


@njit(nogil=True, cache=True, error_model="numpy")
def _length(vector: Array) -> float:
    """Length of a vector (3,)."""
    return math.sqrt((vector**2).sum())


@njit(nogil=True, cache=True, error_model="numpy")
def _lies_within(point: Array, reach: float, position: Array, turn: Array, bounds: Array, radius: float) -> bool:
    """Tell whether a point (3,) is nearer than `reach` [m] to a box of `bounds` (2, 3) about a body, within a sphere of `radius`."""
    square = 0.0
    for axis in range(3):
        square += (point[axis] - position[axis]) ** 2
    if square >= (reach + radius) ** 2:
        return False
    square = 0.0
    for own in range(3):
        along = 0.0
        for axis in range(3):
            along += turn[axis, own] * (point[axis] - position[axis])
        square += (along - min(max(along, bounds[0, own]), bounds[1, own])) ** 2
    return bool(square < reach**2)

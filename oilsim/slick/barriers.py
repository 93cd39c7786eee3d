"""Barriers in plan view: booms, which hold oil, and outlines of land and hulls, to which it sticks.

All barriers are chains of straight segments with common nodes, so that a chain has no gaps. During a step every node moves on a straight
line from its old to its new place. Where a joint of a boom has parted, each of its two segments has a node of its own, and oil passes
between these. A segment of no length is not in the water, as where a boom is wound on a reel: nothing meets it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim.backend.arrays import Array, Flags, Ints

Rows = Ints

# [m] distance from a barrier at which parcels lie that it stops; numerical; far above rounding, far below a boom's thickness
STANDOFF = 1e-3
# [standoffs] kept from the ends of a segment; numerical; corners down to 3 degrees are wider there than a standoff
MARGIN = 20.0
# [margins] from an end within which parcels are looked after in sharper corners; numerical; down to 0.6 degrees
NEAR = 5.0
# [m] least length of a segment at the start, as which shorter ones count later; numerical; its margins fill half of it
SHORTEST = 4.0 * MARGIN * STANDOFF


class Immersion(NamedTuple):
    """Position of the S segments of a boom in the water; a scalar holds for all of them.

    draft         (S,) [m] from the surface down to the skirt's foot, 0 or more
    lean          (S,) [rad] of the skirt from the vertical
    freeboard     (S,) [m] of the top above the local surface, negative under it; infinite for a top that no sea reaches
    is_submerged  (S,) whether the top lies below the still water
    is_sealed     (S,) whether the foot lies tight on the ground, so that nothing passes under it
    """

    draft: ArrayLike
    lean: ArrayLike = 0.0
    freeboard: ArrayLike = math.inf
    is_submerged: ArrayLike = False
    is_sealed: ArrayLike = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Boom:
    """A boom in plan: a polyline of nodes (S + 1, 2) [m] with draft (S,) or scalar [m], from the surface down to the skirt's foot.

    is_closed: the last node is tied to the first one by one more segment, as of a ring; flow_share (S,) or scalar [-]: share of the
    water's speed relative to the boom that meets its oil, below 1 in a pocket. ValueError for a line or a share that cannot be.
    """

    name: str
    nodes: ArrayLike
    draft: ArrayLike
    is_closed: bool = False
    flow_share: ArrayLike = 1.0

    def __post_init__(self) -> None:
        _require_line(f"boom {self.name!r}", self.nodes, 3 if self.is_closed else 2)
        checked_immersion(self, Immersion(self.draft))
        share = np.asarray(self.flow_share, np.float64)
        if share.shape not in ((), (self.segments,)) or not ((share > 0.0) & (share <= 1.0)).all():
            text = f"flow_share is {np.array2string(share, threshold=6)}, allowed: one or {self.segments} numbers above 0 and at most 1"
            raise ValueError(f"boom {self.name!r}: {text}")

    @property
    def segments(self) -> int:
        """Number of its segments S."""
        return len(np.asarray(self.nodes)) - (0 if self.is_closed else 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Outline:
    """The outline of land or of a hull: a polygon of nodes (S, 2) [m]; oil sticks to it up to `capacity` [m3/m].

    carries: whether oil that sticks moves along with it, as with a hull; behind a waterline that falls it stays where it is.

    ValueError for an outline that cannot be.
    """

    name: str
    nodes: ArrayLike
    capacity: float
    carries: bool = True
    is_closed = True

    def __post_init__(self) -> None:
        _require_line(f"outline {self.name!r}", self.nodes, 3)
        if not (np.isfinite(self.capacity) and self.capacity >= 0.0):
            raise ValueError(f"outline {self.name!r}: capacity is {self.capacity} m3/m, allowed: 0 or more")

    @property
    def segments(self) -> int:
        """Number of its sides S."""
        return len(np.asarray(self.nodes))


Barrier = Boom | Outline


def checked_immersion(boom: Boom, immersion: Immersion) -> dict[str, NDArray[Any]]:
    """Return a boom's immersion as arrays (S,) [m, rad] by name; ValueError for another shape, a draft below 0, or no numbers."""
    arrays = {}
    for name, value in immersion._asdict().items():
        given = np.asarray(value, np.bool_ if name.startswith("is_") else np.float64)
        if given.shape not in ((), (boom.segments,)):
            raise ValueError(f"boom {boom.name!r}: {name} has shape {given.shape}, allowed: () or ({boom.segments},)")
        if np.isnan(given).any():
            raise ValueError(f"boom {boom.name!r}: {name} is nan somewhere, allowed: a number")
        arrays[name] = np.broadcast_to(given, (boom.segments,)).copy()
    draft = arrays["draft"]
    if not (np.isfinite(draft).all() and (draft >= 0.0).all()):
        raise ValueError(f"boom {boom.name!r}: draft is {draft.min():g} m somewhere, allowed: 0 or more, finite")
    return arrays


def _require_line(what: str, nodes: ArrayLike, least: int) -> None:
    given = np.asarray(nodes, np.float64)
    if given.ndim != 2 or given.shape[1] != 2 or len(given) < least:
        raise ValueError(f"{what}: nodes have shape {given.shape}, allowed: (N, 2) with N of {least} or more")
    _require_finite(what, given)
    closed = np.vstack([given, given[:1]]) if least == 3 else given
    shortest = float(np.hypot(*np.diff(closed, axis=0).T).min())
    if shortest < SHORTEST:
        raise ValueError(f"{what}: a segment is {shortest:g} m long, allowed: {SHORTEST:g} m or more")


def _require_finite(what: str, nodes: Array) -> None:
    if not np.isfinite(nodes).all():
        raise ValueError(f"{what}: nodes are not finite, allowed: finite, in m")


class Barriers:
    """All barriers of a slick as S segments in one list.

    start, end            (S, 2) [m] now; old_start, old_end (S, 2) [m] when the last step began
    draft, lean, freeboard, is_submerged, is_sealed  (S,) of booms, see `Immersion`
    owner                 (S,) number of its barrier
    capacity              (S,) [m3/m] of outlines, -1 of booms; carries (S,) whether what sticks moves along
    flow_share            (S,) [-] of booms, see `Boom`; 1 of outlines
    parted                (S,) whether the joint at its end has parted
    following, preceding  (S,) the segments tied to its end and its start, -1 at a free end, and where the next one is not in the water
    """

    def __init__(self, barriers: Sequence[Barrier] = ()) -> None:
        """Lay out the barriers; ValueError if two have one name."""
        names = [one.name for one in barriers]
        if len(set(names)) < len(names):
            raise ValueError(f"slick: barriers are named {', '.join(names)}, allowed: each name once")
        self._members = {one.name: one for one in barriers}
        self._rows: dict[str, slice] = {}
        count = sum(one.segments for one in barriers)
        self.start, self.end = np.zeros((count, 2)), np.zeros((count, 2))
        self.owner = np.repeat(np.arange(len(barriers)), np.array([one.segments for one in barriers], np.int64))
        self.capacity = np.full(count, -1.0)
        self.draft, self.lean, self.freeboard = np.zeros(count), np.zeros(count), np.full(count, math.inf)
        self.is_submerged, self.is_sealed = np.zeros((2, count), np.bool_)
        self.carries, self.flow_share = np.ones(count, np.bool_), np.ones(count)
        self.parted = np.zeros(count, np.bool_)
        self._next, self._previous = np.arange(1, count + 1), np.arange(-1, count - 1)  # as built
        first = 0
        for one in barriers:
            rows = self._rows[one.name] = slice(first, first + one.segments)
            last = rows.stop - 1
            self._next[last], self._previous[first] = (first, last) if one.is_closed else (-1, -1)
            if isinstance(one, Outline):
                self.capacity[rows], self.carries[rows] = one.capacity, one.carries
            else:
                self.flow_share[rows] = one.flow_share
                self._immerse(one, Immersion(one.draft))
            self._place(one, one.nodes)
            first = rows.stop
        self._tie()
        self.settle()

    def __len__(self) -> int:
        return len(self.start)

    @property
    def is_boom(self) -> Flags:
        """Flags (S,) of the segments that belong to booms."""
        return self.capacity < 0.0

    def rows(self, name: str) -> slice:
        """Return the segments of a barrier; ValueError for an unknown name."""
        if name not in self._rows:
            raise ValueError(f"slick: there is no barrier {name!r}, allowed: {', '.join(self._rows) or 'none'}")
        return self._rows[name]

    @property
    def is_there(self) -> Flags:
        """Flags (S,) of the segments that are in the water."""
        return np.asarray((self.start != self.end).any(axis=1))

    @property
    def parted_ends(self) -> Flags:
        """Flags (S, 2): whether the joints at the start and the end of each segment have parted."""
        return np.stack([(self._previous >= 0) & self.parted[self._previous], self.parted], axis=1)

    def part(self, name: str, joint: int) -> None:
        """Let a joint of a boom part, counted from 1 at its first node; from now on `move` takes two nodes there.

        Raises ValueError for an unknown name, for a ring, and for a joint that the boom does not have.
        """
        rows = self.rows(name)
        one = self._members[name]
        if one.is_closed or not 0 < joint < one.segments:
            raise ValueError(
                f"barrier {name!r}: joint {joint} is to part, allowed: of a boom with ends, 1 to {one.segments - 1}"
            )
        self.parted[rows.start + joint - 1] = True
        self._tie()

    def move(self, name: str, nodes: ArrayLike, immersion: Immersion | None = None) -> None:
        """Say where a barrier's nodes (N, 2) [m] are at the end of the next step, and how a boom sits in the water.

        A boom has one node more for each joint that has parted.
        Raises ValueError for an unknown name, another number of nodes, an immersion of an outline, and values that cannot be.
        """
        rows = self.rows(name)
        one = self._members[name]
        given = np.asarray(nodes, np.float64)
        expected = (len(np.asarray(one.nodes)) + int(self.parted[rows].sum()), 2)
        if given.shape != expected:
            raise ValueError(f"barrier {name!r}: nodes have shape {given.shape}, allowed: {expected}")
        _require_finite(f"barrier {name!r}", given)
        if immersion is not None:
            if not isinstance(one, Boom):
                raise ValueError(
                    f"outline {name!r}: an immersion was given, allowed: none, since oil does not pass under it"
                )
            self._immerse(one, immersion)
        self._place(one, given)
        self._tie()

    def settle(self) -> None:
        """Make the present places the old ones, as a step ends."""
        self.old_start, self.old_end = self.start.copy(), self.end.copy()

    def _place(self, one: Barrier, nodes: ArrayLike) -> None:
        rows, given = self._rows[one.name], np.asarray(nodes, np.float64)
        parted = self.parted[rows]
        first = np.arange(one.segments) + np.cumsum(parted) - parted
        self.start[rows] = given[first]
        self.end[rows] = np.roll(given, -1, axis=0) if one.is_closed else given[first + 1]

    def _tie(self) -> None:
        there, parted = self.is_there, self.parted_ends
        self.preceding = np.where((self._previous >= 0) & ~parted[:, 0] & there[self._previous], self._previous, -1)
        self.following = np.where((self._next >= 0) & ~parted[:, 1] & there[self._next], self._next, -1)

    def _immerse(self, one: Boom, immersion: Immersion) -> None:
        for name, values in checked_immersion(one, immersion).items():
            getattr(self, name)[self._rows[one.name]] = values

    def points(self, segment: Rows, along: Array) -> Array:
        """Return the points (N, 2) [m] at the shares `along` (N,) [-] of segments (N,)."""
        share = along[:, None]
        return np.asarray((1.0 - share) * self.start[segment] + share * self.end[segment])

    def lengths(self) -> Array:
        """Return the lengths (S,) [m] of all segments, at least `SHORTEST`."""
        return np.asarray(np.maximum(np.hypot(*(self.end - self.start).T), SHORTEST))

    def normals(self) -> Array:
        """Return the unit normals (S, 2) [-] of all segments, to the left of the way from start to end; shorter ones below `SHORTEST`."""
        along = (self.end - self.start) / self.lengths()[:, None]
        return np.stack([-along[:, 1], along[:, 0]], axis=1)

    def encloses(self, points: Array) -> Flags:
        """Tell which points (N, 2) [m] lie inside an outline or more, by the number of sides of each that a ray crosses."""
        inside = np.zeros((self.owner.max(initial=-1) + 1, len(points)), np.bool_)
        for segment in np.flatnonzero(~self.is_boom):
            (x0, y0), (x1, y1) = self.start[segment], self.end[segment]
            spans = (y0 > points[:, 1]) != (y1 > points[:, 1])
            with np.errstate(divide="ignore", invalid="ignore"):
                left = points[:, 0] < x0 + (points[:, 1] - y0) * (x1 - x0) / (y1 - y0)
            inside[self.owner[segment]] ^= spans & left
        return np.asarray(inside.any(axis=0))

    def save_state(self) -> dict[str, Any]:
        """Return where the barriers are, which joints have parted, and how booms sit in the water."""
        names = ("start", "end", "old_start", "old_end", "parted", *Immersion._fields)
        return {name: getattr(self, name).copy() for name in names}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        for name, value in saved.items():
            setattr(self, name, value.copy())
        self._tie()

"""Stranding: oil that meets the outline of land or of a hull sticks to it until the outline is full; the rest floats on.

Each side of an outline takes its capacity [m3/m] times its length. A parcel for which there is room sticks as a whole, one for which there
is some room is split, and where there is none it stays afloat beside the outline. Stranded oil moves with the outline.

Oil that a boom holds and that slides along it to a waterline sticks there, too, and what there is no room for stays held there: a boom that
reaches on to dry land loses no oil around its end.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from oilsim.backend.arrays import Array, Flags
from oilsim.slick.barriers import MARGIN, STANDOFF, Barriers
from oilsim.slick.crossing import beside, first_crossings, resting_sweep
from oilsim.slick.parcels import Parcels, ParcelState, Rows, sums


def room_left(parcels: Parcels, barriers: Barriers) -> Array:
    """Compute the volume (S,) [m3] that each side of an outline can still take; 0 for booms."""
    stuck = np.flatnonzero(parcels.state == ParcelState.STRANDED)
    taken = sums(parcels.place[stuck], parcels.volume[stuck], len(barriers))
    return np.asarray(np.maximum(barriers.capacity * barriers.lengths() - taken, 0.0))


def strand(parcels: Parcels, barriers: Barriers, rows: Rows, segment: Rows, along: Array, side: Rows) -> None:
    """Let the parcels of rows (M,) that met segments (M,) of outlines stick as far as there is room.

    along (M,) [-] shares of the segments; side (M,) from which they came. The rest of a parcel that is split keeps its row.
    """
    room = room_left(parcels, barriers)
    for k, row in enumerate(rows):
        where = segment[k]
        volume = float(parcels.volume[row])
        if room[where] <= 0.0:
            continue
        sticking = int(row) if volume <= room[where] else parcels.split(int(row), float(room[where]))
        room[where] = max(room[where] - volume, 0.0)
        parcels.state[sticking], parcels.place[sticking] = ParcelState.STRANDED, where
        parcels.along[sticking], parcels.side[sticking] = along[k], side[k]


def nearest_water(points: Array, barriers: Barriers) -> Array:
    """Return the places (N, 2) [m] beside an outline and inside of none that are nearest to points (N, 2) [m]."""
    outlines = np.flatnonzero(~barriers.is_boom)
    start, way = barriers.start[outlines], (barriers.end - barriers.start)[outlines]
    segment, side, resting = np.tile(outlines, 2), np.repeat([1, -1], len(outlines)), resting_sweep(barriers)
    found = np.empty_like(points)
    for n, point in enumerate(points):
        along = np.clip(((point - start) * way).sum(axis=1) / (way**2).sum(axis=1), 0.0, 1.0)
        places = beside(barriers, segment, np.tile(along, 2), side, resting)
        distance = np.where(barriers.encloses(places), np.inf, np.hypot(*(places - point).T))
        found[n] = places[np.argmin(distance)]
    return found


class Landings(NamedTuple):
    """The K places at which booms cross outlines, seen from the water.

    segment, along  (K,), [-] of the boom, a margin from the outline; point (K, 2) [m] there
    side_of_land, where, facing  (K,) the outline's segment, the share [-] of it, and the side from which the boom comes
    """

    segment: Rows
    along: Array
    point: Array
    side_of_land: Rows
    where: Array
    facing: Rows


def strand_held(parcels: Parcels, barriers: Barriers) -> Rows:
    """Take held parcels that are on dry land back to where their boom crosses the waterline; they stick there as far as there is room.

    The rest stays held. Return the rows (M,) of all parcels that were taken back.
    """
    dry = barriers.encloses(np.concatenate([barriers.start, barriers.end])).reshape(2, -1)
    held = np.flatnonzero(parcels.state == ParcelState.HELD)
    held = held[(dry[0] | dry[1])[parcels.place[held]]]
    place, margin = parcels.place[held], MARGIN * STANDOFF / barriers.lengths()
    landward = margin * dry[1] - margin * dry[0]  # what lies nearer to a waterline would be put beside the boom on land
    at = barriers.points(place, np.clip(parcels.along[held] + landward[place], 0.0, 1.0))
    ashore = barriers.encloses(at)
    rows, at = held[ashore], at[ashore]
    landings = _landings(barriers, dry) if len(rows) else None
    if landings is None or not len(landings.segment):
        return rows[:0]
    apart = np.hypot(*np.moveaxis(at[:, None] - landings.point, 2, 0))
    apart[barriers.owner[parcels.place[rows]][:, None] != barriers.owner[landings.segment]] = np.inf
    found = np.isfinite(apart).any(axis=1)
    rows, nearest = rows[found], apart[found].argmin(axis=1)
    parcels.place[rows], parcels.along[rows] = landings.segment[nearest], landings.along[nearest]
    land = (landings.side_of_land[nearest], landings.where[nearest], landings.facing[nearest])
    parcels.position[rows] = beside(barriers, *land, resting_sweep(barriers))
    strand(parcels, barriers, rows, *land)
    return rows


def _landings(barriers: Barriers, dry: Flags) -> Landings:
    """Find where booms cross outlines; dry (2, S): whether the start and the end of a segment are on land."""
    outlines, found = np.flatnonzero(~barriers.is_boom), []
    sweep = resting_sweep(barriers, outlines)
    for wet, sign in ((0, 1.0), (1, -1.0)):
        segment = np.flatnonzero(barriers.is_boom & ~dry[wet] & dry[1 - wet])
        ends = (barriers.start[segment], barriers.end[segment])
        met = first_crossings(ends[wet], ends[1 - wet], sweep)
        hit = np.flatnonzero(met.segment >= 0)
        segment, side_of_land = segment[hit], outlines[met.segment[hit]]
        along = wet + sign * np.maximum(met.time[hit] - MARGIN * STANDOFF / barriers.lengths()[segment], 0.0)
        point = barriers.points(segment, along)
        found.append(Landings(segment, along, point, side_of_land, met.along[hit], met.side[hit]))
    return Landings(*(np.concatenate(columns) for columns in zip(*found, strict=True)))


def carry_stranded(parcels: Parcels, barriers: Barriers) -> None:
    """Move stranded parcels with the outlines that carry them."""
    stuck = np.flatnonzero(parcels.state == ParcelState.STRANDED)
    stuck = stuck[barriers.carries[parcels.place[stuck]]]
    parcels.position[stuck] = barriers.points(parcels.place[stuck], parcels.along[stuck])

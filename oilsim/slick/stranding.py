"""Stranding: oil that meets the outline of land or of a hull sticks to it until the outline is full; the rest floats on.

Each side of an outline takes its capacity [m3/m] times its length. A parcel for which there is room sticks as a whole, one for which there
is some room is split, and where there is none it stays afloat beside the outline. Stranded oil moves with the outline.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.slick.barriers import Barriers
from oilsim.slick.crossing import beside, resting_sweep
from oilsim.slick.parcels import Parcels, ParcelState, Rows, sums

Array = NDArray[np.float64]


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


def carry_stranded(parcels: Parcels, barriers: Barriers) -> None:
    """Move stranded parcels with the outlines that carry them."""
    stuck = np.flatnonzero(parcels.state == ParcelState.STRANDED)
    stuck = stuck[barriers.carries[parcels.place[stuck]]]
    parcels.position[stuck] = barriers.points(parcels.place[stuck], parcels.along[stuck])

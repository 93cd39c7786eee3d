"""Stranding: oil that meets the outline of land or of a hull sticks to it until the outline is full; the rest floats on.

Each side of an outline takes its capacity [m3/m] times its length. A parcel for which there is room sticks as a whole, one for which there
is some room is split, and where there is none it stays afloat beside the outline. Stranded oil moves with the outline.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.slick.barriers import Barriers
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


def carry_stranded(parcels: Parcels, barriers: Barriers) -> None:
    """Move stranded parcels with the outlines that carry them."""
    stuck = np.flatnonzero(parcels.state == ParcelState.STRANDED)
    stuck = stuck[barriers.carries[parcels.place[stuck]]]
    parcels.position[stuck] = barriers.points(parcels.place[stuck], parcels.along[stuck])

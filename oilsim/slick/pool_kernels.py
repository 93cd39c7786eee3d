"""Loops over held parcels: sums of pools, sliding along segments, and the places of parcels in their pools."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.backend.jit import EXACT, exactly_inlined
from oilsim.slick.barriers import MARGIN, NEAR, STANDOFF
from oilsim.slick.crossing import crossing, first_crossing

Rows = Ints

# [1] square root of 2, less 1; theory (Weyl); multiples fill the unit interval evenly, whatever the golden angle of a release
SILVER = 0.41421356237309503
# [1] share of a free way to a barrier at which a parcel of a pool stops; numerical; it must stay on its own side
SHORT_OF = 0.9
# [1] columns of the sums of pools; layout; volume, and volume times density, viscosity and interfacial tension
SUMS = 4


class Held(NamedTuple):
    """Columns of all parcels that loops read and write, and the rows of those that are held; see `oilsim.slick.parcels.Parcels`.

    rows (M,); id, place, side (N,); along (N,) [-]; ahead, thickness (N,) [m].
    """

    rows: Rows
    id: Rows
    place: Rows
    side: Rows
    along: Array
    ahead: Array
    thickness: Array


class Lines(NamedTuple):
    """Segments as loops need them: start, way to the end and normals (S, 2) [m], [m], [-]; length (S,) [m]; following, preceding (S,)."""

    start: Array
    way: Array
    normal: Array
    length: Array
    following: Rows
    preceding: Rows


class Aims(NamedTuple):
    """The profiles of P pools, which decide where their parcels lie.

    away (P, 2) [-] unit vector from the segment into the pool; growth K (P,) [m] along it, thickness h_b (P,) [m], volume (P,) [m2] a metre
    of segment; travel (P,) [m] that parcels move at most; pressed (P,) whether the pool has a profile.
    """

    away: Array
    growth: Array
    thickness: Array
    volume: Array
    travel: Array
    pressed: Flags


@exactly_inlined
def pool_index(held, row):
    """Return the pool [-] of a held parcel."""
    return 2 * held.place[row] + (1 if held.side[row] < 0 else 0)


@njit(**EXACT)
def sum_pools(held, columns, sums):
    """Add up pools in sums (P, 4), in order volume [m3], and volume times density, viscosity, tension; columns (4, N) of all parcels."""
    for row in held.rows:
        pool, volume = pool_index(held, row), columns[0, row]
        sums[pool, 0] += volume
        for quantity in range(1, SUMS):
            sums[pool, quantity] += volume * columns[quantity, row]


@njit(**EXACT)
def slide_parcels(held, lines, carried, slope, duration, gone):
    """Move held parcels along their segments for `duration` [s], over one joint at most; mark in gone (M,) those past a free end.

    Oil before a segment that a reel has just taken in goes on before the following one.
    carried (S,) [m/s] along each segment by the water; slope (P, 2) [m/s] by the pool's slope at the segment's start and end.
    """
    for m in range(held.rows.shape[0]):
        row = held.rows[m]
        pool, place, along = pool_index(held, row), held.place[row], held.along[row]
        gone[m] = False
        if lines.way[place, 0] == 0.0 and lines.way[place, 1] == 0.0:
            gone[m] = lines.following[place] < 0
            if not gone[m]:
                held.place[row], held.along[row] = lines.following[place], 0.0
            continue
        speed = carried[place] + (1.0 - along) * slope[pool, 0] + along * slope[pool, 1]
        along += speed * duration / lines.length[place]
        if along > 1.0 or along < 0.0:
            to = lines.following[place] if along > 1.0 else lines.preceding[place]
            past = (along - 1.0 if along > 1.0 else -along) * lines.length[place]
            if to < 0:
                gone[m] = True
                along = 1.0 if along > 1.0 else 0.0
            else:
                inside = min(past / lines.length[to], 1.0)
                along = inside if along > 1.0 else 1.0 - inside
                held.place[row] = to
        held.along[row] = along


@exactly_inlined
def rise_to_profile(held, row, pool, aims):
    """Move a held parcel towards the distance at which the pool's profile wants it, and set its thickness."""
    rank = (held.id[row] * SILVER) % 1.0
    deep, growth = aims.thickness[pool], aims.growth[pool]
    local = np.cbrt(max(deep**3 - 1.5 * growth * rank * aims.volume[pool], 0.0))
    wanted = (deep * deep - local * local) / growth - held.ahead[row]
    held.ahead[row] += min(max(wanted, -aims.travel[pool]), aims.travel[pool])
    held.thickness[row] = local


@exactly_inlined
def point_beside(lines, place, along, side, axis):
    """Return a coordinate [m] of the point a standoff beside a segment."""
    return lines.start[place, axis] + along * lines.way[place, axis] + STANDOFF * side * lines.normal[place, axis]


@njit(**EXACT)
def place_parcels(held, lines, aims, sweep, position):
    """Put held parcels at position (N, 2) [m], where their pools' profiles want them, as far as they get and no barrier is between.

    Each is reached on a straight way from the point beside its segment, or, in a corner so sharp that this point would lie
    beyond the next segment, from beside the segment's middle.
    """
    for m in range(held.rows.shape[0]):
        row = held.rows[m]
        pool, place, side = pool_index(held, row), held.place[row], held.side[row]
        if aims.pressed[pool]:
            rise_to_profile(held, row, pool, aims)
        margin = MARGIN * STANDOFF / lines.length[place]
        along = min(max(held.along[row], margin), 1.0 - margin)
        x, y = point_beside(lines, place, along, side, 0), point_beside(lines, place, along, side, 1)
        if along < NEAR * margin or along > 1.0 - NEAR * margin:
            middle_x, middle_y = point_beside(lines, place, 0.5, side, 0), point_beside(lines, place, 0.5, side, 1)
            neighbour = lines.following[place] if along > 0.5 else lines.preceding[place]
            if neighbour >= 0 and crossing(middle_x, middle_y, x, y, sweep.ends, neighbour)[0] <= 1.0:
                x, y = middle_x, middle_y
        way_x, way_y = held.ahead[row] * aims.away[pool, 0], held.ahead[row] * aims.away[pool, 1]
        time = first_crossing(x, y, x + way_x, y + way_y, sweep)[1]
        if time <= 1.0:
            way_x, way_y = SHORT_OF * time * way_x, SHORT_OF * time * way_y
            held.ahead[row] *= SHORT_OF * time
        position[row, 0], position[row, 1] = x + way_x, y + way_y

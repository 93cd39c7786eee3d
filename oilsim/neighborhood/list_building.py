"""Fill neighbour lists: collect the candidates around a cell, and append to each particle's list those within its reach.

Candidates are collected once for all particles of a cell: what lies near the box around these particles, from the ranges of the cells
around. Then one unbroken loop a particle looks at them. Loops over each range, cut to what a particle can reach, would look at few more,
but processors would often guess their ends wrong, which was measured to cost twice what it spares.

Lists are compact within each block of particles, so that one pass without atomic operations fills them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend import simd
from oilsim.backend.arrays import Index, Ints, Real
from oilsim.backend.jit import ALLOCATING, FAST, HALF, inlined
from oilsim.backend.simd.compaction import LANES, Ball, Box, Candidates, append_near, collect_near
from oilsim.backend.thread_team import BLOCK
from oilsim.neighborhood.cell_grid import Grid, cell_coordinate, find_ranges, first_of_row

# [1] candidates of a cell that have room at first; numerical; room doubles where it does not suffice
CANDIDATES = 2048
# [1] share of the support radius that counts as near the particles of a cell; numerical; above 1 by more than coordinates are rounded
ROUNDING = 1.01


class Pairs(NamedTuple):
    """Neighbour lists: the neighbours of particle i are neighbor[start[i] : start[i] + number[i]].

    start     (N,) int64, first place of each list, a multiple of simd.LANES
    number    (N,) uint32, length of each list
    neighbor  (places,) uint32, indices of neighbours; the padding behind a list holds indices too (see `end_list`)
    """

    start: Ints
    number: Index
    neighbor: Index


class CellOrder(NamedTuple):
    """Particles by cell: those of cell c are order[cell_start[c] : cell_start[c + 1]].

    order (M,) uint32, None where that is the order in which they lie; cell_start (cells + 1,) uint32.
    """

    order: Index | None
    cell_start: Index


class Sorted(NamedTuple):
    """Particles of which the first lie in cell order: those of cell c are cell_start[c] to cell_start[c + 1].

    position (3, M) [m]; cell_start (cells + 1,) uint32. Particles beyond cell_start[-1] need a `CellOrder`.
    """

    position: Real
    cell_start: Index


class Others(NamedTuple):
    """The particles among which neighbours are looked for, at position (3, M) [m]: `sorted` ones and, unless None, `moving` ones.

    near  (cells,) uint8, 1 in the cells from which one of them can be reached; None to look from all
    same  whether they are those whose neighbours are looked for: none is its own neighbour
    """

    position: Real
    sorted: CellOrder
    moving: CellOrder | None
    near: NDArray[np.uint8] | None
    same: bool


class Space(NamedTuple):
    """The space of a search: the counted cells, and the lengths of periodic axes [m] (0 for open axes; None if all are open)."""

    grid: Grid
    period: tuple[np.float32, ...] | None


class ListRoom(NamedTuple):
    """Room for neighbour lists.

    pairs    the lists that are filled
    share    places a particle; a block of particles takes BLOCK * share of them
    full     (1,) uint8, becomes 1 where a block ran out of places
    """

    pairs: Pairs
    share: int
    full: NDArray[np.uint8]


@inlined
def end_list(neighbor, cursor):
    """Write the index 0 into simd.LANES places of `neighbor` (P,) from `cursor` on.

    Kernels read those up to the next multiple of simd.LANES together with the list's last neighbours, and must find an index that exists.
    """
    for lane in range(simd.LANES):
        neighbor[cursor + lane] = 0


@inlined
def cell_at(i, position, grid):
    """Return the cell (cx, cy, cz) of particle i of position (3, N) [m]."""
    return (
        cell_coordinate(position[0, i], 0, grid),
        cell_coordinate(position[1, i], 1, grid),
        cell_coordinate(position[2, i], 2, grid),
    )


@inlined
def end_of_cell(first, end, position, grid):
    """Return the particle behind the last one, below `end`, that follows `first` in the same cell; position (3, N) [m]."""
    cx, cy, cz = cell_at(first, position, grid)
    for i in range(first + 1, end):
        x, y, z = cell_at(i, position, grid)
        if x != cx or y != cy or z != cz:
            return i
    return end


@inlined
def box_around(first, last, position, space):
    """Return the `Box` around the particles first to last of position (3, N) [m]; what they can reach is near it."""
    x, y, z = position[0], position[1], position[2]
    low_x, low_y, low_z = high_x, high_y, high_z = x[first], y[first], z[first]
    for i in range(first + 1, last):
        low_x, high_x = min(low_x, x[i]), max(high_x, x[i])
        low_y, high_y = min(low_y, y[i]), max(high_y, y[i])
        low_z, high_z = min(low_z, z[i]), max(high_z, z[i])
    middle = HALF * (low_x + high_x), HALF * (low_y + high_y), HALF * (low_z + high_z)
    half = HALF * (high_x - low_x), HALF * (high_y - low_y), HALF * (high_z - low_z)
    reach = ROUNDING * space.grid.support_radius
    return Box(middle, half, np.float32(reach * reach), space.period)


@inlined
def reaches(near, cell):
    """Return whether others can be reached from a cell, by flags `near` (cells,); None: from all."""
    return True if near is None else near[cell] != 0


@inlined
def collect_from(source, box, position, cell, grid, ranges, found, count):
    """Collect what is near the `box` in the cells around `cell` (3,), behind the first `count` that are found; return the new count.

    It is -1 if `found` has too little room. source: a `CellOrder` of position (3, M) [m], or None; ranges (R, 2): room for cells' ranges.
    """
    if source is None:
        return count
    for n in range(find_ranges(cell[0], cell[1], cell[2], grid, source.cell_start, ranges)):
        first, last = ranges[n, 0], ranges[n, 1]
        if count < 0 or count + (last - first) + LANES > found.index.size:
            return np.int64(-1)
        count = collect_near(box, position, source.order, first, last, found, count)
    return count


@inlined
def collect_around(first, last, position, others, space, ranges, found):
    """Collect in `found` what the particles first to last, of one cell, may reach; return its number, -1 if there is too little room.

    others: the `Others`; ranges (R, 2) int64: room for the ranges of cells.
    """
    grid, cell = space.grid, cell_at(first, position, space.grid)
    if not reaches(others.near, first_of_row(cell[0], cell[1], grid) + cell[2]):
        return np.int64(0)
    box = box_around(first, last, position, space)
    count = collect_from(others.sorted, box, others.position, cell, grid, ranges, found, np.int64(0))
    return collect_from(others.moving, box, others.position, cell, grid, ranges, found, count)


@inlined
def begin_list(i, room):
    """Begin the list of particle i behind that of the particle before, or at the begin of its block; return its first place."""
    pairs = room.pairs
    if i % BLOCK == 0:
        cursor = np.int64(i) * room.share
    else:
        behind = pairs.start[i - 1] + np.int64(pairs.number[i - 1])
        cursor = (behind + simd.LANES - 1) // simd.LANES * simd.LANES
    pairs.start[i], pairs.number[i] = cursor, 0
    return cursor


@njit(**FAST)
def list_cells(begin, end, position, others, space, room, ranges, found):
    """List the neighbours of the particles at position (3, N) [m] from `begin` on, cell by cell, as `build_lists` has it.

    Returns the first particle that has none: `end`, or that of a cell with more candidates than `found` has room for; ranges (R, 2) int64:
    room for the ranges of cells.
    """
    reach_squared, pairs = np.float32(space.grid.support_radius * space.grid.support_radius), room.pairs
    first = begin
    while first < end:
        last = end_of_cell(first, end, position, space.grid)
        count = collect_around(first, last, position, others, space, ranges, found)
        if count < 0:
            return first
        for i in range(first, last):
            cursor = begin_list(i, room)
            if cursor + count + 2 * LANES > np.int64(i // BLOCK + 1) * BLOCK * room.share:
                room.full[0] = 1
            elif count > 0:
                place = position[0, i], position[1, i], position[2, i]
                ball = Ball(place, i if others.same else -1, reach_squared, space.period)
                cursor = append_near(ball, found, count, pairs.neighbor, cursor)
                pairs.number[i] = cursor - pairs.start[i]
                end_list(pairs.neighbor, cursor)
        first = last
    return end


@njit(**ALLOCATING)
def build_lists(begin, end, position, others, space, room):
    """List the neighbours of the particles begin to end, which lie in cell order, within the grid's support radius.

    position (3, N) of the particles [m]; others: the `Others`; space: the `Space` in which to search; room: the `ListRoom` to fill.
    """
    rows = 2 * (2 * space.grid.reach[0] + 1) * (2 * space.grid.reach[1] + 1)
    ranges, places = np.empty((rows + 1, 2), np.int64), CANDIDATES
    while begin < end:
        found = Candidates(np.empty(places, np.uint32), np.empty((3, places), np.float32))
        begin = list_cells(begin, end, position, others, space, room, ranges, found)
        places *= 2

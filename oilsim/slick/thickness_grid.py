"""A sparse grid in plan view that turns parcels into a thickness: blocks of cells exist only where parcels are.

A parcel's volume is spread over 3 by 3 cells with quadratic B-splines, and values are read back with the same splines. So the sum over
cells of thickness times area is the parcels' volume to round-off, and gradients are continuous. Each block has a rim of cells that belong
to its neighbours, so that every spline lies in one block. The rims are added to the neighbours and then read back from them. Blocks are
found through a hash table and numbered in the order of the parcels, so results do not depend on anything else.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, inlined

# [1] binary logarithm of cells along the edge of a block; numerical; a slick of 10,000 parcels has some 12 blocks
SHIFT = 4
# [cells] along the edge of a block; numerical; 2 to the power of SHIFT
EDGE = 1 << SHIFT
# [cells] along the edge of a block with its rim; numerical; one more on either side
WIDTH = EDGE + 2
# [cells] of a block with its rim; numerical; WIDTH squared
AREA = WIDTH * WIDTH
# [blocks] for which there is room at first; numerical; more room is made where it is needed
ROOM = 128
# [1] 2^64 over the golden ratio as a signed number; paper (Knuth, The Art of Computer Programming 6.4); spreads keys evenly
MULTIPLIER = -7046029254386353131


class ThicknessGrid(NamedTuple):
    """The grid of one moment, of B blocks and C = B * AREA cells.

    cell       edge of a cell [m]
    neighbor   (B, 2) slots of the next blocks in x and in y, -1 for none
    cells      (N,) cell that each parcel is in
    thickness  (C,) [m] of cells, rims included
    """

    cell: float
    neighbor: NDArray[np.int64]
    cells: NDArray[np.int64]
    thickness: NDArray[np.float64]


@inlined
def find_block(i, j, table, block):
    """Return the place of block (i, j) in the hash table (T,) of slots [-], or that where it must be put; block (B, 2) indices."""
    key = (i * 73856093) ^ (j * 19349663)
    place = ((key * MULTIPLIER) >> 20) & (table.shape[0] - 1)
    while table[place] >= 0:
        slot = table[place]
        if block[slot, 0] == i and block[slot, 1] == j:
            break
        place = (place + 1) & (table.shape[0] - 1)
    return place


@inlined
def slot_of(i, j, table, block, count):
    """Return the slot [-] of block (i, j), put into table (T,) and block (B, 2) as number `count` where it is new; -1 without room."""
    place = find_block(i, j, table, block)
    if table[place] < 0:
        if count == block.shape[0]:
            return -1
        table[place] = count
        block[count, 0], block[count, 1] = i, j
    return table[place]


@njit(**FAST)
def locate_cells(position, cell, table, block, cells):
    """Fill cells (N,) with the cell of each parcel, add missing blocks, and return their number; -1 if there is no room.

    position (N, 2) [m]; table (T,) slots, -1 where empty; block (B, 2) block indices.
    """
    count, slot, last_i, last_j = 0, -1, 0, 0
    for n in range(position.shape[0]):
        i, j = math.floor(position[n, 0] / cell), math.floor(position[n, 1] / cell)
        block_i, block_j = i >> SHIFT, j >> SHIFT
        if slot < 0 or block_i != last_i or block_j != last_j:
            slot = slot_of(block_i, block_j, table, block, count)
            if slot < 0:
                return -1
            count = max(count, slot + 1)
            last_i, last_j = block_i, block_j
        cells[n] = slot * AREA + ((i & (EDGE - 1)) + 1) * WIDTH + (j & (EDGE - 1)) + 1
    return count


@njit(**FAST)
def surround_blocks(count, table, block):
    """Add the neighbours of the first `count` blocks to table (T,) and block (B, 2) [-]; return the number of blocks, -1 without room."""
    total = count
    for slot in range(count):
        for k in range(9):
            other = slot_of(block[slot, 0] + k // 3 - 1, block[slot, 1] + k % 3 - 1, table, block, total)
            if other < 0:
                return -1
            total = max(total, other + 1)
    return total


@njit(**FAST)
def find_neighbors(count, table, block, neighbor):
    """Fill neighbor (B, 2) with the slots of the next blocks in x and in y; table (T,) slots, block (B, 2) indices."""
    for slot in range(count):
        neighbor[slot, 0] = table[find_block(block[slot, 0] + 1, block[slot, 1], table, block)]
        neighbor[slot, 1] = table[find_block(block[slot, 0], block[slot, 1] + 1, table, block)]


@inlined
def beyond(index):
    """Return -1, 0 or 1: the step to the block that owns the cell at this index of a block with its rim."""
    return -1 if index == 0 else (1 if index == WIDTH - 1 else 0)


@njit(**FAST)
def exchange_rims(count, table, block, thickness, adds):
    """Add the rims of the first `count` blocks to the cells of their neighbours, or, unless `adds`, read them from there.

    table (T,) slots; block (B, 2) indices; thickness (C,) [m].
    """
    for slot in range(count):
        for a in range(WIDTH):
            for b in range(WIDTH):
                step_i, step_j = beyond(a), beyond(b)
                if step_i == 0 and step_j == 0:
                    continue
                other = table[find_block(block[slot, 0] + step_i, block[slot, 1] + step_j, table, block)]
                own = slot * AREA + a * WIDTH + b
                owner = other * AREA + (a - step_i * EDGE) * WIDTH + b - step_j * EDGE
                if adds:
                    thickness[owner] += thickness[own]
                else:
                    thickness[own] = thickness[owner]


@inlined
def splines(x, cell):
    """Return the weights [-] of the three cells around coordinate x [m]."""
    offset = x / cell - math.floor(x / cell) - 0.5
    return 0.5 * (0.5 - offset) ** 2, 0.75 - offset * offset, 0.5 * (0.5 + offset) ** 2


@inlined
def spline_slopes(x, cell):
    """Return the derivatives [1/m] of `splines` with respect to x."""
    offset = x / cell - math.floor(x / cell) - 0.5
    return (offset - 0.5) / cell, -2.0 * offset / cell, (offset + 0.5) / cell


@njit(**FAST)
def deposit(position, volume, cell, cells, thickness):
    """Add the parcels' volume (N,) [m3], spread around cells (N,), to thickness (C,) [m]; position (N, 2) [m]."""
    for n in range(position.shape[0]):
        depth = volume[n] / (cell * cell)
        weight_x, weight_y = splines(position[n, 0], cell), splines(position[n, 1], cell)
        corner = cells[n] - WIDTH - 1
        for a in range(3):
            for b in range(3):
                thickness[corner + a * WIDTH + b] += depth * weight_x[a] * weight_y[b]


@njit(**FAST)
def gather(position, cell, cells, thickness, local):
    """Set local (N,) [m] to the thickness (C,) [m] at each parcel; position (N, 2) [m], cells (N,)."""
    for n in range(position.shape[0]):
        weight_x, weight_y = splines(position[n, 0], cell), splines(position[n, 1], cell)
        corner = cells[n] - WIDTH - 1
        depth = 0.0
        for a in range(3):
            for b in range(3):
                depth += weight_x[a] * weight_y[b] * thickness[corner + a * WIDTH + b]
        local[n] = depth


def build_grid(position: NDArray[np.float64], volume: NDArray[np.float64], cell: float) -> ThicknessGrid:
    """Build the grid of parcels at position (N, 2) [m] with volume (N,) [m3], of cells `cell` [m] wide."""
    cells, room = np.empty(len(position), np.int64), ROOM
    while True:
        block, table = np.empty((room, 2), np.int64), np.full(4 * room, -1, np.int64)
        count = locate_cells(position, cell, table, block, cells)
        total = surround_blocks(count, table, block) if count >= 0 else -1
        if total >= 0:
            break
        room *= 4
    neighbor = np.empty((total, 2), np.int64)
    find_neighbors(total, table, block, neighbor)
    thickness = np.zeros(total * AREA)
    deposit(position, volume, cell, cells, thickness)
    exchange_rims(count, table, block, thickness, True)
    exchange_rims(count, table, block, thickness, False)
    return ThicknessGrid(cell, neighbor, cells, thickness)

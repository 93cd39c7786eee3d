"""A sparse grid in plan view that turns parcels into a thickness: blocks of cells exist only where parcels are.

A parcel's volume is spread over 3 by 3 cells with quadratic B-splines, and values are read back with the same splines. So the sum over
cells of thickness times area is the parcels' volume to round-off, and gradients are continuous. Blocks are found through a hash table;
blocks are numbered in the order of the parcels, so results do not depend on anything else.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, inlined

# [1] binary logarithm of cells along the edge of a block; numerical; a slick of 10,000 parcels has some 30 blocks
SHIFT = 3
# [cells] along the edge of a block; numerical; 2 to the power of SHIFT
EDGE = 1 << SHIFT
# [cells] of a block; numerical; EDGE squared
AREA = EDGE * EDGE
# [1] 2^64 over the golden ratio as a signed number; paper (Knuth, The Art of Computer Programming 6.4); spreads keys evenly
MULTIPLIER = -7046029254386353131


class ThicknessGrid(NamedTuple):
    """The grid of one moment.

    cell       edge of a cell [m]
    block      (B, 2) block indices; neighbor (B, 2) slots of the next blocks in x and in y, or -1
    cells      (N, 9) cell of each parcel's spline, as slot * AREA + cell in the block
    thickness  (B * AREA,) [m]
    """

    cell: float
    block: NDArray[np.int64]
    neighbor: NDArray[np.int64]
    cells: NDArray[np.int64]
    thickness: NDArray[np.float64]


@inlined
def home(i, j, size):
    """Return the place in a hash table of `size`, a power of 2, at which the search for block (i, j) begins."""
    key = (i * 73856093) ^ (j * 19349663)
    return ((key * MULTIPLIER) >> 20) & (size - 1)


@inlined
def find_block(i, j, table, block):
    """Return the place of block (i, j) in the hash table (T,) of slots [-], or that where it must be put; block (B, 2) indices."""
    place = home(i, j, table.shape[0])
    while table[place] >= 0:
        slot = table[place]
        if block[slot, 0] == i and block[slot, 1] == j:
            break
        place = (place + 1) & (table.shape[0] - 1)
    return place


@njit(**FAST)
def locate_cells(position, cell, table, block, cells):
    """Fill cells (N, 9) with the cells of each parcel's spline, add missing blocks, and return their number; -1 if there is no room.

    position (N, 2) [m]; table (T,) slots, -1 where empty; block (B, 2) block indices.
    """
    count = 0
    for n in range(position.shape[0]):
        base_i = math.floor(position[n, 0] / cell)
        base_j = math.floor(position[n, 1] / cell)
        last_i, last_j, slot = 0, 0, -1
        for k in range(9):
            i, j = base_i + k // 3 - 1, base_j + k % 3 - 1
            block_i, block_j = i >> SHIFT, j >> SHIFT
            if slot < 0 or block_i != last_i or block_j != last_j:
                place = find_block(block_i, block_j, table, block)
                slot = table[place]
                if slot < 0:
                    if count == block.shape[0]:
                        return -1
                    slot = count
                    table[place] = slot
                    block[slot, 0], block[slot, 1] = block_i, block_j
                    count += 1
                last_i, last_j = block_i, block_j
            cells[n, k] = slot * AREA + (i & (EDGE - 1)) * EDGE + (j & (EDGE - 1))
    return count


@njit(**FAST)
def find_neighbors(count, table, block, neighbor):
    """Fill neighbor (B, 2) with the slots of the next blocks in x and in y; table (T,) slots, block (B, 2) indices."""
    for slot in range(count):
        neighbor[slot, 0] = table[find_block(block[slot, 0] + 1, block[slot, 1], table, block)]
        neighbor[slot, 1] = table[find_block(block[slot, 0], block[slot, 1] + 1, table, block)]


@inlined
def spline(x, cell, k):
    """Return the weight [-] of the k-th of three cells, k = 0, 1, 2, for a parcel at coordinate x [m]."""
    offset = x / cell - math.floor(x / cell) - 0.5
    if k == 1:
        return 0.75 - offset * offset
    return 0.5 * (0.5 - offset) ** 2 if k == 0 else 0.5 * (0.5 + offset) ** 2


@inlined
def spline_slope(x, cell, k):
    """Return the derivative [1/m] of `spline` with respect to x."""
    offset = x / cell - math.floor(x / cell) - 0.5
    if k == 1:
        return -2.0 * offset / cell
    return (offset - 0.5) / cell if k == 0 else (offset + 0.5) / cell


@njit(**FAST)
def deposit(position, volume, cell, cells, thickness):
    """Add the parcels' volume (N,) [m3], spread over cells (N, 9), to thickness (C,) [m]; position (N, 2) [m]."""
    for n in range(position.shape[0]):
        depth = volume[n] / (cell * cell)
        for k in range(9):
            weight = spline(position[n, 0], cell, k // 3) * spline(position[n, 1], cell, k % 3)
            thickness[cells[n, k]] += depth * weight


@njit(**FAST)
def gather(position, cell, cells, thickness, local):
    """Set local (N,) [m] to the thickness (C,) [m] at each parcel; position (N, 2) [m], cells (N, 9)."""
    for n in range(position.shape[0]):
        depth = 0.0
        for k in range(9):
            weight = spline(position[n, 0], cell, k // 3) * spline(position[n, 1], cell, k % 3)
            depth += weight * thickness[cells[n, k]]
        local[n] = depth


def build_grid(position: NDArray[np.float64], volume: NDArray[np.float64], cell: float) -> ThicknessGrid:
    """Build the grid of parcels at position (N, 2) [m] with volume (N,) [m3], of cells `cell` [m] wide."""
    cells = np.empty((len(position), 9), np.int64)
    room = 64
    while True:
        block, table = np.empty((room, 2), np.int64), np.full(4 * room, -1, np.int64)
        count = locate_cells(position, cell, table, block, cells)
        if count >= 0:
            break
        room *= 4
    neighbor = np.empty((count, 2), np.int64)
    find_neighbors(count, table, block, neighbor)
    thickness = np.zeros(count * AREA)
    deposit(position, volume, cell, cells, thickness)
    return ThicknessGrid(cell, block[:count], neighbor, cells, thickness)

"""Regular cells over the domain: in which cell a particle lies, and which cells it can reach.

A cell is one support radius wide in x and y and half of it along z, the fastest axis, so that the candidates of a row of cells are one
contiguous range and few of them miss. Rows are counted over strips of STRIP cells in y, in each strip along x. So a particle's neighbours
are near it in memory too, whatever the domain's extent. Seas are shallow, so columns of z are short. When cells were counted in layers
of z, neighbours in a sea ten particles deep lay half of all particles apart, and every look at them cost twice as much.

In a domain much larger than its liquid only the cells around the liquid are counted (`part_around`). Particles elsewhere count as in a
border cell of that part. The order of cells is that of the domain, whatever the part.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, inlined

# [1] cells for each support radius in x and y; numerical; few candidates miss, in few ranges
CELLS_ACROSS = 1
# [1] cells for each support radius in z; numerical; ranges along z are contiguous whatever the number
CELLS_ALONG = 2
# [cells] in y that are counted together; measured; see the module's docstring
STRIP = 8
# [cells] around the liquid that must be counted; theory; the support reaches two cells along z
MARGIN = 4
# [cells] beyond that, in which the liquid may move; numerical; not on record
SPARE = 8


class Grid(NamedTuple):
    """Regular cells over the domain, of which a part is counted.

    lower           lower corner of the domain [m]
    inverse_width   of a cell along each axis [1/m]
    first           cells of the domain before the counted ones along each axis, in y a multiple of `strip`
    cells           counted cells along each axis
    periodic        whether each axis repeats
    reach           cells within the support radius along each axis
    strip           cells in y that are counted together before x moves on
    support_radius  H [m]
    """

    lower: tuple[float, float, float]
    inverse_width: tuple[float, float, float]
    first: tuple[int, int, int]
    cells: tuple[int, int, int]
    periodic: tuple[bool, bool, bool]
    reach: tuple[int, int, int]
    strip: int
    support_radius: float

    @property
    def cell_count(self) -> int:
        """Return the number of counted cells, with those that fill up the last strip."""
        return self.cells[0] * -(-self.cells[1] // self.strip) * self.strip * self.cells[2]


def make_grid(
    lower: tuple[float, float, float],
    upper: tuple[float, float, float],
    periodic: tuple[bool, bool, bool],
    support_radius: float,
    dimension: int,
) -> Grid:
    """Return cells that cover the domain from lower to upper [m]; ValueError for a periodic axis shorter than three support radii."""
    counts, inverse, reach = [], [], []
    for axis, (low, high, repeats) in enumerate(zip(lower, upper, periodic, strict=True)):
        per_radius = CELLS_ALONG if axis == 2 else CELLS_ACROSS
        extent = high - low
        if repeats and extent < 3.0 * support_radius:
            raise ValueError(
                f"periodic axis {'xyz'[axis]} is {extent} m long, allowed: {3.0 * support_radius} m or more"
            )
        count = max(3 if repeats else 1, math.floor(extent * per_radius / support_radius))
        if dimension == 2 and axis == 1:
            count, per_radius = 1, 0
        counts.append(count)
        inverse.append(count / extent)
        reach.append(per_radius)
    return Grid(
        lower,
        (inverse[0], inverse[1], inverse[2]),
        (0, 0, 0),
        (counts[0], counts[1], counts[2]),
        periodic,
        (reach[0], reach[1], reach[2]),
        min(STRIP, counts[1]),
        support_radius,
    )


def part_around(whole: Grid, low: Sequence[int], high: Sequence[int], around: int) -> Grid:
    """Return the part of a `whole` grid from cell `low` to cell `high` (3,) and so many cells `around` it; periodic axes stay whole."""
    begin, count = [], []
    for axis, (one, other) in enumerate(zip(low, high, strict=True)):
        step, cells = whole.strip if axis == 1 else 1, whole.cells[axis]
        first = 0 if whole.periodic[axis] else max(one - around, 0) // step * step
        begin.append(first)
        count.append(cells if whole.periodic[axis] else min(other + around + 1, cells) - first)
    return whole._replace(first=(begin[0], begin[1], begin[2]), cells=(count[0], count[1], count[2]))


def holds(grid: Grid, part: Grid) -> bool:
    """Return whether all cells of `part` are counted in `grid`, another part of the same whole."""
    return all(
        here <= there and there + wanted <= here + count
        for here, count, there, wanted in zip(grid.first, grid.cells, part.first, part.cells, strict=True)
    )


@inlined
def cell_coordinate(value, axis, grid):
    """Return the cell along one axis of a coordinate `value` [m]; places outside count as in the border cell."""
    cell = np.int64(math.floor((value - grid.lower[axis]) * grid.inverse_width[axis])) - grid.first[axis]
    return min(max(cell, 0), grid.cells[axis] - 1)


@njit(**FAST)
def find_extent(position, count, lower, inverse_width, cells, low, high):
    """Set `low` and `high` (3,) to the first and last cell along each axis that holds one of the first `count` of `position` (3, N) [m].

    lower (3,) corner of the cells [m]; inverse_width (3,) of a cell [1/m]; cells (3,) along each axis. Places outside count as in a border
    cell.
    """
    for axis in range(3):
        first, last = np.int64(cells[axis] - 1), np.int64(0)
        for i in range(count):
            cell = np.int64(math.floor((position[axis, i] - lower[axis]) * inverse_width[axis]))
            first, last = min(first, cell), max(last, cell)
        last = min(last, np.int64(cells[axis] - 1))
        low[axis], high[axis] = max(min(first, last), 0), last


@inlined
def first_of_row(cx, cy, grid):
    """Return the index of the lowest cell at (cx, cy)."""
    strip = np.int64(grid.strip)
    return (((cy // strip) * grid.cells[0] + cx) * strip + cy % strip) * grid.cells[2]


@njit(**FAST)
def assign_cells(begin, end, position, grid, cell):
    """Fill `cell` (N,) uint32 with the cell of each particle; position (3, N) [m]."""
    for i in range(begin, end):
        cx = cell_coordinate(position[0, i], 0, grid)
        cy = cell_coordinate(position[1, i], 1, grid)
        cz = cell_coordinate(position[2, i], 2, grid)
        cell[i] = first_of_row(cx, cy, grid) + cz


@njit(**FAST)
def count_sort(cell, cell_start, order):
    """Sort particles by cell, stably, by counting.

    cell (N,) uint32         index of each particle's cell
    cell_start (cells + 1,)  becomes the place in `order` where each cell begins
    order (N,)               becomes the indices of the particles, by cell
    """
    cell_start[:] = 0
    for i in range(cell.size):
        cell_start[cell[i] + 1] += 1
    for c in range(1, cell_start.size):
        cell_start[c] += cell_start[c - 1]
    for i in range(cell.size):
        order[cell_start[cell[i]]] = i
        cell_start[cell[i]] += 1
    for c in range(cell_start.size - 1, 0, -1):
        cell_start[c] = cell_start[c - 1]
    cell_start[0] = 0


@inlined
def wrapped(c, count):
    """Return cell c of an axis that repeats after `count` cells; c lies less than `count` cells outside."""
    return c + count if c < 0 else (c - count if c >= count else c)


@inlined
def ranges_along(cz, reach, count, periodic):
    """Return the cells within reach of cell cz of its row as two half-open ranges; the second is empty unless the axis wraps."""
    if periodic and (cz - reach < 0 or cz + reach >= count):
        return ((cz - reach) % count, count), (0, (cz + reach) % count + 1)
    return (max(cz - reach, 0), min(cz + reach + 1, count)), (0, 0)


@njit(**FAST)
def mark_surroundings(position, grid, near):
    """Set `near` (cells,) uint8 to 1 in every cell from which a particle could reach one of `position` (3, M) [m]."""
    nx, ny, nz = grid.cells
    rx, ry, rz = grid.reach
    for b in range(position.shape[1]):
        cx = cell_coordinate(position[0, b], 0, grid)
        cy = cell_coordinate(position[1, b], 1, grid)
        cz = cell_coordinate(position[2, b], 2, grid)
        ranges = ranges_along(cz, rz, nz, grid.periodic[2])
        for sx in range(cx - rx, cx + rx + 1):
            if not grid.periodic[0] and (sx < 0 or sx >= nx):
                continue
            for sy in range(cy - ry, cy + ry + 1):
                if not grid.periodic[1] and (sy < 0 or sy >= ny):
                    continue
                row = first_of_row(np.int64(wrapped(sx, nx)), np.int64(wrapped(sy, ny)), grid)
                for low, high in ranges:
                    near[row + low : row + high] = 1


@inlined
def find_ranges(cx, cy, cz, grid, cell_start, ranges):
    """Fill `ranges` (R, 2) with the half-open ranges of particles in the rows of cells around a cell, and return their number.

    (cx, cy, cz)             the cell
    grid                     the `Grid`
    cell_start (cells + 1,)  index of the particle with which each cell begins
    Empty rows are left out.
    """
    nx, ny, nz = grid.cells
    rx, ry, rz = grid.reach
    found = 0
    along = ranges_along(cz, rz, nz, grid.periodic[2])
    for sx in range(cx - rx, cx + rx + 1):
        if not grid.periodic[0] and (sx < 0 or sx >= nx):
            continue
        for sy in range(cy - ry, cy + ry + 1):
            if not grid.periodic[1] and (sy < 0 or sy >= ny):
                continue
            row = first_of_row(np.int64(wrapped(sx, nx)), np.int64(wrapped(sy, ny)), grid)
            for low, high in along:
                ranges[found, 0], ranges[found, 1] = cell_start[row + low], cell_start[row + high]
                found += np.int64(ranges[found, 1] > ranges[found, 0])
    return found

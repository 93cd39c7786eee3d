"""Regular cells over the domain: which particles lie in which, and which cells can be reached from which.

Cells are a support radius wide across and half of it along z, the fastest axis, so that the candidates of a row of cells
are one contiguous range and few of them miss. Rows are counted over strips of STRIP cells in y, in each strip along x: whatever the
domain's extent, a particle's neighbours are near it in memory too. Seas are shallow, so columns of z are short. Counted in layers of
z, the neighbours of a sea ten particles deep lay half of all particles apart, and every look at them cost twice as much.

Of a domain much larger than its liquid only a part is counted, `part_around` what the liquid may reach. What lies elsewhere counts as in a
border cell of it. The order of cells is that of the domain, whatever the part.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, inlined

CELLS_ACROSS = 1  # cells per support radius in x and y
CELLS_ALONG = 2  # cells per support radius in z
STRIP = 8  # cells in y
MARGIN = 4  # cells around the liquid that must be counted, so that no list looks into border cells: skins reach three along z
SPARE = 8  # cells beyond that, in which it may move


class Grid(NamedTuple):
    """Regular cells over the domain, or a part of them: its lower corner [m], inverse widths [1/m], counts, and which axes repeat.

    first: the domain's cells before those that are counted, along each axis, in y a multiple of `strip`.
    strip: cells in y that are counted together before x moves on.
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
        """Cells that are counted, those of the last strip beyond them included."""
        return self.cells[0] * -(-self.cells[1] // self.strip) * self.strip * self.cells[2]


def make_grid(
    lower: tuple[float, float, float],
    upper: tuple[float, float, float],
    periodic: tuple[bool, bool, bool],
    support_radius: float,
    dimension: int,
) -> Grid:
    """Cells that cover the domain; a periodic axis must be at least three support radii long (ValueError)."""
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
    """The part of a whole grid from cell `low` to cell `high` (3,) with so many `around`, of axes that repeat all."""
    begin, count = [], []
    for axis, (one, other) in enumerate(zip(low, high, strict=True)):
        step, cells = whole.strip if axis == 1 else 1, whole.cells[axis]
        first = 0 if whole.periodic[axis] else max(one - around, 0) // step * step
        begin.append(first)
        count.append(cells if whole.periodic[axis] else min(other + around + 1, cells) - first)
    return whole._replace(first=(begin[0], begin[1], begin[2]), cells=(count[0], count[1], count[2]))


def holds(grid: Grid, part: Grid) -> bool:
    """Whether all cells of `part` are counted in `grid`, another part of the same whole."""
    return all(
        here <= there and there + wanted <= here + count
        for here, count, there, wanted in zip(grid.first, grid.cells, part.first, part.cells, strict=True)
    )


def widened(grid: Grid, skin: float) -> Grid | None:
    """The same cells, with a support radius longer by `skin` [m]; None if a periodic axis is too short for it."""
    radius = grid.support_radius + skin
    reach = [math.ceil(radius * w) if r else 0 for w, r in zip(grid.inverse_width, grid.reach, strict=True)]
    for count, around, repeats in zip(grid.cells, reach, grid.periodic, strict=True):
        if repeats and count < 2 * around + 1:
            return None
    return grid._replace(reach=(reach[0], reach[1], reach[2]), support_radius=radius)


@inlined
def cell_coordinate(value, axis, grid):
    """Cell along one axis; what lies outside counts as the border cell."""
    cell = np.int64(math.floor((value - grid.lower[axis]) * grid.inverse_width[axis])) - grid.first[axis]
    return min(max(cell, 0), grid.cells[axis] - 1)


@njit(**FAST)
def find_extent(position, count, lower, inverse_width, cells, low, high):
    """Set `low` and `high` (3,) to the first and the last cell along each axis that holds one of the first `count` of `position` (3, N).

    The cells of a grid from `lower` [m] on, inverse_width [1/m], as many as `cells` (3,); what lies outside counts as in a border cell.
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
    """The lowest of the cells above each other at (cx, cy)."""
    strip = np.int64(grid.strip)
    return (((cy // strip) * grid.cells[0] + cx) * strip + cy % strip) * grid.cells[2]


@njit(**FAST)
def assign_cells(begin, end, position, grid, cell):
    """Fill `cell` with the cell of each particle."""
    for i in range(begin, end):
        cx = cell_coordinate(position[0, i], 0, grid)
        cy = cell_coordinate(position[1, i], 1, grid)
        cz = cell_coordinate(position[2, i], 2, grid)
        cell[i] = first_of_row(cx, cy, grid) + cz


@njit(**FAST)
def count_sort(cell, cell_start, order):
    """Stable counting sort: `order` lists particles by cell, `cell_start` (cells + 1) where each cell begins."""
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
    """Cell c of an axis that repeats after `count` cells; c lies less than `count` outside."""
    return c + count if c < 0 else (c - count if c >= count else c)


@inlined
def ranges_along(cz, reach, count, periodic):
    """The cells within reach of cell cz of its row as two half-open ranges, the second empty unless the axis wraps."""
    if periodic and (cz - reach < 0 or cz + reach >= count):
        return ((cz - reach) % count, count), (0, (cz + reach) % count + 1)
    return (max(cz - reach, 0), min(cz + reach + 1, count)), (0, 0)


@njit(**FAST)
def mark_surroundings(position, grid, near):
    """Set `near` (cells,) to 1 in every cell from which a particle could reach one of `position` (3, M)."""
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


@njit(**FAST)
def find_ranges(cx, cy, cz, grid, cell_start, ranges):
    """Fill `ranges` (R, 2) with the particles begin to end, by `cell_start`, of the rows of cells around a cell; their number.

    Only rows that hold something are listed.
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

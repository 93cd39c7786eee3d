"""Neighbour search on a regular grid: particles in cell order, full lists of fluid and boundary neighbours.

Cells are a support radius wide across and half of it along x, the fastest axis, so that the candidates of a row of cells
are one contiguous range and few of them miss; the ranges around a cell are found once for all its particles. Lists are
compact within each block of particles: one pass, no atomics; a block that overflows its share says so, and the lists are
built again with a larger share.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.compaction import LANES, append_near
from oilsim.parallel import BLOCK, Team, block_count
from oilsim.smoothing_kernels import FAST

Index = NDArray[np.uint32]
Real = NDArray[np.float32]

CELLS_ACROSS = 1  # cells per support radius in y and z
CELLS_ALONG = 2  # cells per support radius in x


class Grid(NamedTuple):
    """Regular cells over the domain: lower corner [m], inverse widths [1/m], counts, and which axes repeat."""

    lower: tuple[float, float, float]
    inverse_width: tuple[float, float, float]
    cells: tuple[int, int, int]
    periodic: tuple[bool, bool, bool]
    reach: tuple[int, int, int]
    support_radius: float

    @property
    def cell_count(self) -> int:
        return self.cells[0] * self.cells[1] * self.cells[2]


class Pairs(NamedTuple):
    """Neighbour lists: neighbours of particle i are neighbor[start[i] : start[i] + number[i]]."""

    start: NDArray[np.int64]
    number: Index
    neighbor: Index


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
        per_radius = CELLS_ALONG if axis == 0 else CELLS_ACROSS
        extent = high - low
        if repeats and extent < 3.0 * support_radius:
            raise ValueError(
                f"periodic axis {'xyz'[axis]} is {extent} m long, allowed: {3.0 * support_radius} m or more"
            )
        count = max(1, math.floor(extent * per_radius / support_radius))
        if dimension == 2 and axis == 1:
            count, per_radius = 1, 0
        counts.append(count)
        inverse.append(count / extent)
        reach.append(per_radius)
    return Grid(
        lower,
        (inverse[0], inverse[1], inverse[2]),
        (counts[0], counts[1], counts[2]),
        periodic,
        (reach[0], reach[1], reach[2]),
        support_radius,
    )


@njit(inline="always", **FAST)
def cell_coordinate(value, lower, inverse_width, count):
    """Cell along one axis; what lies outside counts as the border cell."""
    return min(max(np.int64(math.floor((value - lower) * inverse_width)), 0), count - 1)


@njit(**FAST)
def assign_cells(begin, end, position, grid, cell):
    """Fill `cell` with the linear cell of each particle, x fastest."""
    for i in range(begin, end):
        cx = cell_coordinate(position[0, i], grid.lower[0], grid.inverse_width[0], grid.cells[0])
        cy = cell_coordinate(position[1, i], grid.lower[1], grid.inverse_width[1], grid.cells[1])
        cz = cell_coordinate(position[2, i], grid.lower[2], grid.inverse_width[2], grid.cells[2])
        cell[i] = (cz * grid.cells[1] + cy) * grid.cells[0] + cx


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


@njit(inline="always", **FAST)
def nearest_image(delta, period):
    """Separation along one axis under the shortest of the periodic images; period 0 leaves it as it is."""
    if period > 0.0:
        return delta - period * math.floor(delta / period + np.float32(0.5))
    return delta


@njit(inline="always", **FAST)
def nearest_images(dx, dy, dz, period):
    """Separation under the shortest of the periodic images; a scene without period compiles to nothing."""
    if period is None:
        return dx, dy, dz
    return nearest_image(dx, period[0]), nearest_image(dy, period[1]), nearest_image(dz, period[2])


@njit(inline="always", **FAST)
def x_ranges(cx, reach, count, periodic):
    """The cells within reach of cell cx along x as two half-open ranges, the second empty unless the axis wraps."""
    if periodic and (cx - reach < 0 or cx + reach >= count):
        return ((cx - reach) % count, count), (0, (cx + reach) % count + 1)
    return (max(cx - reach, 0), min(cx + reach + 1, count)), (0, 0)


@njit(**FAST)
def mark_surroundings(position, grid, near):
    """Set `near` (cells,) to 1 in every cell from which a particle could reach one of `position` (3, M)."""
    nx, ny, nz = grid.cells
    rx, ry, rz = grid.reach
    for b in range(position.shape[1]):
        cx = cell_coordinate(position[0, b], grid.lower[0], grid.inverse_width[0], nx)
        cy = cell_coordinate(position[1, b], grid.lower[1], grid.inverse_width[1], ny)
        cz = cell_coordinate(position[2, b], grid.lower[2], grid.inverse_width[2], nz)
        ranges = x_ranges(cx, rx, nx, grid.periodic[0])
        for sz in range(cz - rz, cz + rz + 1):
            if not grid.periodic[2] and (sz < 0 or sz >= nz):
                continue
            for sy in range(cy - ry, cy + ry + 1):
                if not grid.periodic[1] and (sy < 0 or sy >= ny):
                    continue
                row = (np.int64(sz % nz) * ny + np.int64(sy % ny)) * nx
                for low, high in ranges:
                    near[row + low : row + high] = 1


@njit(inline="always", **FAST)
def wrapped(c, count):
    """Cell c of an axis that repeats after `count` cells; c lies less than `count` outside."""
    return c + count if c < 0 else (c - count if c >= count else c)


@njit(**FAST)
def find_ranges(cx, cy, cz, grid, cell_start, ranges):
    """Fill `ranges` (R, 2) with the particles begin to end, by `cell_start`, of the rows of cells around a cell; their number.

    Only rows that hold something are listed.
    """
    nx, ny, nz = grid.cells
    rx, ry, rz = grid.reach
    found = 0
    along = x_ranges(cx, rx, nx, grid.periodic[0])
    for sz in range(cz - rz, cz + rz + 1):
        if not grid.periodic[2] and (sz < 0 or sz >= nz):
            continue
        for sy in range(cy - ry, cy + ry + 1):
            if not grid.periodic[1] and (sy < 0 or sy >= ny):
                continue
            row = (np.int64(wrapped(sz, nz)) * ny + np.int64(wrapped(sy, ny))) * nx
            for low, high in along:
                ranges[found, 0], ranges[found, 1] = cell_start[row + low], cell_start[row + high]
                found += np.int64(ranges[found, 1] > ranges[found, 0])
    return found


@njit(**FAST)
def build_lists(
    begin,
    end,
    position,
    other,
    near,
    cell_start,
    moving_order,
    moving_start,
    grid,
    period,
    same,
    share,
    start,
    number,
    neighbor,
    full,
):
    """List the neighbours in `other` of the particles begin to end.

    near          1 in the cells from which `other` can be reached, None to look from all
    cell_start    where each cell of `other` begins; these particles lie in cell order
    moving_order  indices in `other` of the particles that do not, by cell as moving_start tells; None if there are none
    same          `other` is `position` itself: a particle is not its own neighbour
    share         places in `neighbor` per particle; a block takes BLOCK * share of them
    full          set to 1 where a block ran out of places
    """
    reach_squared = np.float32(grid.support_radius * grid.support_radius)
    rows = 2 * (2 * grid.reach[1] + 1) * (2 * grid.reach[2] + 1)
    ranges, moving_ranges = np.empty((rows + 1, 2), np.int64), np.empty((rows + 1, 2), np.int64)
    found, moving_found, present_cell = 0, 0, np.int64(-1)
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            cursor = np.int64(i // BLOCK * BLOCK) * share
            limit = np.int64((i // BLOCK + 1) * BLOCK) * share
        start[i] = cursor
        number[i] = 0
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        me = i if same else -1
        cx = cell_coordinate(xi, grid.lower[0], grid.inverse_width[0], grid.cells[0])
        cy = cell_coordinate(yi, grid.lower[1], grid.inverse_width[1], grid.cells[1])
        cz = cell_coordinate(zi, grid.lower[2], grid.inverse_width[2], grid.cells[2])
        cell = (cz * grid.cells[1] + cy) * grid.cells[0] + cx
        if near is not None and near[cell] == 0:
            continue
        if cell != present_cell:
            present_cell = cell
            found = find_ranges(cx, cy, cz, grid, cell_start, ranges)
            if moving_order is not None:
                moving_found = find_ranges(cx, cy, cz, grid, moving_start, moving_ranges)
        for n in range(found):
            first, last = ranges[n, 0], ranges[n, 1]
            if cursor + (last - first) + LANES > limit:
                full[0] = 1
                break
            cursor, _ = append_near(other, None, first, last, me, xi, yi, zi, period, reach_squared, neighbor, cursor)
        if moving_order is not None:
            for n in range(moving_found):
                first, last = moving_ranges[n, 0], moving_ranges[n, 1]
                if cursor + (last - first) + LANES > limit:
                    full[0] = 1
                    break
                cursor, _ = append_near(
                    other, moving_order, first, last, me, xi, yi, zi, period, reach_squared, neighbor, cursor
                )
        number[i] = cursor - start[i]


class NeighborSearch:
    """Keeps the grid and the lists' storage; `order_by_cell` sorts, `list_neighbors` lists."""

    def __init__(self, grid: Grid, team: Team, period: tuple[float, float, float] | None) -> None:
        self.grid = grid
        self.period = None if period is None else tuple(np.float32(p) for p in period)
        self._team = team
        self._shares: dict[str, int] = {}
        self._storage: dict[str, Pairs] = {}

    def order_by_cell(self, position: Real) -> tuple[Index, Index]:
        """Order (N,) that sorts (3, N) positions by cell, and where each cell starts (cells + 1,)."""
        count = position.shape[1]
        cell = np.empty(count, np.uint32)
        order = np.empty(count, np.uint32)
        cell_start = np.empty(self.grid.cell_count + 1, np.uint32)
        self._team.run(assign_cells, count, position, self.grid, cell)
        count_sort(cell, cell_start, order)
        return order, cell_start

    def surroundings(self, position: Real, base: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
        """Cells (cells,) from which one of `position` (3, M) can be reached are 1, as are those of `base`."""
        near = np.zeros(self.grid.cell_count, np.uint8) if base is None else base.copy()
        mark_surroundings(position, self.grid, near)
        return near

    def list_neighbors(
        self,
        name: str,
        position: Real,
        other: Real,
        cell_start: Index,
        near: NDArray[np.uint8] | None = None,
        moving_order: Index | None = None,
        moving_start: Index | None = None,
    ) -> Pairs:
        """Lists of the neighbours in `other` of every particle (see `build_lists`).

        `name` keeps storage apart over the steps; `near` as from `surroundings` spares the particles far from `other`.
        """
        count = position.shape[1]
        share = self._shares.setdefault(name, 48 if other is position else 16)
        full = np.zeros(1, np.uint8)
        while True:
            pairs = self._reserve(name, count, share)
            full[0] = 0
            self._team.run(
                build_lists, count, position, other, near, cell_start, moving_order, moving_start, self.grid, self.period,
                other is position, share, pairs.start, pairs.number, pairs.neighbor, full,
            )  # fmt: skip
            if not full[0]:
                return pairs
            share = self._shares[name] = 2 * share

    def _reserve(self, name: str, count: int, share: int) -> Pairs:
        places = block_count(max(count, 1)) * BLOCK * share
        kept = self._storage.get(name)
        if kept is None or kept.start.size < count or kept.neighbor.size < places:
            room = block_count(max(count, 1)) * BLOCK
            kept = Pairs(np.empty(room, np.int64), np.empty(room, np.uint32), np.empty(places, np.uint32))
            self._storage[name] = kept
        return kept

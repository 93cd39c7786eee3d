"""Neighbour search: particles in cell order, full lists of fluid and boundary neighbours.

The ranges of candidates around a cell are found once for all its particles. Lists are compact within each block of particles:
one pass, no atomics; a block that overflows its share says so, and the lists are built again with a larger share.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend import simd
from oilsim.backend.compaction import LANES, append_near
from oilsim.backend.jit import ALLOCATING, FAST, inlined
from oilsim.backend.simd import floor, gather_four
from oilsim.backend.thread_team import BLOCK, Team, block_count
from oilsim.neighborhood.cell_grid import (
    MARGIN,
    SPARE,
    Grid,
    assign_cells,
    cell_coordinate,
    count_sort,
    find_extent,
    find_ranges,
    first_of_row,
    holds,
    make_grid,
    mark_surroundings,
    part_around,
    widened,
)

__all__ = ["NeighborSearch", "Pairs", "make_grid", "nearest_image", "nearest_images"]

Index = NDArray[np.uint32]
Real = NDArray[np.float32]

FEW = 2**14  # cells, counted as soon as it is found out where the liquid is
LAVISH = 4  # times the cells that would be counted anew: more are too many


class Pairs(NamedTuple):
    """Neighbour lists: neighbours of particle i are neighbor[start[i] : start[i] + number[i]]; lists begin at multiples of simd.LANES."""

    start: NDArray[np.int64]
    number: Index
    neighbor: Index


@inlined
def nearest_image(delta, period):
    """Separation along one axis under the shortest of the periodic images; period 0 leaves it as it is."""
    if period > np.float32(0.0):
        return delta - period * floor(delta / period + np.float32(0.5))
    return delta


@inlined
def nearest_images(dx, dy, dz, period):
    """Separation under the shortest of the periodic images; a scene without period compiles to nothing."""
    if period is None:
        return dx, dy, dz
    return nearest_image(dx, period[0]), nearest_image(dy, period[1]), nearest_image(dz, period[2])


@inlined
def rows(vectors):
    """The three components (N,) of vectors (3, N)."""
    return vectors[0], vectors[1], vectors[2]


@inlined
def end_list(neighbor, cursor):
    """Let the places from `cursor` to the next multiple of simd.LANES, which are read with the list's last, hold an index."""
    while cursor % simd.LANES:
        neighbor[cursor] = 0
        cursor += 1


@njit(**FAST)
def fill_rows(begin, end, vectors, scalar, result):
    """Set the first four columns of `result` (N, columns) to vectors (3, N) and a scalar (N,), side by side for `gather_four`."""
    for i in range(begin, end):
        result[i, 0], result[i, 1], result[i, 2], result[i, 3] = vectors[0, i], vectors[1, i], vectors[2, i], scalar[i]


@inlined
def separations(i, points, others, j, period):
    """x_i - x_j for lanes of indices j, and the fourth number of j; `points` and `others` (N, 4) begin with places [m]."""
    x, y, z, content = gather_four(others, j, 0)
    dx, dy, dz = nearest_images(points[i, 0] - x, points[i, 1] - y, points[i, 2] - z, period)
    return dx, dy, dz, content


def indices(flags: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """Where flags (N,) are set, as kernels want it."""
    return np.flatnonzero(flags).astype(np.uint32)


@njit(**FAST)
def mark_around(begin, end, chosen, fluid, near):
    """Set `near` (N,) to 1 for the i `chosen` and their neighbours; a scatter, but threads that meet write the same."""
    for n in range(begin, end):
        i = chosen[n]
        near[i] = 1
        first = fluid.start[i]
        for k in range(first, first + np.int64(fluid.number[i])):
            near[fluid.neighbor[k]] = 1


@inlined
def append_ranges(other, order, ranges, found, me, place, period, reach_squared, limit, neighbor, cursor, full):
    """Append those of the first `found` ranges of candidates that are near `place`, up to `limit`; returns the cursor after the last.

    Sets full[0] where there was no room for all (see `append_near`).
    """
    xi, yi, zi = place
    for n in range(found):
        first, last = ranges[n, 0], ranges[n, 1]
        if cursor + (last - first) + 2 * LANES > limit:
            full[0] = 1
            break
        cursor, _ = append_near(other, order, first, last, me, xi, yi, zi, period, reach_squared, neighbor, cursor)
    return cursor


@njit(**ALLOCATING)
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
    padding,
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
    padding       every list begins at a multiple of it
    share         places in `neighbor` per particle; a block takes BLOCK * share of them
    full          set to 1 where a block ran out of places
    """
    reach_squared = np.float32(grid.support_radius * grid.support_radius)
    rows = 2 * (2 * grid.reach[0] + 1) * (2 * grid.reach[1] + 1)
    ranges, moving_ranges = np.empty((rows + 1, 2), np.int64), np.empty((rows + 1, 2), np.int64)
    found, moving_found, present_cell = 0, 0, np.int64(-1)
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            cursor = np.int64(i // BLOCK * BLOCK) * share
            limit = np.int64((i // BLOCK + 1) * BLOCK) * share
        cursor = (cursor + padding - 1) // padding * padding
        start[i] = cursor
        number[i] = 0
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        me = i if same else -1
        cx = cell_coordinate(xi, 0, grid)
        cy = cell_coordinate(yi, 1, grid)
        cz = cell_coordinate(zi, 2, grid)
        cell = first_of_row(cx, cy, grid) + cz
        if near is not None and near[cell] == 0:
            continue
        if cell != present_cell:
            present_cell = cell
            found = find_ranges(cx, cy, cz, grid, cell_start, ranges)
            if moving_order is not None:
                moving_found = find_ranges(cx, cy, cz, grid, moving_start, moving_ranges)
        place = xi, yi, zi
        cursor = append_ranges(
            other, None, ranges, found, me, place, period, reach_squared, limit, neighbor, cursor, full
        )
        if moving_order is not None:
            cursor = append_ranges(
                other, moving_order, moving_ranges, moving_found, me, place, period, reach_squared, limit, neighbor, cursor, full
            )  # fmt: skip
        number[i] = cursor - start[i]
        end_list(neighbor, cursor)


class NeighborSearch:
    """Keeps the grid and the lists' storage; `order_by_cell` sorts, `list_neighbors` lists, in the part of the grid that `cover` chose."""

    def __init__(self, grid: Grid, team: Team, period: tuple[float, float, float] | None) -> None:
        self._whole = self.grid = grid
        self.period = None if period is None else tuple(np.float32(p) for p in period)
        self._team = team
        self._shares: dict[str, int] = {}
        self._storage: dict[str, Pairs] = {}

    def cover(self, position: Real, count: int) -> bool:
        """Count the cells around the first `count` of (3, N) positions and no others, if one of them is not counted or far too many are.

        Whether other cells are counted now.
        """
        whole, (low, high) = self._whole, np.empty((2, 3), np.int64)
        if whole.cell_count <= FEW:
            return False
        find_extent(position, count, whole.lower, whole.inverse_width, whole.cells, low, high)
        wide = part_around(whole, low.tolist(), high.tolist(), MARGIN + SPARE)
        needed = part_around(whole, low.tolist(), high.tolist(), MARGIN)
        if holds(self.grid, needed) and self.grid.cell_count <= LAVISH * wide.cell_count:
            return False
        self.grid = wide
        return True

    def order_by_cell(self, position: Real, count: int | None = None) -> tuple[Index, Index]:
        """Order (n,) that sorts the first n = `count`, or all, of (3, N) positions by cell, and where each cell starts (cells + 1,)."""
        count = position.shape[1] if count is None else count
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

    def allows(self, skin: float) -> bool:
        """Whether the domain is long enough for lists that reach `skin` [m] beyond the support."""
        return widened(self.grid, skin) is not None

    def list_neighbors(
        self,
        name: str,
        position: Real,
        other: Real,
        cell_start: Index,
        near: NDArray[np.uint8] | None = None,
        moving_order: Index | None = None,
        moving_start: Index | None = None,
        skin: float = 0.0,
        count: int | None = None,
    ) -> Pairs:
        """Lists of the neighbours in `other` of every particle, or of the first `count` (see `build_lists`).

        `name` keeps storage apart over the steps; `near` as from `surroundings` spares the particles far from `other`. With a
        `skin` [m] the lists reach that much further and begin at multiples of LANES, so that they can be filtered in place.
        """
        count = position.shape[1] if count is None else count
        share = self._shares.setdefault(name, 48 if other is position else 16)
        grid, padding = (widened(self.grid, skin), LANES) if skin > 0.0 else (self.grid, simd.LANES)
        room, full = block_count(max(count, 1)) * BLOCK, np.zeros(1, np.uint8)
        while True:
            pairs = self.reserve(name, room, room * share)
            full[0] = 0
            self._team.run(
                build_lists, count, position, other, near, cell_start, moving_order, moving_start, grid, self.period,
                other is position, padding, share, pairs.start, pairs.number, pairs.neighbor, full,
            )  # fmt: skip
            if not full[0]:
                return pairs
            share = self._shares[name] = share + max(share // 4, 4)

    def reserve(self, name: str, room: int, places: int) -> Pairs:
        """Storage for lists of `room` particles with `places` neighbours in all."""
        kept = self._storage.get(name)
        if kept is None or kept.start.size < room or kept.neighbor.size < places:
            kept = Pairs(np.empty(room, np.int64), np.empty(room, np.uint32), np.empty(places, np.uint32))
            self._storage[name] = kept
        return kept

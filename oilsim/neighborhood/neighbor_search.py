"""Neighbour search: sort particles by cell, and list the fluid and wall neighbours of each.

A block of particles whose lists need more places than its share says so, and all lists are built again with a larger share. Neighbours j
of particle i satisfy |x_i - x_j| < H, H being the support radius, under the nearest periodic image.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.arrays import Index, Real
from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import floor, gather_four
from oilsim.backend.thread_team import BLOCK, Team, block_count
from oilsim.neighborhood.cell_grid import (
    MARGIN,
    SPARE,
    Grid,
    assign_cells,
    count_sort,
    find_extent,
    holds,
    make_grid,
    mark_surroundings,
    part_around,
)
from oilsim.neighborhood.list_building import CellOrder, ListRoom, Others, Pairs, Sorted, Space, build_lists

__all__ = ["CellOrder", "NeighborSearch", "Pairs", "Sorted", "make_grid", "nearest_image", "nearest_images"]

# [cells] up to which the whole domain is counted; numerical; counting them is as quick as finding the extent of the liquid
FEW = 2**14
# [1] ratio of counted to needed cells beyond which the part is chosen anew; numerical; not on record
LAVISH = 4
# [1] places a particle for fluid and wall neighbours at first; numerical; shares grow where they do not suffice
INITIAL_SHARES = 48, 16


class Neighborhood(NamedTuple):
    """Places of the particles, lists of their neighbours, and the constants of the smoothing kernel.

    points (N, 4)         place x_i [m] and weight rho_ref / rho_0 [1] of the particles
    wall_points (M, 4)    place x_b [m] and volume V_b [m3; m2 in a plane] of the wall particles
    period                lengths [m] of the axes that repeat, 0 for the others; None if none repeats
    fluid, walls          lists of fluid and of wall neighbours (see `Pairs`)
    sigma, support        constant [1/m3; 1/m2 in a plane] and support radius H [m] of the kernel W
    volume                V, the volume of a particle at rest [m3; m2 in a plane]
    """

    points: NDArray[np.float32]
    wall_points: NDArray[np.float32]
    period: tuple[np.float32, np.float32, np.float32] | None
    fluid: Pairs
    walls: Pairs
    sigma: np.float32
    support: np.float32
    volume: np.float32


@inlined
def nearest_image(delta, period):
    """Return the separation `delta` [m] along one axis under the nearest periodic image; a period of 0 leaves it as it is."""
    if period > np.float32(0.0):
        return delta - period * floor(delta / period + np.float32(0.5))
    return delta


@inlined
def nearest_images(dx, dy, dz, period):
    """Return the separation (dx, dy, dz) [m] under the nearest periodic image; a period of None compiles to nothing."""
    if period is None:
        return dx, dy, dz
    return nearest_image(dx, period[0]), nearest_image(dy, period[1]), nearest_image(dz, period[2])


@inlined
def rows(vectors):
    """Return the three components (N,) of vectors (3, N), in their unit."""
    return vectors[0], vectors[1], vectors[2]


@njit(**FAST)
def fill_rows(begin, end, vectors, scalar, result):
    """Set the first four columns of `result` (N, columns) to `vectors` (3, N) and `scalar` (N,), in their unit, for `gather_four`."""
    for i in range(begin, end):
        result[i, 0], result[i, 1], result[i, 2], result[i, 3] = vectors[0, i], vectors[1, i], vectors[2, i], scalar[i]


@inlined
def separations(i, points, others, j, period):
    """Return x_i - x_j [m] for lanes of indices j, and the fourth number of j.

    points (N, 4), others (M, 4): place [m] and another number (weight or volume); period as for `nearest_images`.
    """
    x, y, z, content = gather_four(others, j, 0)
    dx, dy, dz = nearest_images(points[i, 0] - x, points[i, 1] - y, points[i, 2] - z, period)
    return dx, dy, dz, content


def indices(flags: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """Return the indices (K,) at which `flags` (N,) are set, as kernels take them."""
    return np.flatnonzero(flags).astype(np.uint32)


@njit(**FAST)
def mark_around(begin, end, chosen, fluid, near):
    """Set the flags `near` (N,) uint8 to 1 for the particles of indices `chosen` (K,) and all their neighbours in the lists `fluid`.

    This scatters; threads that meet write the same value.
    """
    for n in range(begin, end):
        i = chosen[n]
        near[i] = 1
        first = fluid.start[i]
        for k in range(first, first + np.int64(fluid.number[i])):
            near[fluid.neighbor[k]] = 1


class NeighborSearch:
    """Keeps the grid and the storage of neighbour lists.

    `cover` chooses the part of the domain whose cells are counted; `order_by_cell` sorts and `list_neighbors` lists in that part.
    """

    def __init__(self, grid: Grid, team: Team, period: tuple[float, float, float] | None) -> None:
        self._whole = self.grid = grid
        self.period = None if period is None else tuple(np.float32(p) for p in period)
        self._team = team
        self._shares: dict[str, int] = {}
        self._storage: dict[str, Pairs] = {}

    def cover(self, position: Real, count: int) -> bool:
        """Choose the counted cells around the first `count` of the positions (3, N) [m], and return whether the choice has changed.

        It changes if a needed cell is not counted, or if far more cells are counted than needed.
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
        """Sort the first `count`, or all, of the positions (3, N) [m] by cell; return the stable order, and each cell's start in it."""
        count = position.shape[1] if count is None else count
        cell = np.empty(count, np.uint32)
        order = np.empty(count, np.uint32)
        cell_start = np.empty(self.grid.cell_count + 1, np.uint32)
        self._team.run(assign_cells, count, position, self.grid, cell)
        count_sort(cell, cell_start, order)
        return order, cell_start

    def surroundings(self, position: Real, base: NDArray[np.uint8] | None = None) -> NDArray[np.uint8]:
        """Return (cells,) uint8, 1 in the cells from which one of `position` (3, M) [m] can be reached and in those of `base`."""
        near = np.zeros(self.grid.cell_count, np.uint8) if base is None else base.copy()
        mark_surroundings(position, self.grid, near)
        return near

    def list_neighbors(
        self,
        name: str,
        position: Real,
        other: Sorted,
        near: NDArray[np.uint8] | None = None,
        moving: CellOrder | None = None,
        count: int | None = None,
    ) -> Pairs:
        """List the neighbours among `other` of the particles at `position` (3, N) [m], or of the first `count` of them.

        `name` keeps storage apart over the steps; near (cells,) as from `surroundings` spares the particles far from all others; `moving`
        are those others that do not lie in cell order.
        """
        count, same = position.shape[1] if count is None else count, other.position is position
        share = self._shares.setdefault(name, INITIAL_SHARES[0] if same else INITIAL_SHARES[1])
        space, room, full = Space(self.grid, self.period), block_count(max(count, 1)) * BLOCK, np.zeros(1, np.uint8)
        others = Others(other.position, CellOrder(None, other.cell_start), moving, near, same)
        while True:
            pairs = self.reserve(name, room, room * share)
            full[0] = 0
            lists = ListRoom(pairs, share, full)
            self._team.run(build_lists, count, position, others, space, lists)
            if not full[0]:
                return pairs
            share = self._shares[name] = share + max(share // 4, 4)

    def reserve(self, name: str, room: int, places: int) -> Pairs:
        """Return storage for the lists of `room` particles with `places` neighbours in all; its contents are undefined."""
        kept = self._storage.get(name)
        if kept is None or kept.start.size < room or kept.neighbor.size < places:
            kept = Pairs(np.empty(room, np.int64), np.empty(room, np.uint32), np.empty(places, np.uint32))
            self._storage[name] = kept
        return kept

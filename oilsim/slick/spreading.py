"""Spreading: parcels move down the gradient of thickness, as fast as Fay's laws let the front of their slick move.

Cells that touch form a slick. Its volume V, mean thickness h_m = 8/9 of the thickness that a volume element meets on average, radius
R = (V / (pi h_m))^(1/2), mean age, density and spreading tension give R dR/dt by `oilsim.slick.fay`. Each parcel then moves with

    u = -(M / 2) grad h^2,   M = (4/9) (R dR/dt) / h_m^2,

a nonlinear diffusion of the thickness, dh/dt = (M / 3) laplace h^3. Its self-similar solution, h = h_0 (1 - r^2 / R^2)^(1/2) with
h_0 = 3 V / (2 pi R^2), moves its front with exactly that R dR/dt (Barenblatt 1952; Pattle 1959), so the parcels follow Fay's
radius in every regime and keep its shape. In the gravity-viscous regime M does not depend on the slick as a whole: there the law is local.
Volume is carried by parcels and cannot change. The step is divided so that the diffusion stays stable.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, inlined
from oilsim.slick.fay import spreading_rate
from oilsim.slick.parcels import Parcels, Rows
from oilsim.slick.thickness_grid import AREA, EDGE, ThicknessGrid, build_grid, gather, spline, spline_slope

Array = NDArray[np.float64]

# [1] parcels in a cell, at the thickness that a volume element meets on average; tuned; fewer are noisy, more smooth the rim
PER_CELL = 9.0
# [1] largest M h^2 dt / cell^2 of one part of a step; measured; parcels of a slick begin to jitter from 0.5 on
STABLE = 0.25
# [1] parts of a step before the cells are made wider instead; numerical; bounds the cost of a step
MOST_PARTS = 4
# [1] h_m over the thickness that a volume element meets on average; theory; the profile (1 - r^2 / R^2)^(1/2)
MEAN_SHARE = 8.0 / 9.0


class Liquids(NamedTuple):
    """Numbers that spreading needs: density [kg/m3] and kinematic viscosity [m2/s] of the water."""

    water_density: float
    water_viscosity: float


@inlined
def find_root(parent, cell):
    """Return the first cell of the slick of `cell`, with paths in parent (C,) [-] made shorter."""
    while parent[cell] != cell:
        parent[cell] = parent[parent[cell]]
        cell = parent[cell]
    return cell


@inlined
def unite(parent, one, other):
    """Make two cells of parent (C,) [-] parts of one slick, known by the smaller number."""
    one, other = find_root(parent, one), find_root(parent, other)
    if one < other:
        parent[other] = one
    else:
        parent[one] = other


@njit(**FAST)
def join_cells(thickness, neighbor, parent):
    """Fill parent (C,) [-] so that cells of thickness (C,) [m] that touch have one root; neighbor (B, 2) slots of the next blocks."""
    for cell in range(thickness.shape[0]):
        parent[cell] = cell
    for cell in range(thickness.shape[0]):
        if thickness[cell] <= 0.0:
            continue
        slot, i, j = cell // AREA, (cell % AREA) // EDGE, cell % EDGE
        for axis in range(2):
            step, at_edge = (EDGE, i == EDGE - 1) if axis == 0 else (1, j == EDGE - 1)
            other = cell + step
            if at_edge:
                if neighbor[slot, axis] < 0:
                    continue
                other = neighbor[slot, axis] * AREA + (j if axis == 0 else i * EDGE)
            if thickness[other] > 0.0:
                unite(parent, cell, other)


@njit(**FAST)
def sum_slicks(columns, local, cells, parent, sums):
    """Add up each slick in sums (C, 5), by its root: volume [m3], and volume times thickness [m], density, tension and age.

    columns (N, 4): volume [m3], density [kg/m3], spreading tension [N/m], age [s]; local (N,) [m]; cells (N, 9); parent (C,).
    """
    for n in range(columns.shape[0]):
        root = find_root(parent, cells[n, 4])
        volume = columns[n, 0]
        sums[root, 0] += volume
        sums[root, 1] += volume * local[n]
        sums[root, 2] += volume * columns[n, 1]
        sums[root, 3] += volume * columns[n, 2]
        sums[root, 4] += volume * columns[n, 3]


@njit(**FAST)
def set_mobility(sums, liquids, mobility):
    """Fill mobility (C,) [1/(m s)] with M of each slick in sums (C, 5) [m3], and return the largest R dR/dt [m2/s]; 0 else."""
    fastest = 0.0
    for root in range(sums.shape[0]):
        mobility[root] = 0.0
        volume = sums[root, 0]
        if volume <= 0.0:
            continue
        mean = MEAN_SHARE * sums[root, 1] / volume
        radius = math.sqrt(volume / (math.pi * mean))
        buoyancy = 1.0 - sums[root, 2] / volume / liquids.water_density
        rate = spreading_rate(
            radius, sums[root, 4] / volume, volume, buoyancy, sums[root, 3] / volume,
            liquids.water_density, liquids.water_viscosity,
        )  # fmt: skip
        mobility[root] = 4.0 / 9.0 * rate / (mean * mean)
        fastest = max(fastest, rate)
    return fastest


@njit(**FAST)
def move_parcels(position, cell, cells, thickness, parent, mobility, time_step):
    """Move position (N, 2) [m] by -(M / 2) grad h^2 for `time_step` [s].

    cells (N, 9); thickness (C,) [m]; parent (C,); mobility (C,) [1/(m s)] by root.
    """
    for n in range(position.shape[0]):
        x, y = position[n, 0], position[n, 1]
        slope_x, slope_y = 0.0, 0.0
        for k in range(9):
            depth = thickness[cells[n, k]]
            square = depth * depth
            slope_x += spline_slope(x, cell, k // 3) * spline(y, cell, k % 3) * square
            slope_y += spline(x, cell, k // 3) * spline_slope(y, cell, k % 3) * square
        factor = -0.5 * mobility[find_root(parent, cells[n, 4])] * time_step
        position[n, 0] = x + factor * slope_x
        position[n, 1] = y + factor * slope_y


class _Measured(NamedTuple):
    grid: ThicknessGrid
    local: Array
    parent: Rows
    mobility: Array
    fastest: float


def _measure(position: Array, columns: Array, cell: float, liquids: Liquids) -> _Measured:
    grid = build_grid(position, columns[:, 0].copy(), cell)
    local = np.empty(len(position))
    gather(position, cell, grid.cells, grid.thickness, local)
    parent = np.empty(len(grid.thickness), np.int64)
    join_cells(grid.thickness, grid.neighbor, parent)
    sums, mobility = np.zeros((len(parent), 5)), np.empty(len(parent))
    sum_slicks(columns, local, grid.cells, parent, sums)
    return _Measured(grid, local, parent, mobility, set_mobility(sums, liquids, mobility))


def cell_size(volume: Array, thickness: Array) -> float:
    """Return the width of cells [m] that hold `PER_CELL` parcels of volume (N,) [m3] where the oil is; thickness (N,) [m]."""
    met = float((volume * thickness).sum() / volume.sum())
    return math.sqrt(PER_CELL * float(volume.mean()) / met)


def spread(parcels: Parcels, rows: Rows, duration: float, liquids: Liquids) -> Array:
    """Compute where the parcels of rows (M,) have spread to after `duration` [s]: (M, 2) [m]; their thickness is renewed.

    Raises ValueError for oil that is not lighter than the water.
    """
    position, columns = parcels.position[rows], _columns(parcels, rows)
    if columns[:, 1].max() >= liquids.water_density:
        raise ValueError(
            f"slick: an oil has a density of {columns[:, 1].max():g} kg/m3,"
            f" allowed: below that of the water, {liquids.water_density:g} kg/m3"
        )
    cell = cell_size(columns[:, 0], parcels.thickness[rows])
    measured = _measure(position, columns, cell, liquids)
    widest = math.sqrt(duration * measured.fastest / (STABLE * MOST_PARTS))
    if widest > cell:
        cell = widest
        measured = _measure(position, columns, cell, liquids)
    parts = max(1, math.ceil(duration * measured.fastest / (STABLE * cell * cell) - 1e-9))
    for part in range(parts):
        if part:
            columns[:, 3] += duration / parts
            measured = _measure(position, columns, cell, liquids)
        grid = measured.grid
        move_parcels(position, cell, grid.cells, grid.thickness, measured.parent, measured.mobility, duration / parts)
    parcels.thickness[rows] = measured.local
    return position


def _columns(parcels: Parcels, rows: Rows) -> Array:
    """Volume, density, spreading tension and age (M, 4) of the parcels of rows."""
    named = (parcels.volume, parcels.density, parcels.spreading_tension, parcels.age)
    return np.stack([column[rows] for column in named], axis=1)

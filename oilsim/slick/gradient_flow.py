"""Spreading: parcels move down the gradient of thickness, as fast as Fay's laws let the front of their slick move.

Cells that touch form a slick. Its volume V, mean thickness h_m = 8/9 of the thickness that a volume element meets on average, radius
R = (V / (pi h_m))^(1/2), mean age, density and spreading tension give R dR/dt by `fay`. Each parcel then moves with

    u = -(M / 2) grad h^2,   M = (4/9) (R dR/dt) / h_m^2,

a nonlinear diffusion of the thickness, dh/dt = (M / 3) laplace h^3. Its self-similar solution, h = h_0 (1 - r^2 / R^2)^(1/2) with
h_0 = 3 V / (2 pi R^2), moves its front with exactly that R dR/dt (Barenblatt 1952; Pattle 1959), so the parcels follow Fay's
radius in every regime and keep its shape. In the gravity-viscous regime M does not depend on the slick as a whole: there the law is local.
Volume is carried by parcels and cannot change. The step is divided so that the diffusion stays stable.

Disjoint sets of numbered nodes as a forest: every node points to another of its set, and the root to itself.

The root is the smallest number of its set. Sources: Galler and Fischer 1964; paths are halved on the way (van Leeuwen and Tarjan 1984).

Fay's three regimes of a slick that spreads on calm water, and how one becomes the next.

A slick of volume V spreads by gravity against inertia, then by gravity against the drag of the boundary layer below it, then by surface
tension against that drag (Fay 1971; Hoult 1972). From a point at time 0 its radius is

    gravity-inertia   R = 1.14 (D g V t^2)^(1/4)
    gravity-viscous   R = 0.98 (D g V^2 t^(3/2) / nu^(1/2))^(1/6)
    surface tension   R = 1.60 (sigma^2 t^3 / (rho^2 nu))^(1/4)

with D = 1 - density of oil / density of water, sigma [N/m] the spreading tension, rho [kg/m3] and nu [m2/s] of water. A slick in a run
does not begin as a point, meets others and is cut by booms. So each law is used as a speed of the front at the present radius, from the
balance of forces behind it, of which the law is the solution from a point:

    gravity-inertia   R dR/dt = 1.14^2 / 2 (D g V)^(1/2)
    gravity-viscous   R dR/dt = 0.98^6 / 4 D g V^2 t^(1/2) / (nu^(1/2) R^4)
    surface tension   R dR/dt = 1.60^2 3/4 sigma t^(1/2) / (rho nu^(1/2))

Join: of the two that resist gravity, the one that lets it spread more slowly counts; of the two that drive, the stronger one:
max(min(gravity-inertia, gravity-viscous), surface tension). Against the largest or smallest of the three laws, the radius is 5 % low where
the first two cross and 18 % high where the last two do; both differences fade as t^(-3/2). The film stops to spread at the area
1e5 V^(3/4) [m2, m3] (Fay 1971), where the oil has lost the parts that drive it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array
from oilsim.backend.jit import FAST, inlined
from oilsim.core.physical_constants import GRAVITY
from oilsim.slick.parcels import Parcels, Rows
from oilsim.slick.thickness_grid import AREA, EDGE, WIDTH, ThicknessGrid, build_grid, gather, spline_slopes, splines

# [1] coefficient of the radius in the regime of gravity and inertia; paper (Fay 1971, Hoult 1972); axisymmetric slick
INERTIAL = 1.14
# [1] coefficient of the radius in the regime of gravity and viscosity; paper (Fay 1971, Hoult 1972); axisymmetric slick
VISCOUS = 0.98
# [1] coefficient of the radius in the regime of surface tension; paper (Fay 1971, Hoult 1972); axisymmetric slick
TENSILE = 1.60
# [m^(-1/4)] final area over V^(3/4); paper (Fay 1971); the film ceases to spread there
FINAL_AREA = 1e5


def gravity_inertia_radius(time: float, volume: float, buoyancy: float) -> float:
    """Compute the radius [m] at `time` [s] of `volume` [m3] of oil with D = `buoyancy` [-], in gravity against inertia."""
    return INERTIAL * (buoyancy * GRAVITY * volume * time**2) ** 0.25


def gravity_viscous_radius(time: float, volume: float, buoyancy: float, water_viscosity: float) -> float:
    """Compute the radius [m] at `time` [s] of `volume` [m3] in gravity against drag; kinematic `water_viscosity` [m2/s]."""
    return VISCOUS * (buoyancy * GRAVITY * volume**2 * time**1.5 / math.sqrt(water_viscosity)) ** (1.0 / 6.0)


def surface_tension_radius(time: float, tension: float, water_density: float, water_viscosity: float) -> float:
    """Compute the radius [m] at `time` [s] under a spreading `tension` [N/m] against drag, in water of that density and viscosity."""
    return TENSILE * (tension**2 * time**3 / (water_density**2 * water_viscosity)) ** 0.25


def joined_radius(
    time: float, volume: float, buoyancy: float, tension: float, water_density: float, water_viscosity: float
) -> float:
    """Compute the radius [m] by which the three laws are usually drawn: max(min(first, second), third)."""
    inertial = gravity_inertia_radius(time, volume, buoyancy)
    viscous = gravity_viscous_radius(time, volume, buoyancy, water_viscosity)
    return max(min(inertial, viscous), surface_tension_radius(time, tension, water_density, water_viscosity))


def final_thickness(volume: Array) -> Array:
    """Compute the thickness [m] at which volumes (N,) [m3] of oil, each alone, cease to spread (Fay 1971): V / (1e5 V^(3/4))."""
    return np.asarray(volume**0.25 / FINAL_AREA)


@njit(**FAST)
def spreading_rate(radius, age, volume, buoyancy, tension, water_density, water_viscosity):
    """Compute R dR/dt [m2/s] of a slick of `radius` [m] and `volume` [m3] at its `age` [s]; 0 at its final area. See the module."""
    if math.pi * radius * radius >= FINAL_AREA * volume**0.75:
        return 0.0
    layer = math.sqrt(age / water_viscosity)  # 1 / [m/s]: time over thickness of the boundary layer
    inertial = 0.5 * INERTIAL**2 * math.sqrt(buoyancy * GRAVITY * volume)
    viscous = 0.25 * VISCOUS**6 * buoyancy * GRAVITY * volume * volume * layer / radius**4
    tensile = 0.75 * TENSILE**2 * tension / water_density * layer
    return max(min(inertial, viscous), tensile)


@inlined
def find(parent, node):
    """Return the root of a node by the indices in `parent` (nodes,) int32, halving the way there."""
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node


@inlined
def join(parent, a, b):
    """Put the nodes a and b under one root, the smaller of both; parent (nodes,) int32: index of each node's parent."""
    a, b = find(parent, a), find(parent, b)
    parent[max(a, b)] = min(a, b)


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


@njit(**FAST)
def join_cells(thickness, neighbor, parent):
    """Fill parent (C,) [-] so that cells of thickness (C,) [m] that touch have one root; neighbor (B, 2) slots of the next blocks."""
    for slot in range(neighbor.shape[0]):
        for i in range(1, EDGE + 1):
            for j in range(1, EDGE + 1):
                cell = slot * AREA + i * WIDTH + j
                parent[cell] = cell
    for slot in range(neighbor.shape[0]):
        for i in range(1, EDGE + 1):
            for j in range(1, EDGE + 1):
                cell = slot * AREA + i * WIDTH + j
                if thickness[cell] <= 0.0:
                    continue
                right = cell + WIDTH if i < EDGE else neighbor[slot, 0] * AREA + WIDTH + j
                above = cell + 1 if j < EDGE else neighbor[slot, 1] * AREA + i * WIDTH + 1
                if right >= 0 and thickness[right] > 0.0:
                    join(parent, cell, right)
                if above >= 0 and thickness[above] > 0.0:
                    join(parent, cell, above)


@njit(**FAST)
def number_slicks(thickness, parent, slick):
    """Fill slick (C,) [-] with the number of each cell's slick, from 0 on, and return how many there are.

    thickness (C,) [m]; parent (C,) [-], in which no root comes after a cell of its slick.
    """
    count = 0
    for slot in range(thickness.shape[0] // AREA):
        for i in range(1, EDGE + 1):
            for j in range(1, EDGE + 1):
                cell = slot * AREA + i * WIDTH + j
                if thickness[cell] <= 0.0:
                    continue
                root = find(parent, cell)
                slick[cell] = count if root == cell else slick[root]
                count += 1 if root == cell else 0
    return count


@njit(**FAST)
def sum_slicks(columns, local, cells, slick, sums):
    """Add up each slick in sums (K, 6): volume [m3], volume times thickness [m], density, tension and age, and parcels.

    columns (4, N): volume [m3], density [kg/m3], spreading tension [N/m], age [s]; local (N,) [m]; cells (N,); slick (C,).
    """
    for n in range(columns.shape[1]):
        number, volume = slick[cells[n]], columns[0, n]
        sums[number, 0] += volume
        sums[number, 1] += volume * local[n]
        for quantity in range(1, 4):
            sums[number, 1 + quantity] += volume * columns[quantity, n]
        sums[number, 5] += 1.0


@njit(**FAST)
def set_mobility(sums, liquids, mobility):
    """Fill mobility (K,) [1/(m s)] with M of each slick of sums (K, 6) [m3], and return the largest R dR/dt [m2/s].

    A single parcel is no slick: it has no gradient but that of the grid.
    """
    fastest = 0.0
    for number in range(sums.shape[0]):
        mobility[number] = 0.0
        if sums[number, 5] < 2.0:
            continue
        volume = sums[number, 0]
        mean = MEAN_SHARE * sums[number, 1] / volume
        radius = math.sqrt(volume / (math.pi * mean))
        buoyancy = 1.0 - sums[number, 2] / volume / liquids.water_density
        rate = spreading_rate(
            radius, sums[number, 4] / volume, volume, buoyancy, sums[number, 3] / volume,
            liquids.water_density, liquids.water_viscosity,
        )  # fmt: skip
        mobility[number] = 4.0 / 9.0 * rate / (mean * mean)
        fastest = max(fastest, rate)
    return fastest


@njit(**FAST)
def move_parcels(position, cell, cells, thickness, slick, mobility, time_step):
    """Move position (N, 2) [m] by -(M / 2) grad h^2 for `time_step` [s].

    cells (N,); thickness (C,) [m]; slick (C,); mobility (K,) [1/(m s)] by slick.
    """
    for n in range(position.shape[0]):
        x, y = position[n, 0], position[n, 1]
        weight_x, weight_y = splines(x, cell), splines(y, cell)
        change_x, change_y = spline_slopes(x, cell), spline_slopes(y, cell)
        slope_x, slope_y, corner = 0.0, 0.0, cells[n] - WIDTH - 1
        for a in range(3):
            for b in range(3):
                depth = thickness[corner + a * WIDTH + b]
                slope_x += change_x[a] * weight_y[b] * depth * depth
                slope_y += weight_x[a] * change_y[b] * depth * depth
        factor = -0.5 * mobility[slick[cells[n]]] * time_step
        position[n, 0] = x + factor * slope_x
        position[n, 1] = y + factor * slope_y


class _Measured(NamedTuple):
    grid: ThicknessGrid
    local: Array
    slick: Rows
    mobility: Array
    fastest: float


def _measure(position: Array, columns: Array, cell: float, liquids: Liquids) -> _Measured:
    grid = build_grid(position, columns[0], cell)
    local = np.empty(len(position))
    gather(position, cell, grid.cells, grid.thickness, local)
    parent = np.empty(len(grid.thickness), np.int64)
    join_cells(grid.thickness, grid.neighbor, parent)
    slick = np.empty(len(grid.thickness), np.int64)
    count = number_slicks(grid.thickness, parent, slick)
    sums, mobility = np.zeros((count, 6)), np.empty(count)
    sum_slicks(columns, local, grid.cells, slick, sums)
    return _Measured(grid, local, slick, mobility, set_mobility(sums, liquids, mobility))


def cell_size(volume: Array, thickness: Array) -> float:
    """Return the width of cells [m] that hold `PER_CELL` parcels of volume (N,) [m3] where the oil is; thickness (N,) [m].

    Scattered parcels count as thick as each would be by itself at last. Else they would widen their cells without end.
    """
    met = float((volume * np.maximum(thickness, final_thickness(volume))).sum() / volume.sum())
    return math.sqrt(PER_CELL * float(volume.mean()) / met)


def spread(parcels: Parcels, rows: Rows, duration: float, liquids: Liquids) -> Array:
    """Compute where the parcels of rows (M,) have spread to after `duration` [s]: (M, 2) [m]; their thickness is renewed.

    No parcel gets thinner than oil of its volume would by itself: a film that is torn apart lies in patches. This is a lower bound. A whole
    slick ceases to spread while it is thicker. The more parcels it has, the lower the bound lies.

    Raises ValueError for oil that is not lighter than the water.
    """
    position, columns = parcels.position_of(rows), _columns(parcels, rows)
    if columns[1].max() >= liquids.water_density:
        raise ValueError(
            f"slick: an oil has a density of {columns[1].max():g} kg/m3,"
            f" allowed: below that of the water, {liquids.water_density:g} kg/m3"
        )
    cell = cell_size(columns[0], parcels.thickness[rows])
    measured = _measure(position, columns, cell, liquids)
    widest = math.sqrt(duration * measured.fastest / (STABLE * MOST_PARTS))
    if widest > cell:
        cell = widest
        measured = _measure(position, columns, cell, liquids)
    parts = max(1, math.ceil(duration * measured.fastest / (STABLE * cell * cell) - 1e-9))
    for part in range(parts):
        if part:
            columns[3] += duration / parts
            measured = _measure(position, columns, cell, liquids)
        grid = measured.grid
        move_parcels(position, cell, grid.cells, grid.thickness, measured.slick, measured.mobility, duration / parts)
    parcels.thickness[rows] = np.maximum(measured.local, final_thickness(columns[0]))
    return position


def _columns(parcels: Parcels, rows: Rows) -> Array:
    """Volume, density, spreading tension and age (4, M) of the parcels of rows."""
    named = (parcels.volume, parcels.density, parcels.spreading_tension, parcels.age)
    return np.stack([column[rows] for column in named])

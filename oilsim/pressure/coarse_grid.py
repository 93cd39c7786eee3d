"""Pressure on a coarse grid, for the compression that whole regions of liquid have in common.

Conjugate residuals soon repair the compression of single particles. The rest is then spread evenly over the liquid: after six products of a
wave's solve seven tenths of it are the same over eight spacings. That drives waves and keeps still water moving. On nodes CELL spacings
apart, with trilinear shares phi_I,

    K = P^T A P,     P_iI = phi_I(x_i),     (H P c)_i = grad c + n_i c,     n = H 1, 0 but at free surfaces,

is close to the matrix of a grid of resistors. Its cells conduct along their edges with the sum of rho_ref / rho_0 of their particles, and
its nodes leak the sum of rho_ref / rho_0 |n|^2 phi. The solve takes D^-1 + P K^-1 P^T in place of D^-1, the additive two-level
preconditioner (Smith, Bjorstad and Gropp 1996, 2.1). The response of moving bodies is not in it. Liquid that fills a closed box goes
without the grid, which spares nothing there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array, Index, Ints, Real
from oilsim.backend.jit import FAST, ONE, ZERO, inlined
from oilsim.backend.thread_team import BLOCK, Team
from oilsim.core.config import FluidConfig
from oilsim.neighborhood.cell_grid import find_extent

# [d] edge of a cell; measured; 2 to 8 do as well
CELL = 4
# [1] share of the residual that the grid's own solve leaves; measured; with 0.1 a solve for 1e-6 takes three times the products
LEFT = 0.01
# [1] iterations of the grid's own solve at most; numerical; not on record
ROUNDS = 200
# [1] parts of the particles with sums of their own, at most; numerical; as many on any number of threads, so that bits are the same
PARTS = 16


class GridPlaces(NamedTuple):
    """The places of particles on the grid.

    cell (N,)            number of the particle's cell
    share (3, N)         place in the cell along each axis, as a share of the edge [1]
    corners (C, 8)       numbers of the nodes at the corners of each cell
    """

    cell: Index
    share: Real
    corners: Index


class Resistors(NamedTuple):
    """The matrix K of the grid.

    other (nodes, 3)     number of the next node along each axis
    wires (nodes, 3)     conductance to it [1/m2]
    leak (nodes,)        conductance to earth [1/m2]
    diagonal (nodes,)    that of K [1/m2]
    """

    other: Index
    wires: Array
    leak: Array
    diagonal: Array


@njit(**FAST)
def locate(begin, end, position, lower, inverse, first, cells, cell, share):
    """Find the cell of each particle and its place there.

    position (3, N)       places [m]
    lower (3,)            corner of the domain [m]
    inverse (3,)          inverse of a cell's edges [1/m], 0 along an axis that is absent
    first, cells (3,)     first cell that is counted along each axis, and number of these cells
    cell (N,)             becomes the index of the cell among those counted
    share (3, N)          becomes the place in the cell along each axis, as a share of the edge [1]
    """
    for i in range(begin, end):
        index = np.int64(0)
        for axis in range(3):
            along = (position[axis, i] - lower[axis]) * inverse[axis]
            last = first[axis] + cells[axis] - 1
            k = max(min(np.int64(along), last), first[axis])  # particles outside the domain, or not finite, too
            share[axis, i] = max(min(along - np.float32(k), ONE), ZERO)
            index = index * cells[axis] + k - first[axis]
        cell[i] = index


@njit(**FAST)
def occupy(points, cells, turns, cell, number, name, content, corners):
    """Assign numbers to the cells that hold particles and to their corners, by order of appearance; return how many of each there are.

    points (M, 4)         places [m] and weights rho_ref / rho_0 [1] of the particles
    cells (3,)            number of cells along each axis
    turns (3,)            nodes after which an axis begins again
    cell (N,)             index of each particle's cell, becomes the cell's number
    number, name          -1 for each cell and each node there is, become their numbers
    content (cells,)      becomes the sum of the weights of a cell's particles [1]
    corners (cells, 8)    become the numbers of the nodes at a cell's corners
    """
    found = nodes = 0
    for i in range(cell.size):
        at = cell[i]
        if number[at] < 0:
            x, y, z = at // (cells[1] * cells[2]), at // cells[2] % cells[1], at % cells[2]
            for corner in range(8):
                a, b, c = x + (corner >> 2), y + (corner >> 1 & 1), z + (corner & 1)
                node = (a % turns[0] * turns[1] + b % turns[1]) * turns[2] + c % turns[2]
                if name[node] < 0:
                    name[node] = nodes
                    nodes += 1
                corners[found, corner] = name[node]
            content[found] = 0.0
            number[at] = found
            found += 1
        cell[i] = number[at]
        content[cell[i]] += points[i, 3]
    return found, nodes


@njit(**FAST)
def restrict(begin, end, length, places, values, free, sums):
    """Fill the rows begin to end of sums (parts, nodes) with P^T F values of the parts, of `length` particles each.

    places: `GridPlaces`; values (N,), in the unit of the sums; free (N,): F, 1 in the free set and 0 elsewhere [1].
    """
    cell, share, corners = places
    for part in range(begin, end):
        node = sums[part]
        node[:] = 0.0
        for i in range(part * length, min((part + 1) * length, cell.size)):
            x, y, z, value = share[0, i], share[1, i], share[2, i], values[i] * free[i]
            c, left, right = corners[cell[i]], (ONE - x) * value, x * value
            node[c[0]] += left * (ONE - y) * (ONE - z)
            node[c[1]] += left * (ONE - y) * z
            node[c[2]] += left * y * (ONE - z)
            node[c[3]] += left * y * z
            node[c[4]] += right * (ONE - y) * (ONE - z)
            node[c[5]] += right * (ONE - y) * z
            node[c[6]] += right * y * (ONE - z)
            node[c[7]] += right * y * z


@njit(**FAST)
def prolong(begin, end, places, node, free, values):
    """Add F P node to values (N,), in their unit.

    places: `GridPlaces`; node (nodes,): value of each node; free (N,): F, 1 in the free set and 0 elsewhere [1].
    """
    cell, share, corners = places
    for i in range(begin, end):
        x, y, z, c = share[0, i], share[1, i], share[2, i], corners[cell[i]]
        left = (ONE - y) * ((ONE - z) * node[c[0]] + z * node[c[1]]) + y * ((ONE - z) * node[c[2]] + z * node[c[3]])
        right = (ONE - y) * ((ONE - z) * node[c[4]] + z * node[c[5]]) + y * ((ONE - z) * node[c[6]] + z * node[c[7]])
        values[i] += free[i] * np.float32((ONE - x) * left + x * right)


@njit(**FAST)
def wire(corners, content, conductance, other, wires):
    """Add up the conductances of the cells' edges.

    corners (cells, 8)    numbers of the nodes at each cell's corners
    content (cells,)      sum of the weights of each cell's particles [1]
    conductance (3,)      conductance of one edge along each axis for a content of 1 [1/m2]
    other (nodes, 3)      becomes the number of the next node along each axis
    wires (nodes, 3)      conductance to it, to which the cells' parts are added [1/m2]
    """
    for cell in range(corners.shape[0]):
        for axis in range(3):
            ahead = 4 >> axis
            for corner in range(8):
                if corner & ahead == 0:
                    node = corners[cell, corner]
                    other[node, axis] = corners[cell, corner | ahead]
                    wires[node, axis] += content[cell] * conductance[axis]


@inlined
def conduct(resistors, potential, current):
    """Set current (nodes,) [1/s] to K potential; potential (nodes,) [m2/s]; resistors: `Resistors`."""
    other, wires, leak, _ = resistors
    for n in range(leak.size):
        current[n] = leak[n] * potential[n]
    for n in range(leak.size):
        for axis in range(3):
            m = other[n, axis]
            flow = wires[n, axis] * (potential[n] - potential[m])
            current[n] += flow
            current[m] -= flow


@njit(**FAST)
def solve_grid(resistors, residual, left, rounds, solution, direction, image):
    """Solve K solution = residual by conjugate gradients with the diagonal as preconditioner (Jacobi).

    resistors             `Resistors`
    residual (nodes,)     right side, becomes the residual that is left
    left                  share of the residual's norm in D^-1 at which the solve ends [1]
    rounds                iterations at most
    solution (nodes,)     becomes the solution
    direction, image      (nodes,), room for the search direction and its product
    """
    leak, diagonal = resistors.leak, resistors.diagonal
    square = 0.0
    for n in range(leak.size):
        solution[n], direction[n] = 0.0, residual[n] / diagonal[n]
        square += residual[n] * direction[n]
    limit = left * left * square
    for _ in range(rounds):
        if not square > limit:
            break
        conduct(resistors, direction, image)
        curvature = 0.0
        for n in range(leak.size):
            curvature += direction[n] * image[n]
        length, before, square = square / curvature, square, 0.0
        for n in range(leak.size):
            solution[n] += length * direction[n]
            residual[n] -= length * image[n]
            square += residual[n] * residual[n] / diagonal[n]
        for n in range(leak.size):
            direction[n] = residual[n] / diagonal[n] + square / before * direction[n]


class CoarsePressure:
    """The coarse grid of a fluid. Every pressure solve lays it anew over the cells that hold liquid."""

    def __init__(self, config: FluidConfig, team: Team) -> None:
        self._team = team
        extent = np.subtract(config.upper, config.lower)
        lies = np.array([True, config.dimension == 3, True])  # along which axes there is anything
        edge = np.full(3, CELL * config.particle_spacing)
        self._cells = np.where(lies, np.maximum(np.ceil(extent / edge), 1), 1).astype(np.int64)
        edge = np.where(config.periodic, extent / self._cells, edge)
        self._repeats = np.array(config.periodic)
        self._ends = np.where(np.logical_or(config.periodic, ~lies), 0, 1)  # nodes beyond the last cell's
        self._inverse = np.where(lies, 1.0 / edge, 0.0).astype(np.float32)
        self._conductance = 0.25 * self._inverse.astype(np.float64) ** 2  # four edges share a cell's content
        self._lower = np.array(config.lower, np.float32)

    def lay(self, position: Real, points: Real, openness: Real) -> None:
        """Lay the grid over particles at `position` (3, N) [m].

        points (M, 4), M >= N: places [m] and weights rho_ref / rho_0 [1]; openness (M,): rho_ref / rho_0 |H 1|^2 [1/m2].
        """
        count = position.shape[1]
        cell, share = np.empty(count, np.uint32), np.empty((3, count), np.float32)
        first, cells = self._taken_up(position)
        self._team.run(locate, count, position, self._lower, self._inverse, first, cells, cell, share)
        turns, most = cells + self._ends, min(count, int(cells.prod()))
        number, name = np.full(int(cells.prod()), -1), np.full(int(turns.prod()), -1)
        content, corners = np.empty(most), np.empty((most, 8), np.uint32)
        found, nodes = occupy(points, cells, turns, cell, number, name, content, corners)
        self._places = GridPlaces(cell, share, corners[:found])
        self._length = BLOCK * max(-(-count // (BLOCK * PARTS)), 1)
        self._sums = np.empty((-(-count // self._length), nodes))
        leak = self._restrict(openness, np.ones(count, np.float32))
        other, wires = np.zeros((nodes, 3), np.uint32), np.zeros((nodes, 3))
        wire(corners[:found], content[:found], self._conductance, other, wires)
        into = np.bincount(other.ravel(), wires.ravel(), nodes)
        self._resistors = Resistors(other, wires, leak, leak + wires.sum(axis=1) + into)

    def _taken_up(self, position: Real) -> tuple[Ints, Ints]:
        """Return the first cell with a particle along each axis (3,) and the number of cells to the last (3,); all where it repeats."""
        low, high = np.empty((2, 3), np.int64)
        find_extent(position, position.shape[1], self._lower, self._inverse, self._cells, low, high)
        return np.where(self._repeats, 0, low), np.where(self._repeats, self._cells, high - low + 1)

    def correct(self, residual: Real, free: Real, correction: Real) -> None:
        """Add F P K^-1 P^T F residual to correction (N,) [m2/s]; residual (N,) [1/s], free (N,): F, 1 in the free set and 0 elsewhere."""
        right = self._restrict(residual, free)
        node, direction, image = np.empty((3, right.size))
        solve_grid(self._resistors, right, LEFT, ROUNDS, node, direction, image)
        self._team.run(prolong, len(self._places.cell), self._places, node, free, correction)

    def _restrict(self, values: Real, free: Real) -> Array:
        """Return P^T F values (nodes,)."""
        self._team.run_parts(restrict, len(self._sums), self._length, self._places, values, free, self._sums)
        return np.asarray(self._sums.sum(axis=0))

"""Pressure on a coarse grid, for the compression that whole regions of liquid have in common.

Conjugate residuals soon mend what compresses particles each by itself. What they leave is then spread evenly over the liquid: after six
products of a wave's solve seven tenths of it were the same over eight spacings, and that is what drives waves and lets still water move. On
nodes CELL spacings apart, with trilinear shares phi_I,

    K = P^T A P,     P_iI = phi_I(x_i),     (H P c)_i = grad c + n_i c,     n = H 1, 0 but at free surfaces,

is close to what a grid of resistors has, of which cells conduct along their edges with the sum of rho_ref / rho_0 of their particles, and
nodes leak the sum of rho_ref / rho_0 |n|^2 phi. In place of D^-1 the solve takes D^-1 + P K^-1 P^T, the additive two-level preconditioner
(Smith, Bjorstad & Gropp 1996, 2.1). What moving bodies answer is not in it. Liquid that fills a closed box goes without: there it spares
nothing.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.thread_team import BLOCK, Team
from oilsim.config import FluidConfig
from oilsim.neighborhood.cell_grid import find_extent

Real = NDArray[np.float32]
Double = NDArray[np.float64]

CELL = 4  # spacings: 2 to 8 do as well
LEFT = 0.01  # of the residual, by the grid's own solve: with 0.1 long solves, for a tolerance of 1e-6, take three times the products
ROUNDS = 200  # of it at most
PARTS = 16  # at most, of the particles, with sums of their own: as many on any number of threads
ZERO, ONE = np.float32(0.0), np.float32(1.0)


@njit(**FAST)
def locate(begin, end, position, lower, inverse, first, cells, cell, share):
    """The cell of each particle and its place there, share (3, N) of an edge; inverse (3,) of the edges [1/m], 0 along none.

    Cells are counted along each axis from `first` on, as many as `cells`.
    """
    for i in range(begin, end):
        index = np.int64(0)
        for axis in range(3):
            along = (position[axis, i] - lower[axis]) * inverse[axis]
            last = first[axis] + cells[axis] - 1
            k = max(min(np.int64(along), last), first[axis])  # of what has left the domain, too, or blown up
            share[axis, i] = max(min(along - np.float32(k), ONE), ZERO)
            index = index * cells[axis] + k - first[axis]
        cell[i] = index


@njit(**FAST)
def occupy(points, cells, turns, cell, number, name, content, corners):
    """Number the cells that hold particles, and their corners, in the order in which they appear; returns how many there are of both.

    `cell` (N,) becomes that number, content (cells,) the sum of the particles' weights, points[:, 3], corners (cells, 8) those of nodes;
    turns (3,): nodes after which an axis begins again; `number` of each cell and `name` of each node there is: -1.
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
def restrict(begin, end, length, cell, share, corners, values, face, sums):
    """sums[part] (nodes,) = P^T F values of parts begin to end, `length` particles each."""
    for part in range(begin, end):
        node = sums[part]
        node[:] = 0.0
        for i in range(part * length, min((part + 1) * length, cell.size)):
            x, y, z, value = share[0, i], share[1, i], share[2, i], values[i] * face[i]
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
def prolong(begin, end, cell, share, corners, node, face, values):
    """values += F P node."""
    for i in range(begin, end):
        x, y, z, c = share[0, i], share[1, i], share[2, i], corners[cell[i]]
        left = (ONE - y) * ((ONE - z) * node[c[0]] + z * node[c[1]]) + y * ((ONE - z) * node[c[2]] + z * node[c[3]])
        right = (ONE - y) * ((ONE - z) * node[c[4]] + z * node[c[5]]) + y * ((ONE - z) * node[c[6]] + z * node[c[7]])
        values[i] += face[i] * np.float32((ONE - x) * left + x * right)


@njit(**FAST)
def wire(corners, content, conductance, other, wires):
    """Add to wires (nodes, 3) what cells conduct along their edges, to the next node along each axis, other (nodes, 3).

    conductance (3,) [1/m2] of one edge for a content of 1.
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
def conduct(other, wires, leak, potential, current):
    """current = K potential."""
    for n in range(leak.size):
        current[n] = leak[n] * potential[n]
    for n in range(leak.size):
        for axis in range(3):
            m = other[n, axis]
            flow = wires[n, axis] * (potential[n] - potential[m])
            current[n] += flow
            current[m] -= flow


@njit(**FAST)
def solve_grid(other, wires, leak, diagonal, residual, left, rounds, solution, direction, image):
    """solution = K^-1 residual by conjugate gradients (Jacobi), until `left` of the residual's norm in D^-1 is left of it."""
    square = 0.0
    for n in range(leak.size):
        solution[n], direction[n] = 0.0, residual[n] / diagonal[n]
        square += residual[n] * direction[n]
    limit = left * left * square
    for _ in range(rounds):
        if not square > limit:
            break
        conduct(other, wires, leak, direction, image)
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
    """A grid over what of a domain a fluid takes up; every pressure solve lays it anew over the cells that hold liquid."""

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

        points (M, 4): behind the places the weights rho_ref / rho_0; openness (M,): weight |H 1|^2 [1/m2]; M >= N.
        """
        count = position.shape[1]
        self._cell = np.empty(count, np.uint32)
        self._share = np.empty((3, count), np.float32)
        first, cells = self._taken_up(position)
        self._team.run(locate, count, position, self._lower, self._inverse, first, cells, self._cell, self._share)
        turns, most = cells + self._ends, min(count, int(cells.prod()))
        number, name = np.full(int(cells.prod()), -1), np.full(int(turns.prod()), -1)
        content, corners = np.empty(most), np.empty((most, 8), np.uint32)
        found, nodes = occupy(points, cells, turns, self._cell, number, name, content, corners)
        self._corners = corners[:found]
        self._length = BLOCK * max(-(-count // (BLOCK * PARTS)), 1)
        self._sums = np.empty((-(-count // self._length), nodes))
        self._leak = self._restrict(openness, np.ones(count, np.float32))
        self._other, self._wires = np.zeros((nodes, 3), np.uint32), np.zeros((nodes, 3))
        wire(self._corners, content[:found], self._conductance, self._other, self._wires)
        into = np.bincount(self._other.ravel(), self._wires.ravel(), nodes)
        self._diagonal = self._leak + self._wires.sum(axis=1) + into

    def _taken_up(self, position: Real) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The first cell with a particle along each axis and the number of cells to the last one; of axes that repeat all."""
        low, high = np.empty((2, 3), np.int64)
        find_extent(position, position.shape[1], self._lower, self._inverse, self._cells, low, high)
        return np.where(self._repeats, 0, low), np.where(self._repeats, self._cells, high - low + 1)

    def correct(self, residual: Real, face: Real, correction: Real) -> None:
        """correction += F P K^-1 P^T F residual; F: `face`, 1 or 0 for each particle."""
        right = self._restrict(residual, face)
        node, direction, image = np.empty((3, right.size))
        solve_grid(self._other, self._wires, self._leak, self._diagonal, right, LEFT, ROUNDS, node, direction, image)
        self._team.run(prolong, len(self._cell), self._cell, self._share, self._corners, node, face, correction)

    def _restrict(self, values: Real, face: Real) -> Double:
        """P^T F values."""
        self._team.run_parts(
            restrict, len(self._sums), self._length, self._cell, self._share, self._corners, values, face, self._sums
        )
        return np.asarray(self._sums.sum(axis=0))

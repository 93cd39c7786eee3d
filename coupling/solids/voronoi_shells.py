"""Shares a solid out among its wall particles: shells one spacing d thick, cut into cells of the nearest point.

    shell 1   depth 0 to d, shared out among the outer layer of points
    shell 2   depth d to 2 d, shared out among the inner layer; among the outer one if the solid is too thin for two

A point's volume is that of its cell and its place the cell's centroid, so that sum V = volume and sum V x = integral of x: shells
of a ball shrink with depth and those of a hollow grow, and edges and corners count with all that lies behind them. On a flat
wall and in a box this is the lattice of liquid, continued, and nothing is left to be fitted. Deeper than 2 d no kernel
reaches.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

from oilsim.backend.arrays import Array, Flags, Ints

STEP = 0.2  # lattice step of quadratures, in particle spacings
INNER_REACH = 1.5  # spacings from an inner point beyond which a thin rest of shell 2 counts to the outer layer


class Solid(Protocol):
    """A signed distance field."""

    def lattice(self, step: float, low: float, high: float) -> tuple[Array, Array]:
        """Return the lattice points (K, 3) [m], `step` [m] apart, with low <= phi <= high [m], and phi (K,) [m] there."""


class Shells:
    """Quadrature cells of a solid down to 2 d.

    Attributes:
        center: (K, 3) [m].
        phi: (K,) signed distance [m].
        outer, inner: (K,) share of each cell in shell 1 and in shell 2: a cell that a shell's face cuts counts to both.
        cell_volume: [m3].
    """

    def __init__(self, solid: Solid, spacing: float) -> None:
        step = STEP * spacing
        self.center, self.phi = solid.lattice(step, -2.0 * spacing - 0.5 * step, 0.5 * step)
        deeper = [np.clip(0.5 - (self.phi + n * spacing) / step, 0.0, 1.0) for n in range(3)]
        self.outer, self.inner = deeper[0] - deeper[1], deeper[1] - deeper[2]
        self.cell_volume = step**3
        near, deep = self.outer > 0.0, self.inner > 0.0
        self._reach = INNER_REACH * spacing
        self._near, self._deep = self.center[near], self.center[deep]
        self._place = np.concatenate([self._near, self._deep])
        self._volume = self.cell_volume * np.concatenate([self.outer[near], self.inner[deep]])

    def settle(self, outer: Array, inner: Array, held: Flags, rounds: int) -> tuple[Array, Array, Array]:
        """Move outer (N, 3) and inner (K, 3) points [m] to their cells' centroids `rounds` times, but for `held` outer ones.

        Returns outer points, inner points and the volumes of their cells (N + K,) [m3], outer ones first.
        """
        points, count = np.concatenate([outer, inner]), len(outer)
        free = np.concatenate([~held, np.ones(len(inner), dtype=bool)])
        for _ in range(rounds):
            owner = self._owners(points[:count], points[count:])
            volume = np.bincount(owner, self._volume, len(points))
            moment = [np.bincount(owner, self._volume * self._place[:, axis], len(points)) for axis in range(3)]
            moves = free & (volume > 0.0)
            points[moves] = np.stack(moment, axis=1)[moves] / volume[moves, None]
        owner = self._owners(points[:count], points[count:])
        volumes: Array = np.bincount(owner, self._volume, len(points)).astype(np.float64)
        return points[:count], points[count:], volumes

    def _owners(self, outer: Array, inner: Array) -> Ints:
        """Return the index, outer points first, of the point to which each part of a cell belongs: of shell 1, then of shell 2."""
        tree = cKDTree(outer)
        first = tree.query(self._near, workers=-1)[1]
        if len(inner) == 0:
            return np.concatenate([first, tree.query(self._deep, workers=-1)[1]])
        gap, second = cKDTree(inner).query(self._deep, workers=-1)
        second += len(outer)
        rest = gap > self._reach
        second[rest] = tree.query(self._deep[rest], workers=-1)[1]
        return np.concatenate([first, second])

"""A current that runs along land: at each place a linear answer to the current far out.

With the surface level and no friction, the depth-averaged stream U of water of depth h is the gradient of a potential,

    div(h grad phi) = 0,   n . grad phi = 0 at the land,   U -> U_far far out

(Batchelor 1967, section 6.2, with h in the place of a constant depth). It is linear in U_far, so two solutions, for a unit current along x
and along y, tell that of any current at any time: U(x, t) = K(x) U_far(t), with the solutions' gradients as the columns of K. It has no
eddies behind headlands, and a tide turns everywhere at once (*modelled*).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Double = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Stream:
    """K on a grid of square cells; beyond the grid it is 1.

    lower     (2,) [m] the grid's corner
    spacing   [m] of its cells
    response  (N, M, 2, 2) [1] K at the middles of cells
    openness  (N, M) [1] share of a cell that is water, by which neighbours are weighed between middles; 0 on land, where nothing runs
    """

    lower: Double
    spacing: float
    response: Double
    openness: Double

    def at(self, places: Double) -> Double:
        """Return K (P, 2, 2) [1] at places (P, 2) [m]: bilinear between the middles of cells that have water."""
        shape = np.array(self.openness.shape)
        cell = (places[:, :2] - self.lower) / self.spacing - 0.5
        inside = ((cell > -0.5) & (cell < shape - 0.5)).all(axis=1)
        found = np.tile(np.eye(2), (len(places), 1, 1))
        cell = cell[inside]
        low = np.floor(cell).astype(int)
        share = cell - low
        total, weight = np.zeros((len(cell), 2, 2)), np.zeros(len(cell))
        for i in (0, 1):
            for j in (0, 1):
                x, y = np.clip(low + np.array([i, j]), 0, shape - 1).T
                own = np.abs(1 - i - share[:, 0]) * np.abs(1 - j - share[:, 1]) * self.openness[x, y]
                total += own[:, None, None] * self.response[x, y]
                weight += own
        found[inside] = total / np.maximum(weight, np.finfo(float).tiny)[:, None, None]
        return found

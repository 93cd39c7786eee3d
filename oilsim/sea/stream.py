"""A current that differs from place to place: along land, as a linear answer to the current far out, or from a table on a grid.

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

    def current(self, far: Double, places: Double, time: float) -> Double:
        """Return the current (P, 2) [m/s] at places (P, 2) [m] for one of `far` (2,) [m/s] far out, or its rate [m/s2] for a rate."""
        return self.at(places) @ far

    current_rate = current

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


@dataclass(frozen=True, eq=False)
class StreamTable:
    """A current from a table of times on a grid with axes of its own, as longitude and latitude.

    time    (T,) [s], rising
    axes    (N,), (M,) rising places of the grid's lines along its axes, in their unit
    origin  (2,) where the world's origin lies on the axes
    turn    (2, 2) [unit/m] what a way in the world is along the axes
    values  (T, N, M, 2) [m/s] in the world where the lines cross; NaN: no water, at this or another time
    It is bilinear between crossings that have water, linear between times, and beyond the grid as at its edge.
    """

    time: Double
    axes: tuple[Double, Double]
    origin: Double
    turn: Double
    values: Double

    def current(self, far: Double, places: Double, time: float) -> Double:
        """Return the current (P, 2) [m/s] at places (P, 2) [m]; `far` (2,) [m/s]: that at the origin."""
        row, step = self._row(time)
        share = (time - self.time[row]) / step
        return far + self._difference(places, row, 1.0 - share, share)

    def current_rate(self, far: Double, places: Double, time: float) -> Double:
        """Return its rate (P, 2) [m/s2]; `far` (2,) [m/s2]: that at the origin."""
        row, step = self._row(time)
        return far + self._difference(places, row, -1.0 / step, 1.0 / step)

    def at_origin(self) -> Double:
        """Return the currents (T, 2) [m/s] at the origin; NaN where there is no water."""
        return np.array([self._at(np.zeros((1, 2)), values)[0] for values in self.values])

    def _row(self, time: float) -> tuple[int, float]:
        """Return the row before a time, and the interval [s] that follows it."""
        row = int(np.clip(np.searchsorted(self.time, time, "right") - 1, 0, self.time.size - 2))
        return row, float(self.time[row + 1] - self.time[row])

    def _difference(self, places: Double, row: int, before: float, after: float) -> Double:
        """Return the differences (P, 2) of a row and the next one, with their weights, to those at the origin."""
        found = self._at(
            np.vstack([places[:, :2], np.zeros(2)]), before * self.values[row] + after * self.values[row + 1]
        )
        return np.nan_to_num(found[:-1]) - found[-1]

    def _at(self, places: Double, values: Double) -> Double:
        """Return values (N, M, 2) of the crossings at places (P, 2) [m]; NaN where no crossing around has water."""
        along = self.origin + places @ self.turn.T
        cells = [np.interp(along[:, k], axis, np.arange(axis.size)) for k, axis in enumerate(self.axes)]
        low = [np.minimum(cell.astype(int), axis.size - 2) for cell, axis in zip(cells, self.axes, strict=True)]
        total, weight = np.zeros((len(places), 2)), np.zeros(len(places))
        for i in (0, 1):
            for j in (0, 1):
                one = values[low[0] + i, low[1] + j]
                own = (
                    np.abs(1 - i - (cells[0] - low[0]))
                    * np.abs(1 - j - (cells[1] - low[1]))
                    * np.isfinite(one).all(axis=1)
                )
                total += own[:, None] * np.nan_to_num(one)
                weight += own
        with np.errstate(invalid="ignore"):
            return np.asarray(total / weight[:, None])

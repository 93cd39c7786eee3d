"""What the pressure will be, before it is solved for: the weight of a column goes with its stretch.

In waves longer than the liquid is deep a particle carries the weight above it. A flow that draws a column out lifts its particles, and the
weight above each of them grows alike,

    (1 / p) Dp/Dt = dw/dz,

w the velocity against gravity. (In short waves a particle keeps its pressure.) So the pressure solve begins with what it found in the last
step times 1 + dt dw/dz, the slope of the straight line through the velocities of a column, weighted with the pressures; columns are as wide
as they are high and overlap, each reaching to its neighbours' middles.

A solve ends at a tolerance. One that begins with the old pressure lets a slow wave's change pile up over several steps until it is worth a
product, so that pressure follows the wave late and feeds it: a wave in a basin of ten layers, twice as long, grew by a half in half a
minute with a tolerance of 7e-4. Now it loses as much as with 1e-5.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.compilation import FAST, INLINED
from oilsim.config import FluidConfig
from oilsim.parallel import Team

Real = NDArray[np.float32]
Double = NDArray[np.float64]

WIDTH = 1.0  # depths, of a column: in shorter waves particles keep their pressure, in deep water altogether
NARROWEST = 2.0  # supports
ZERO, ONE = np.float32(0.0), np.float32(1.0)
MOST = np.float32(0.5)  # by which a pressure may change: what is torn apart in a step is no column


@njit(**INLINED)
def place(i, position, axis, last):
    """The column before a particle along an axis (4: direction over width, offset), `last` at most, and how far it is to the next one."""
    along = axis[0] * position[0, i] + axis[1] * position[1, i] + axis[2] * position[2, i] - axis[3]
    column = max(min(np.int64(along), last), np.int64(0))  # of what has left the domain, too, or blown up
    return column, max(min(along - np.float32(column), ONE), ZERO)


@njit(**FAST)
def sum_columns(count, position, velocity, kappa, up, axes, sums):
    """Add the moments 1, z, w, z z, z w of the first `count` particles, weighted by kappa, to the four columns about each.

    z, w: height and velocity along `up` (3), a unit vector. sums (columns, columns, 5).
    """
    for i in range(count):
        if kappa[i] <= ZERO:
            continue
        a, to_a = place(i, position, axes[0], sums.shape[0] - 2)
        b, to_b = place(i, position, axes[1], sums.shape[1] - 2)
        z = np.float64(up[0] * position[0, i] + up[1] * position[1, i] + up[2] * position[2, i])
        w = np.float64(up[0] * velocity[0, i] + up[1] * velocity[1, i] + up[2] * velocity[2, i])
        for right in range(2):
            for ahead in range(2):
                share = np.float64(kappa[i] * (to_a if right else ONE - to_a) * (to_b if ahead else ONE - to_b))
                sums[a + right, b + ahead, 0] += share
                sums[a + right, b + ahead, 1] += share * z
                sums[a + right, b + ahead, 2] += share * w
                sums[a + right, b + ahead, 3] += share * z * z
                sums[a + right, b + ahead, 4] += share * z * w


def slopes(sums: Double, least: float) -> Double:
    """dw/dz (columns, columns) [1/s], of straight lines through columns' velocities; `least` [m2] is added to the variance of z."""
    weight = np.maximum(sums[..., 0], np.finfo(np.float64).tiny)
    with np.errstate(invalid="ignore", over="ignore"):  # the end of an advance tells of what has blown up
        z, w, zz, zw = np.moveaxis(sums[..., 1:] / weight[..., None], -1, 0)
        return np.asarray((zw - z * w) / (np.maximum(zz - z * z, 0.0) + least))


@njit(**FAST)
def stretch(begin, end, position, rates, axes, time_step, kappa):
    """kappa *= 1 + dt dw/dz, interpolated between the columns' `rates` (columns, columns) [1/s]."""
    for i in range(begin, end):
        a, to_a = place(i, position, axes[0], rates.shape[0] - 2)
        b, to_b = place(i, position, axes[1], rates.shape[1] - 2)
        near = (ONE - to_b) * rates[a, b] + to_b * rates[a, b + 1]
        far = (ONE - to_b) * rates[a + 1, b] + to_b * rates[a + 1, b + 1]
        change = time_step * ((ONE - to_a) * near + to_a * far)
        kappa[i] *= ONE + max(min(change, MOST), -MOST)


class ColumnStretch:
    """Columns along gravity, which must not be 0, over a fluid's whole domain."""

    def __init__(self, config: FluidConfig, team: Team) -> None:
        self._team = team
        self._narrowest = NARROWEST * config.support_radius
        self._layer = config.particle_spacing**2 / 12.0  # variance of z in a layer, of which particles show nothing
        gravity = np.array(config.gravity, np.float64)
        self._gravity = float(np.linalg.norm(gravity))
        self._up = (-gravity / self._gravity).astype(np.float32)
        self._across = np.linalg.svd(gravity[None])[2][1:]
        ends = np.array([[config.lower * axis, config.upper * axis] for axis in self._across])
        self._low, self._high = np.sort(ends, axis=1).sum(axis=2).T

    def foresee(self, count: int, position: Real, velocity: Real, time_step: float, kappa: Real) -> None:
        """Bring `kappa` (N,) [m2/s] of the first `count` particles from the last step, begun `time_step` [s] ago, to this one.

        position, velocity (3, N) [m, m/s].
        """
        if count == 0:
            return
        depth = 2.0 * float(kappa[:count].mean(dtype=np.float64)) / (self._gravity * time_step)
        width = max(self._narrowest, WIDTH * depth)
        axes = (np.column_stack([self._across, self._low]) / width).astype(np.float32)
        along, beside = (math.ceil(reach) + 2 for reach in (self._high - self._low) / width)
        sums = np.zeros((along, beside, 5))
        sum_columns(count, position, velocity, kappa, self._up, axes, sums)
        rates = slopes(sums, self._layer).astype(np.float32)
        self._team.run(stretch, count, position, rates, axes, np.float32(time_step), kappa)

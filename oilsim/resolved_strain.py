"""Which part of the motion is flow and which is noise, and how exact the pressure's pair vectors may be.

Noise of particles changes sign from one to the next, flow does not. Velocity gradients averaged over coarse cells of about
CELL particles keep the flow's strain S and lose the noise. With everything as squared velocities over one spacing,

    s = |S|^2 d^2,    n = |r_i|^2,    m = |G_i - S|^2 d^2 + n + (FLOOR^2 g d)

    theta_i = 1 - exp(-(dt / tau) C n / (C n + s))                   amount of filtering (`velocity_filter`)
    beta_i  = smoothstep(ln(s / m); ln 0.1, ln 0.5)                  1 in resolved flow, 0 in water at rest
    Y_i     = (1 - z) / m_0 + z M_i^-1,  z = beta_i smoothstep(lambda_i; 0.4, 0.8)

Y makes the pair vectors G_ij = (Y_i + Y_j) / 2 V grad W_ij of `divergence`. Exact gradients (Y = M^-1; Lanson & Vila 2008,
Hopkins 2015) let vortices and waves live; but their force is not the gradient of an energy, so that water at rest would be
stirred for ever. With plain ones it settles. lambda is the smallest eigenvalue of M, m_0 the moment of the lattice.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.config import FluidConfig
from oilsim.local_fields import NOISE, ONE, STRAIN, THETA, ZERO
from oilsim.parallel import Team
from oilsim.smoothing_kernels import FAST, lattice_moment

Real = NDArray[np.float32]

CELL = 16.0  # particles that a coarse cell holds: noise of their mean is a quarter of theirs
SETTLING = 1.5  # tau, in which pure noise fades, in units of `time_unit`
WEIGHTLESS_UNIT = 0.065  # s: the unit of time without gravity; that of 4 cm of water with it
EMPHASIS = np.float32(10.0)  # C, weight of noise against strain
FLOOR = 0.01  # share of sqrt(g d) under which the change of velocity over a spacing counts as noise
LN_NOISE, LN_FLOW = np.float32(math.log(0.1)), np.float32(math.log(0.5))
THIN, FULL = np.float32(0.4), np.float32(0.8)
TINY = np.float32(1e-14)


@njit(inline="always", **FAST)
def coarse_cell(position, i, lower, inverse_width, cells):
    """Coarse cell x, y, z of particle i; what lies outside counts as the border cell."""
    cx = min(max(np.int64((position[0, i] - lower[0]) * inverse_width[0]), 0), cells[0] - 1)
    cy = min(max(np.int64((position[1, i] - lower[1]) * inverse_width[1]), 0), cells[1] - 1)
    cz = min(max(np.int64((position[2, i] - lower[2]) * inverse_width[2]), 0), cells[2] - 1)
    return cx, cy, cz


@njit(**FAST)
def add_gradients(position, field, lower, inverse_width, cells, sums):
    """Add to `sums` (z, y, x, 10) the velocity gradients of each cell's particles, and 1 for each particle."""
    for i in range(position.shape[1]):
        cx, cy, cz = coarse_cell(position, i, lower, inverse_width, cells)
        for n in range(9):
            sums[cz, cy, cx, n] += field[3 + n, i]
        sums[cz, cy, cx, 9] += ONE


@njit(inline="always", **FAST)
def smoothstep(value, low, high):
    """0 below low, 1 above high, smooth between."""
    x = max(min((value - low) / (high - low), ONE), ZERO)
    return x * x * (np.float32(3.0) - np.float32(2.0) * x)


@njit(**FAST)
def judge(begin, end, position, field, matrix, lower, inverse_width, cells, sums, spacing, decay, floor, moment):
    """Fill theta and |S| of `field`, and turn `matrix` from M^-1 and lambda into Y and beta.

    decay dt / tau, floor FLOOR^2 g d [m2/s2], moment m_0.
    """
    square = spacing * spacing
    for i in range(begin, end):
        cx, cy, cz = coarse_cell(position, i, lower, inverse_width, cells)
        number = max(sums[cz, cy, cx, 9], TINY)
        strain = local = ZERO
        for n in range(9):
            mean = sums[cz, cy, cx, n] / number
            strain += mean * mean
            local += (field[3 + n, i] - mean) * (field[3 + n, i] - mean)
        noise = field[NOISE, i]
        weighted = EMPHASIS * noise
        field[THETA, i] = ONE - math.exp(-decay * weighted / (weighted + strain * square + TINY))
        field[STRAIN, i] = math.sqrt(strain)
        ratio = math.log((strain * square + TINY) / (local * square + noise + floor + TINY))
        flow = smoothstep(ratio, LN_NOISE, LN_FLOW)
        z = flow * smoothstep(matrix[6, i], THIN, FULL)
        matrix[6, i] = flow
        plain = (ONE - z) / moment
        for n in range(6):
            matrix[n, i] = z * matrix[n, i] if z > ZERO else ZERO
        matrix[0, i] += plain
        matrix[3, i] += plain
        matrix[5, i] += plain


def time_unit(config: FluidConfig) -> float:
    """sqrt(d / g) [s], in which a particle falls half its spacing: scenes that are similar under Froude's law behave alike."""
    gravity = math.hypot(*config.gravity)
    return math.sqrt(config.particle_spacing / gravity) if gravity > 0.0 else WEIGHTLESS_UNIT


class ResolvedStrain:
    """The coarse cells of a domain."""

    def __init__(self, config: FluidConfig, team: Team) -> None:
        extent = np.subtract(config.upper, config.lower)
        width = CELL ** (1.0 / config.dimension) * config.particle_spacing
        cells = np.maximum(1, np.floor(extent / width)).astype(int)
        if config.dimension == 2:
            cells[1] = 1
        self._cells = (int(cells[0]), int(cells[1]), int(cells[2]))
        self._lower = np.array(config.lower, np.float32)
        self._inverse_width = (cells / extent).astype(np.float32)
        self._periodic, self._team = config.periodic, team
        self._spacing = np.float32(config.particle_spacing)
        self._moment = np.float32(lattice_moment(config.dimension))
        self._settling_time = SETTLING * time_unit(config)
        self._floor = np.float32(FLOOR**2 * math.hypot(*config.gravity) * config.particle_spacing)

    def judge(self, position: Real, field: Real, matrix: Real, time_step: float) -> None:
        """See the module's docstring; `field` and `matrix` as from `local_fields`."""
        sums = np.zeros((*self._cells[::-1], 10), np.float32)
        grid = (self._lower, self._inverse_width, self._cells)
        add_gradients(position, field, *grid, sums)
        for axis in range(3):
            sums = self._smoothed(sums, axis)
        decay = np.float32(time_step / self._settling_time)
        self._team.run(
            judge,
            position.shape[1],
            position,
            field,
            matrix,
            *grid,
            sums,
            self._spacing,
            decay,
            self._floor,
            self._moment,
        )

    def _smoothed(self, sums: Real, axis: int) -> Real:
        """Weights 1/4, 1/2, 1/4 along one axis (of z, y, x)."""
        mode: Literal["wrap", "edge"] = "wrap" if self._periodic[2 - axis] else "edge"
        width = [(1, 1) if n == axis else (0, 0) for n in range(4)]
        padded = np.pad(sums, width, mode=mode)
        before, after = (
            np.take(padded, range(sums.shape[axis]), axis),
            np.take(padded, range(2, sums.shape[axis] + 2), axis),
        )
        return np.ascontiguousarray(np.float32(0.5) * sums + np.float32(0.25) * (before + after))

"""The unit of time in which noise fades and density returns: how long the flow gives particles.

With gravity the unit is sqrt(d / g), in which a particle falls half its spacing d: scenes that are similar under Froude's law behave alike.
Without gravity only the flow itself sets a time, in which neighbours pass each other:

    unit = sum gamma_i^2 / sum gamma_i^3,     gamma_i = sqrt(2 S_i : S_i),     S = (G + G^T) / 2

with the velocity gradient G of `particle_sums`. The shear rate gamma [1/s] is the inverse of the time in which layers a spacing apart
pass each other by a spacing. Particles that pass at gamma d leave a share e of that speed's energy as noise each time: e gamma^3 d^2 a
mass and time. A filter with the rate 1 / tau holds the noise at e tau d^2 sum gamma^3. That is a fixed share of the energy d^2 sum
gamma^2 of passing if tau is proportional to the unit, and so the same at any speed. Liquid that rests, moves or turns as one body does
not count.

Interfacial tension sets a time of its own, sqrt((rho_1 + rho_2) d^3 / sigma) (`FluidConfig.capillary_time`). Where that is shorter it is
the unit: a drop at rest would else keep its noise for ever.

A particle whose neighbours pass by more than the lambda of Eq. 30 (Qiu et al. 2021) in a step counts with gamma = lambda / dt. The step
does not resolve such outliers (`time_step`), and a single torn off drop would shorten the unit of all.

The columns of the array `flow` (N, 16), which holds the motion of a particle and of the liquid around it.

    0 to 2      velocity v_i [m/s]
    3           WEIGHT: rho_ref / rho_0 of the particle's phase [1]
    4 to 6      GRADIENT: first row of the velocity gradient G_i, the derivatives of v_x along x, y and z [1/s]
    7           STRENGTH: b_i of particle shifting [m2] (see `particle_shifting`)
    8 to 10     second row of G_i [1/s]
    11          LIQUID: number of the liquid within which the filter acts [1] (see `relaxation.smoothed_liquid`)
    12 to 14    third row of G_i [1/s]

Column 15 holds nothing of use. Kernels read the row of a neighbour in fours (`simd.gather_four`), and so every four columns
hold numbers that are needed together.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, TWO, inlined
from oilsim.backend.thread_team import BLOCK

# [1] column of the weight rho_ref / rho_0; layout; behind the velocity, which it is gathered with
WEIGHT = 3
# [1] first column of the velocity gradient, whose rows are 4 columns apart; layout; rows begin at multiples of four
GRADIENT = 4
# [1] column of the strength b of particle shifting; layout; behind the first row of the gradient, which it is gathered with
STRENGTH = 7
# [1] column of the number of the liquid; layout; behind the second row of the gradient, which it is gathered with
LIQUID = 11


@inlined
def velocity_gradient(flow, i):
    """Return G_i [1/s] row by row, as nine numbers; flow (N, 16)."""
    return (
        flow[i, 4], flow[i, 5], flow[i, 6], flow[i, 8], flow[i, 9], flow[i, 10], flow[i, 12], flow[i, 13], flow[i, 14],
    )  # fmt: skip


@inlined
def set_velocity_gradient(i, sums, spans, flow):
    """Fill G_i in flow (N, 16) from sums over the liquid neighbours j.

    sums      -sum_j V (v_i - v_j) grad W_ij^T [1/s], row by row, as nine numbers
    spans     inverse (six numbers xx, xy, xz, yy, yz, zz) of the moment matrix of the liquid neighbours [1]
    """
    bxx, bxy, bxz, byy, byz, bzz = spans
    for axis in range(3):
        ax, ay, az = sums[3 * axis], sums[3 * axis + 1], sums[3 * axis + 2]
        row = GRADIENT + 4 * axis
        flow[i, row] = ax * bxx + ay * bxy + az * bxz
        flow[i, row + 1] = ax * bxy + ay * byy + az * byz
        flow[i, row + 2] = ax * bxz + ay * byz + az * bzz


# [s] the unit of weightless liquid at rest; theory; so long that nothing fades and nothing returns
LONGEST = 1e20


def froude_unit(spacing: float, gravity: tuple[float, float, float]) -> float:
    """Return sqrt(d / g) [s] for the spacing d [m] and gravity (3,) [m/s2], which must not be 0."""
    return math.sqrt(spacing / math.hypot(*gravity))


def passing_unit(squares: float, cubes: float) -> float:
    """Return sum gamma^2 / sum gamma^3 [s], at most LONGEST; squares [1/s2] and cubes [1/s3] are the two sums."""
    return squares / cubes if squares < LONGEST * cubes else LONGEST


@inlined
def squared_shear_rate(flow, i):
    """Return gamma_i^2 = 2 S_i : S_i [1/s2]; flow (N, 16) has the columns of `flow`."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = velocity_gradient(flow, i)
    sxy, sxz, syz = xy + yx, xz + zx, yz + zy
    return TWO * (xx * xx + yy * yy + zz * zz) + sxy * sxy + sxz * sxz + syz * syz


@njit(**FAST)
def shear_rate_sums(begin, end, flow, largest, sums):
    """Fill sums (blocks, 2) with block sums of gamma^2 [1/s2] and gamma^3 [1/s3] over the particles begin to end.

    flow (N, 16) has the columns of `flow`; a gamma above `largest` [1/s] counts as `largest`.
    """
    for block in range(begin, end, BLOCK):
        squares = cubes = 0.0
        for i in range(block, min(block + BLOCK, end)):
            rate = np.float64(min(math.sqrt(squared_shear_rate(flow, i)), largest))
            squares += rate * rate
            cubes += rate * rate * rate
        sums[block // BLOCK, 0], sums[block // BLOCK, 1] = squares, cubes

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
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, TWO, inlined
from oilsim.backend.thread_team import BLOCK
from oilsim.gradients.flow import velocity_gradient

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

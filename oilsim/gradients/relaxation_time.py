"""The unit of time in which noise fades and density returns: what of the flow tells particles how long they have.

With gravity it is sqrt(d / g), in which a particle falls half its spacing d: scenes that are similar under Froude's law behave alike.
Without, only the flow itself sets a time, that in which neighbours pass each other:

    unit = sum gamma_i^2 / sum gamma_i^3,     gamma_i = sqrt(2 S_i : S_i),     S = (G + G^T) / 2

The shear rate gamma is the inverse of the time in which layers a spacing apart pass each other by a spacing. Passing at gamma d,
particles leave a share e of that speed's energy as noise each time: e gamma^3 d^2 a mass and time. Filtered at 1 / tau, noise comes to
e tau d^2 sum gamma^3, a fixed share of the energy d^2 sum gamma^2 of passing if tau goes with the unit. So it is the same at any speed;
liquid that is at rest, moves or turns as one has no say in it.

What passes by more than the lambda of Eq. 30 in a step counts as if it did just that, gamma <= lambda / dt: the step leaves it
unresolved, as an outlier (`time_step`), and one torn off drop would shorten the unit of all.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.thread_team import BLOCK
from oilsim.gradients.particle_sums import velocity_gradient

LONGEST = 1e20  # s: the unit of liquid at rest, in which nothing fades and nothing returns
TWO = np.float32(2.0)


def froude_unit(spacing: float, gravity: tuple[float, float, float]) -> float:
    """sqrt(d / g) [s] with the spacing d [m] and gravity (3,) [m/s2], which must not be 0."""
    return math.sqrt(spacing / math.hypot(*gravity))


def passing_unit(squares: float, cubes: float) -> float:
    """sum gamma^2 / sum gamma^3 [s], LONGEST at most, from the sums `squares` [1/s2] and `cubes` [1/s3]."""
    return squares / cubes if squares < LONGEST * cubes else LONGEST


@inlined
def squared_shear_rate(field, i):
    """2 S_i : S_i [1/s2]; `field` as from `particle_sums`."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = velocity_gradient(field, i)
    sxy, sxz, syz = xy + yx, xz + zx, yz + zy
    return TWO * (xx * xx + yy * yy + zz * zz) + sxy * sxy + sxz * sxz + syz * syz


@njit(**FAST)
def shear_rate_sums(begin, end, field, largest, sums):
    """Fill `sums` (blocks, 2) with block sums of gamma^2 [1/s2] and gamma^3 [1/s3]; `field` as from `particle_sums`.

    largest: gamma [1/s] as which greater ones count.
    """
    for block in range(begin, end, BLOCK):
        squares = cubes = 0.0
        for i in range(block, min(block + BLOCK, end)):
            rate = np.float64(min(math.sqrt(squared_shear_rate(field, i)), largest))
            squares += rate * rate
            cubes += rate * rate * rate
        sums[block // BLOCK, 0], sums[block // BLOCK, 1] = squares, cubes

"""The displacement of water by linear waves, as compiled sums over components (`oilsim.window.sea_motion` has the formula).

With theta = k . q - sigma t each component adds to D at the place at rest q, z being its height over the still level, at most 0,

    -a cosh k(h + z) / sinh kh sin theta     along the component
     a sinh k(h + z) / sinh kh cos theta     upwards.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from oilsim.backend.jit import ALLOCATING, inlined
from oilsim.sea.linear_waves import BLOCK, DEEP
from oilsim.sea.vector_math import exponential, sine_cosine

# [1] numbers of a block for a point; layout; three of its place, three of its displacement
ROWS = 6
# the first number of each row: place, height over the still level, displacement
X, Y, Z, DX, DY, DZ = (BLOCK * row for row in range(ROWS))
# [1] repetitions that find q from x; numerical; each takes the error times the slope, 0.44 at most
REPETITIONS = 12


@njit(**ALLOCATING)
def sum_displacement(begin, end, rest, waves, phase, water, moved):
    """Sum D of the water at those from begin to end of the places `rest` (N, 3) [m] into `moved` (N, 3) [m].

    waves: WaveComponents; phase (M,) [rad] from `WaveComponents.phase_at`; water: StillWater.
    """
    block = np.empty(ROWS * BLOCK)
    for start in range(begin, end, BLOCK):
        size = min(BLOCK, end - start)
        for i in range(size):
            block[X + i], block[Y + i] = rest[start + i, 0], rest[start + i, 1]
            block[Z + i] = rest[start + i, 2] - water.level
        _displace(block, size, waves, phase, water.depth)
        for i in range(size):
            n = start + i
            moved[n, 0], moved[n, 1], moved[n, 2] = block[DX + i], block[DY + i], block[DZ + i]


@njit(**ALLOCATING)
def find_rest(begin, end, points, waves, phase, water, rest):
    """Find the places `rest` (N, 3) [m] of the water that is at those from begin to end of `points` (N, 3) [m]: q = x - D(q).

    waves: WaveComponents; phase (M,) [rad] from `WaveComponents.phase_at`; water: StillWater.
    """
    block = np.empty(ROWS * BLOCK)
    for start in range(begin, end, BLOCK):
        size = min(BLOCK, end - start)
        block[DX : DX + 3 * BLOCK] = 0.0
        for _ in range(REPETITIONS):
            _place(block, size, points, start, water.level)
            _displace(block, size, waves, phase, water.depth)
        _place(block, size, points, start, water.level)
        for i in range(size):
            n = start + i
            rest[n, 0], rest[n, 1], rest[n, 2] = block[X + i], block[Y + i], block[Z + i] + water.level


@inlined
def _place(block, size, points, start, level):
    """Set the places of a block (ROWS * BLOCK,) [m] to points (N, 3) [m] from `start` on less their displacement."""
    for i in range(size):
        block[X + i], block[Y + i] = points[start + i, 0] - block[DX + i], points[start + i, 1] - block[DY + i]
        block[Z + i] = points[start + i, 2] - level - block[DZ + i]


@inlined
def _displace(block, size, waves, phase, h):
    """Set the displacement rows of a block (ROWS * BLOCK,) [m]; h [m] depth, phase (M,) [rad]."""
    block[DX : DX + 3 * BLOCK] = 0.0
    for j in range(phase.shape[0]):
        k, to_x, to_y, shift = waves.wave_number[j], waves.toward_x[j], waves.toward_y[j], phase[j]
        k_x, k_y, twice = k * to_x, k * to_y, np.exp(-2.0 * k * h)
        scale, is_deep = waves.amplitude[j] / (1.0 - twice), k * h > DEEP
        for i in range(size):
            s, c = sine_cosine(k_x * block[X + i] + k_y * block[Y + i] - shift)
            fall = exponential(k * min(max(block[Z + i], -h), 0.0))
            down, up = scale * fall, 0.0 if is_deep else scale * twice / fall
            along = (down + up) * s
            block[DX + i] -= to_x * along
            block[DY + i] -= to_y * along
            block[DZ + i] += (down - up) * c

"""Contact of particles with walls: what the pressure, which sees a step's beginning only, does not hold back.

A splash drop has no density to resist with when it meets a wall, and a particle that goes further than its distance from a wall in one
step would cross it. The wall's own coverage of the kernel, sum_b V_b W_ib, tells the distance h_i, that from a flat wall of the
same coverage, and its gradient s_i the direction. An inelastic contact keeps particles from crossing in the coming step, and drops NEAREST
from the wall:

    (v_i - v_b) . n_i <= (h_i - h_c)+ d / dt,     n_i = s_i / |s_i|,  s_i = sum_b V_b grad W_ib,     by  v_i -= beta_i s_i,

and bodies receive m_i beta_i of their part of s_i. A drop that is nearer all the same is moved out along n. Drops are particles whose
kernel holds hardly any liquid beside their own; what has neighbours has pressure to keep it off, and lies rightly nearer where two
walls meet.

Between walls that face each other, as a hull and the floor, s_i cancels: there is no side on which to stop, and 1 / |s_i| would make a
storm of a whisper. So a contact takes at least OPPOSED of the slope that a flat wall of the same coverage has: all contacts of a splash
in a tank had 0.78 to 1.09 of it, and near walls and skirts all particles but a thousandth have more than 0.56.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, load, spread, store
from oilsim.neighborhood.smoothing_kernels import SUPPORT

NEAREST = np.float32(0.25)  # spacings from the wall at which a drop's contact begins
LARGEST_PUSH = np.float32(0.1)  # spacings by which one step moves a particle out
ALONE = 0.15  # share of a drop's kernel, beside its own part, that liquid may fill
DISTANCES = (np.float32(-0.5), np.float32(SUPPORT - 0.5))  # spacings from a wall between which its coverage falls to 0
PLACES = 66  # at which it is tabulated
OPPOSED = np.float32(0.5)  # of a flat wall's slope, below which walls are taken to face each other across the particle
TINY, ZERO = np.float32(1e-12), np.float32(0.0)


def drop_share(own: float) -> np.float32:
    """Share of its kernel up to which liquid makes a drop; `own` is the part V W(0) of a single particle."""
    return np.float32(own + ALONE * (1.0 - own))


@njit(**FAST)
def wall_approach(begin, end, slope, velocity, rate):
    """Fill `rate` [1/s] with v_i . s_i, walls at rest; slope (3, N) s_i."""
    for k in range(begin, end, LANES):
        present, along = below(end, k), spread(ZERO)
        for axis in range(3):
            along += load(slope[axis], k, present) * load(velocity[axis], k, present)
        store(rate, k, present, along)


@inlined
def flat_wall(coverage, coverages):
    """Distance [d] from a flat wall that covers `coverage` of the kernel, and how fast that falls with it [1/d].

    coverages (n,) are those at even DISTANCES, falling.
    """
    last = coverages.size - 1
    n = 0
    while n < last - 1 and coverages[n + 1] >= coverage:
        n += 1
    fall = coverages[n] - coverages[n + 1]
    part = (coverages[n] - coverage) / fall
    step = (DISTANCES[1] - DISTANCES[0]) / np.float32(last)
    return DISTANCES[0] + step * (np.float32(n) + max(min(part, np.float32(1.0)), np.float32(0.0))), fall / step


@njit(**FAST)
def wall_contact(begin, end, coverage, compression, drop, slope, rate, coverages, spacing, reach, velocity, strength):
    """Stop particles that would cross a wall, and drops (less liquid than `drop`) NEAREST to it; `strength` gets beta_i [m2/s].

    coverages as for `flat_wall`; reach spacing / time step [m/s].
    """
    for i in range(begin, end):
        strength[i] = np.float32(0.0)
        if rate[i] <= np.float32(0.0):
            continue
        hx, hy, hz = slope[0, i], slope[1, i], slope[2, i]
        size = math.sqrt(hx * hx + hy * hy + hz * hz) + TINY
        gap, steepness = flat_wall(coverage[i], coverages)
        if size * spacing < OPPOSED * steepness:
            continue
        approach = rate[i] / size
        if np.float32(1.0) + compression[i] - coverage[i] < drop:
            gap -= NEAREST
        excess = approach - max(gap, np.float32(0.0)) * reach
        if excess > np.float32(0.0):
            beta = excess / size
            velocity[0, i] -= beta * hx
            velocity[1, i] -= beta * hy
            velocity[2, i] -= beta * hz
            strength[i] = beta


@njit(**FAST)
def wall_push(begin, end, coverage, compression, drop, slope, limit, coverages, spacing, position):
    """Move drops (3, N) that are nearer than contact, at which `limit` is covered, out along -s_i, at most LARGEST_PUSH spacings."""
    for i in range(begin, end):
        excess = coverage[i] - limit
        if excess > np.float32(0.0) and np.float32(1.0) + compression[i] - coverage[i] < drop:
            hx, hy, hz = slope[0, i], slope[1, i], slope[2, i]
            size = math.sqrt(hx * hx + hy * hy + hz * hz) + TINY
            if size * spacing < OPPOSED * flat_wall(coverage[i], coverages)[1]:
                continue
            length = min(excess / size, LARGEST_PUSH * spacing) / size
            position[0, i] -= length * hx
            position[1, i] -= length * hy
            position[2, i] -= length * hz

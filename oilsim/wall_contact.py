"""Contact of single particles with walls: what the density of a splash drop is too thin to feel.

A drop has no density to resist with when it meets a wall. The wall's own coverage of the kernel, s_i = sum_b V_b W_ib, tells how near
it is: s grows towards the wall, and reaches s_c at a quarter of a spacing from it. An inelastic contact keeps s <= s_c:

    rate of s:     sum_b V_b (v_i - v_b) . grad W_ib  <=  max(s_c - s_i, 0) / dt,
    by             v_i -= beta_i h_i,   beta_i = (rate - limit)+ / |h_i|^2,   h_i = sum_b V_b grad W_ib,

and bodies receive m_i beta_i of their part of h_i. A particle that is nearer all the same is moved out along h. Only drops are asked,
particles whose kernel holds hardly any liquid beside their own: what has neighbours has pressure to keep it off, and lies rightly
nearer where two walls meet.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.smoothing_kernels import FAST

NEAREST = np.float32(0.25)  # spacings from the wall at which contact begins
LARGEST_PUSH = np.float32(0.1)  # spacings by which one step moves a particle out
ALONE = 0.15  # share of a drop's kernel, beside its own part, that liquid may fill
DISTANCES = (np.float32(-0.5), np.float32(2.75))
SLOW = np.float32(0.0)
TINY = np.float32(1e-12)


def drop_share(own: float) -> np.float32:
    """Share of its kernel up to which liquid makes a drop; `own` is the part V W(0) of a single particle."""
    return np.float32(own + ALONE * (1.0 - own))


@njit(**FAST)
def wall_approach(begin, end, walls, wall_gradient, velocity, slope, rate):
    """Fill `slope` (3, N) with h_i and `rate` [1/s] with v_i . h_i, walls at rest."""
    for i in range(begin, end):
        hx = hy = hz = np.float32(0.0)
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            hx += wall_gradient[0, k]
            hy += wall_gradient[1, k]
            hz += wall_gradient[2, k]
        slope[0, i], slope[1, i], slope[2, i] = hx, hy, hz
        rate[i] = hx * velocity[0, i] + hy * velocity[1, i] + hz * velocity[2, i]


@njit(inline="always", **FAST)
def distance_to_wall(coverage, coverages):
    """Distance [d] from a flat wall that covers `coverage` of the kernel; coverages (n,) are those at even DISTANCES, falling."""
    last = coverages.size - 1
    n = 0
    while n < last - 1 and coverages[n + 1] >= coverage:
        n += 1
    part = (coverages[n] - coverage) / (coverages[n] - coverages[n + 1])
    step = (DISTANCES[1] - DISTANCES[0]) / np.float32(last)
    return DISTANCES[0] + step * (np.float32(n) + max(min(part, np.float32(1.0)), np.float32(0.0)))


@njit(**FAST)
def wall_contact(begin, end, coverage, compression, drop, slope, rate, coverages, reach, velocity, strength):
    """Stop particles that would cross a wall, and drops (less liquid than `drop`) NEAREST to it; `strength` gets beta_i [m2/s].

    coverages as for `distance_to_wall`; reach spacing / time step [m/s].
    """
    for i in range(begin, end):
        strength[i] = np.float32(0.0)
        if rate[i] <= np.float32(0.0):
            continue
        hx, hy, hz = slope[0, i], slope[1, i], slope[2, i]
        size = math.sqrt(hx * hx + hy * hy + hz * hz) + TINY
        approach = rate[i] / size
        if approach < SLOW * reach:
            continue
        gap = distance_to_wall(coverage[i], coverages)
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
def wall_push(begin, end, coverage, compression, drop, slope, limit, spacing, position):
    """Move drops (3, N) that are nearer than contact out along -h, at most LARGEST_PUSH spacings."""
    for i in range(begin, end):
        excess = coverage[i] - limit
        if excess > np.float32(0.0) and np.float32(1.0) + compression[i] - coverage[i] < drop:
            hx, hy, hz = slope[0, i], slope[1, i], slope[2, i]
            size = math.sqrt(hx * hx + hy * hy + hz * hz) + TINY
            length = min(excess / size, LARGEST_PUSH * spacing) / size
            position[0, i] -= length * hx
            position[1, i] -= length * hy
            position[2, i] -= length * hz

"""Adaptive time step: Eq. 30 and 31 of Qiu et al. 2021, and how far it may be exceeded where liquid moves without deforming.

Eq. 30 bounds every displacement, dt <= lambda d / v_max, though a block in free fall or a stream loses nothing in a longer step.
What must be resolved is motion relative to the neighbourhood,

    u_i^2 = sum_j w_ij |v_i - v_j|^2 / sum_j w_ij,   w = (1 - r / 2d)+,   for particles with enough neighbours,

and the approach to walls, -n_i . (v_i - v_b) with the normal n_i by the same weights. The split scheme takes

    dt = max(lambda d / v_max,  min(lambda d / u_max,  d / v_max)).

No step goes further than d: what had no neighbour within 2 d before meets it at d or more, and a wall is not crossed unseen.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.neighbors import nearest_images
from oilsim.parallel import BLOCK
from oilsim.smoothing_kernels import FAST

SPRAY = 8  # neighbours within 2 d below which a particle is a drop that flies for itself
TINY = np.float32(1e-20)


@njit(**FAST)
def relative_speeds(
    begin, end, position, velocity, wall, resting, owner, arm, twist, period, fluid, walls, slow, spacing, largest
):
    """Fill `largest` (blocks,) with the largest u_i^2 or squared approach to a wall [m2/s2] of each block.

    position, velocity (3, N) [m, m/s]; wall (3, M) [m], of which those from `resting` on move with `twist` (bodies, 6) of their
    `owner` at `arm` (3, M - resting) [m]. Particles no faster than `slow` [m/s] are passed over beside resting walls.
    """
    inverse_range = np.float32(0.5) / spacing
    one = np.float32(1.0)
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            greatest = np.float32(0.0)
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        ui, vi, wi = velocity[0, i], velocity[1, i], velocity[2, i]
        fast = ui * ui + vi * vi + wi * wi > slow * slow
        if fast:
            weights = squares = np.float32(0.0)
            present = 0
            for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
                j = fluid.neighbor[k]
                dx, dy, dz = nearest_images(xi - position[0, j], yi - position[1, j], zi - position[2, j], period)
                du, dv, dw = ui - velocity[0, j], vi - velocity[1, j], wi - velocity[2, j]
                weight = max(one - math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_range, np.float32(0.0))
                weights += weight
                squares += weight * (du * du + dv * dv + dw * dw)
                present += weight > np.float32(0.0)
            if present >= SPRAY:
                greatest = max(greatest, squares / (weights + TINY))
        if fast or twist.shape[0] > 0:
            weights = nx = ny = nz = su = sv = sw = np.float32(0.0)
            for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
                b = np.int64(walls.neighbor[k])
                dx, dy, dz = nearest_images(xi - wall[0, b], yi - wall[1, b], zi - wall[2, b], period)
                r = math.sqrt(dx * dx + dy * dy + dz * dz + TINY)
                weight = max(one - r * inverse_range, np.float32(0.0))
                weights += weight
                nx += weight * dx / r
                ny += weight * dy / r
                nz += weight * dz / r
                if b >= resting:
                    c = b - resting
                    o = owner[c]
                    su += weight * (twist[o, 0] + twist[o, 4] * arm[2, c] - twist[o, 5] * arm[1, c])
                    sv += weight * (twist[o, 1] + twist[o, 5] * arm[0, c] - twist[o, 3] * arm[2, c])
                    sw += weight * (twist[o, 2] + twist[o, 3] * arm[1, c] - twist[o, 4] * arm[0, c])
            share = one / (weights + TINY)
            approach = nx * (ui - su * share) + ny * (vi - sv * share) + nz * (wi - sw * share)
            if weights > np.float32(0.0) and approach < np.float32(0.0):
                greatest = max(greatest, approach * approach / (nx * nx + ny * ny + nz * nz + TINY))
        largest[i // BLOCK] = greatest


def cfl_time_step(spacing: float, largest_speed: float, cfl: float, minimum: float, maximum: float) -> float:
    """max(t_min, min(cfl d / v_max, t_max)) [s]; spacing d [m], largest_speed v_max [m/s], cfl the lambda of Eq. 30."""
    limit = math.inf if largest_speed == 0.0 else cfl * spacing / largest_speed
    return max(minimum, min(limit, maximum))


def relative_time_step(
    spacing: float, largest_speed: float, relative_speed: float, cfl: float, minimum: float, maximum: float
) -> float:
    """The step [s] of the module's docstring; relative_speed u_max [m/s], the rest as for `cfl_time_step`."""
    longest = math.inf if largest_speed == 0.0 else spacing / largest_speed
    deforming = math.inf if relative_speed == 0.0 else cfl * spacing / relative_speed
    shortest = cfl_time_step(spacing, largest_speed, cfl, minimum, maximum)
    return max(shortest, min(longest, deforming, maximum))


def equal_steps(remaining: float, time_step: float) -> float:
    """The longest step, at most `time_step`, of which a whole number fills `remaining` [s]."""
    return remaining / max(1, math.ceil(remaining / time_step * (1.0 - 1e-9)))

"""Constant density as a constraint on positions (Qiu et al. 2021, Eq. 15-23 and Alg. 2, errata mended).

    C_i = rho_i / rho_i0 - 1 = sum_j V_j W_ij - 1                                            (Eq. 15, 16)
    dx_i = (1 / rho_i0) sum_j V_j (L_i + L_j) grad W_ij,   L_i = -(1 + omega) C_i / a_i       (Eq. 21-23)
    a_i = |g_i|^2 / rho_i0 + V^2 sum_j |grad W_ij|^2 / rho_j0,   g_i = sum_j V_j grad W_ij    (1 / alpha_i of Eq. 13)

All neighbours count with the rest density of particle i (modified particle number density). L = lambda rho_0 carries the ratio
rho_j0 / rho_i0 of Eq. 22, which makes pair momentum exact; a_i is the diagonal of that operator, so that Eq. 13 follows for
one phase. Densities enter as weight w = rho_ref / rho_0, None where all are equal. Wall particles push but are not pushed.
The inequality C <= 0 is enforced: a free surface is not pulled together. Heavy-ball momentum 0.6 halves the iterations.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.neighbors import nearest_images
from oilsim.parallel import BLOCK
from oilsim.smoothing_kernels import FAST, kernel, kernel_slope_over_q
from oilsim.walls import add_wrench

HEAVY_BALL = np.float32(0.6)
LARGEST_MULTIPLIER = np.float32(
    0.3
)  # d^2 that |L| may reach: one pair then pushes at most a tenth of d, a blob cannot explode
TINY = np.float32(1e-20)


@njit(**FAST)
def density_and_diagonal(
    begin, end, position, wall, wall_volume, weight, period, fluid, walls, sigma, support, volume, compression, diagonal,
    gradient_sum,
):  # fmt: skip
    """Fill `compression` with C_i, `diagonal` with a_i rho_ref [1/m2] and `gradient_sum` (3, N) with g_i [1/m].

    position (3, N) [m], wall (3, M) [m], wall_volume (M,) [m3], weight (N,) or None, fluid and walls: neighbour lists.
    """
    inverse_support = np.float32(1.0) / support
    for i in range(begin, end):
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        total = sigma
        gx = gy = gz = square = np.float32(0.0)
        for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
            j = fluid.neighbor[k]
            dx, dy, dz = nearest_images(xi - position[0, j], yi - position[1, j], zi - position[2, j], period)
            r = math.sqrt(dx * dx + dy * dy + dz * dz + TINY)
            q = r * inverse_support
            total += kernel(q, sigma)
            slope = kernel_slope_over_q(q, sigma) * inverse_support * inverse_support
            gx += slope * dx
            gy += slope * dy
            gz += slope * dz
            share = slope * slope * (dx * dx + dy * dy + dz * dz)
            square += share if weight is None else share * weight[j]
        total *= volume
        gx *= volume
        gy *= volume
        gz *= volume
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            dx, dy, dz = nearest_images(xi - wall[0, b], yi - wall[1, b], zi - wall[2, b], period)
            r = math.sqrt(dx * dx + dy * dy + dz * dz + TINY)
            q = r * inverse_support
            total += wall_volume[b] * kernel(q, sigma)
            slope = wall_volume[b] * kernel_slope_over_q(q, sigma) * inverse_support * inverse_support
            gx += slope * dx
            gy += slope * dy
            gz += slope * dz
        gradient_sum[0, i], gradient_sum[1, i], gradient_sum[2, i] = gx, gy, gz
        own = gx * gx + gy * gy + gz * gz
        compression[i] = total - np.float32(1.0)
        diagonal[i] = volume * volume * square + (own if weight is None else own * weight[i])


@njit(**FAST)
def density_constraint(
    begin, end, position, wall, wall_volume, period, fluid, walls, sigma, support, volume, compression
):
    """Fill `compression` with C_i for the particles begin to end at their present positions (Eq. 15, 16)."""
    inverse_support = np.float32(1.0) / support
    for i in range(begin, end):
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        total = sigma
        for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
            j = fluid.neighbor[k]
            dx, dy, dz = nearest_images(xi - position[0, j], yi - position[1, j], zi - position[2, j], period)
            total += kernel(math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support, sigma)
        total *= volume
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            dx, dy, dz = nearest_images(xi - wall[0, b], yi - wall[1, b], zi - wall[2, b], period)
            total += wall_volume[b] * kernel(math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support, sigma)
        compression[i] = total - np.float32(1.0)


@njit(**FAST)
def density_multiplier(begin, end, compression, diagonal, relaxation, limit, multiplier, error):
    """Heavy-ball update of the multiplier L_i (Eq. 21, 23), between -limit and 0; block sums of (C_i)+ go to `error`.

    A limit on the multiplier, not on the push, keeps the momentum of every pair.
    """
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            error[i // BLOCK] = 0.0
        excess = max(compression[i], np.float32(0.0))
        step = -(np.float32(1.0) + relaxation) * compression[i] / (diagonal[i] + TINY)
        multiplier[i] = max(min(step + HEAVY_BALL * multiplier[i], np.float32(0.0)), -limit)
        error[i // BLOCK] += excess


@njit(**FAST)
def density_push(
    begin,
    end,
    position,
    wall,
    wall_volume,
    weight,
    multiplier,
    period,
    fluid,
    walls,
    sigma,
    support,
    volume,
    push,
):
    """Fill `push` (3, N) with the position correction dx_i of Eq. 22 [m]."""
    inverse_support = np.float32(1.0) / support
    for i in range(begin, end):
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        own = multiplier[i]
        px = py = pz = np.float32(0.0)
        for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
            j = fluid.neighbor[k]
            dx, dy, dz = nearest_images(xi - position[0, j], yi - position[1, j], zi - position[2, j], period)
            r = math.sqrt(dx * dx + dy * dy + dz * dz + TINY)
            slope = (
                kernel_slope_over_q(r * inverse_support, sigma)
                * inverse_support
                * inverse_support
                * (own + multiplier[j])
            )
            px += slope * dx
            py += slope * dy
            pz += slope * dz
        px *= volume
        py *= volume
        pz *= volume
        if own != np.float32(0.0):
            for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
                b = walls.neighbor[k]
                dx, dy, dz = nearest_images(xi - wall[0, b], yi - wall[1, b], zi - wall[2, b], period)
                r = math.sqrt(dx * dx + dy * dy + dz * dz + TINY)
                slope = (
                    wall_volume[b]
                    * kernel_slope_over_q(r * inverse_support, sigma)
                    * inverse_support
                    * inverse_support
                    * own
                )
                px += slope * dx
                py += slope * dy
                pz += slope * dz
        if weight is not None:
            px *= weight[i]
            py *= weight[i]
            pz *= weight[i]
        push[0, i] = px
        push[1, i] = py
        push[2, i] = pz


@njit(**FAST)
def push_reaction(
    particles, position, wall, wall_volume, multiplier, period, fluid, walls, sigma, support, volume, reference_density,
    resting, owner, arm, reaction,
):  # fmt: skip
    """Add to `reaction` (bodies, 6) the opposite of mass times push that moving bodies give to `particles` [kg m, kg m2]."""
    inverse_support = np.float32(1.0) / support
    for i in particles:
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            if b < resting:
                continue
            dx, dy, dz = nearest_images(
                position[0, i] - wall[0, b], position[1, i] - wall[1, b], position[2, i] - wall[2, b], period
            )
            r = math.sqrt(dx * dx + dy * dy + dz * dz + TINY)
            slope = wall_volume[b] * kernel_slope_over_q(r * inverse_support, sigma) * inverse_support * inverse_support
            slope *= -volume * reference_density * multiplier[i]
            add_wrench(reaction, owner[b - resting], arm, b - resting, slope * dx, slope * dy, slope * dz)

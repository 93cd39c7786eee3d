"""Constant density as a constraint on positions (Qiu et al. 2021, Eq. 15-23 and Alg. 2, errata mended).

    C_i = rho_i / rho_i0 - 1 = sum_j V_j W_ij - 1                                            (Eq. 15, 16)
    dx_i = (1 / rho_i0) sum_j V_j (L_i + L_j) grad W_ij,   L_i = -(1 + omega) C_i / a_i       (Eq. 21-23)
    a_i = |g_i|^2 / rho_i0 + V^2 sum_j |grad W_ij|^2 / rho_j0,   g_i = sum_j V_j grad W_ij    (1 / alpha_i of Eq. 13)

All neighbours count with the rest density of particle i (modified particle number density). L = lambda rho_0 carries the ratio
rho_j0 / rho_i0 of Eq. 22, which makes pair momentum exact; a_i is the diagonal of that operator, so that Eq. 13 follows for
one phase. Densities enter as weight w = rho_ref / rho_0. Wall particles push but are not pushed.
The inequality C <= 0 is enforced: a free surface is not pulled together. Heavy-ball momentum 0.6 halves the iterations.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, gather, load, only, root, spread, summed
from oilsim.backend.thread_team import BLOCK
from oilsim.boundaries.contacts import add_wrench
from oilsim.neighborhood.neighbor_search import nearest_images, separations
from oilsim.neighborhood.smoothing_kernels import kernel, kernel_slope_over_q

HEAVY_BALL = np.float32(0.6)
LARGEST_MULTIPLIER = np.float32(
    0.3
)  # d^2 that |L| may reach: one pair then pushes at most a tenth of d, a blob cannot explode
TINY, ZERO, ONE = np.float32(1e-20), np.float32(0.0), np.float32(1.0)


@inlined
def wall_content(i, points, wall, period, walls, sigma, inverse_support):
    """sum_b V_b W_ib, and the sums of V_b grad W_ib [1/m]."""
    content = gx = gy = gz = spread(ZERO)
    first, last = walls.start[i], walls.start[i] + np.int64(walls.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        b = load(walls.neighbor, k, present)
        dx, dy, dz, volume = separations(i, points, wall, b, period)
        q = root(dx * dx + dy * dy + dz * dz) * inverse_support
        share = only(present, volume, ZERO)
        slope = share * kernel_slope_over_q(q, sigma)
        content += share * kernel(q, sigma)
        gx += slope * dx
        gy += slope * dy
        gz += slope * dz
    factor = inverse_support * inverse_support
    return summed(content), (factor * summed(gx), factor * summed(gy), factor * summed(gz))


@njit(**FAST)
def density_and_diagonal(
    begin, end, points, wall, period, fluid, walls, sigma, support, volume, compression, diagonal, gradient_sum
):
    """Fill `compression` with C_i, `diagonal` with a_i rho_ref [1/m2] and `gradient_sum` (3, N) with g_i [1/m].

    points (N, 4): place [m] and weight; wall (M, 4): place [m] and volume [m3]; fluid and walls: neighbour lists.
    """
    inverse_support = ONE / support
    factor = volume * inverse_support * inverse_support
    for i in range(begin, end):
        content = gx = gy = gz = square = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, weight = separations(i, points, points, j, period)
            squared = dx * dx + dy * dy + dz * dz
            q = only(present, root(squared) * inverse_support, ONE)
            slope = factor * kernel_slope_over_q(q, sigma)
            content += kernel(q, sigma)
            gx += slope * dx
            gy += slope * dy
            gz += slope * dz
            square += slope * slope * squared * weight
        covered, (sx, sy, sz) = ZERO, (ZERO, ZERO, ZERO)
        if walls.number[i] > 0:
            covered, (sx, sy, sz) = wall_content(i, points, wall, period, walls, sigma, inverse_support)
        sx, sy, sz = sx + summed(gx), sy + summed(gy), sz + summed(gz)
        gradient_sum[0, i], gradient_sum[1, i], gradient_sum[2, i] = sx, sy, sz
        own = sx * sx + sy * sy + sz * sz
        compression[i] = volume * (sigma + summed(content)) + covered - ONE
        diagonal[i] = summed(square) + own * points[i, 3]


@njit(**FAST)
def density_constraint(begin, end, points, wall, period, fluid, walls, sigma, support, volume, compression):
    """Fill `compression` with C_i for the particles begin to end at their present positions (Eq. 15, 16)."""
    inverse_support = ONE / support
    for i in range(begin, end):
        content = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            dx, dy, dz, _ = separations(i, points, points, load(fluid.neighbor, k, present), period)
            content += only(present, kernel(root(dx * dx + dy * dy + dz * dz) * inverse_support, sigma), ZERO)
        covered = ZERO
        if walls.number[i] > 0:
            covered, _ = wall_content(i, points, wall, period, walls, sigma, inverse_support)
        compression[i] = volume * (sigma + summed(content)) + covered - ONE


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
def density_push(begin, end, points, wall, multiplier, period, fluid, walls, sigma, support, volume, push):
    """Fill `push` (3, N) with the position correction dx_i of Eq. 22 [m]."""
    inverse_support = ONE / support
    factor = volume * inverse_support * inverse_support
    for i in range(begin, end):
        own = multiplier[i]
        px = py = pz = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            slope = kernel_slope_over_q(root(dx * dx + dy * dy + dz * dz) * inverse_support, sigma)
            slope = only(present, slope * (own + gather(multiplier, j)), ZERO)
            px += slope * dx
            py += slope * dy
            pz += slope * dz
        bx = by = bz = ZERO
        if own != ZERO and walls.number[i] > 0:
            _, (bx, by, bz) = wall_content(i, points, wall, period, walls, sigma, inverse_support)
        mobility = points[i, 3]
        push[0, i] = mobility * (factor * summed(px) + own * bx)
        push[1, i] = mobility * (factor * summed(py) + own * by)
        push[2, i] = mobility * (factor * summed(pz) + own * bz)


@njit(**FAST)
def push_reaction(pairs, points, wall, multiplier, neighborhood, reference_density, reaction):
    """Add to `reaction` (bodies, 6) the opposite of mass times push that moving bodies give to particles [kg m, kg m2] (Eq. 22).

    pairs              the step's `BodyPairs`
    points             (N, 4) place [m] and weight of the particles
    wall               (M, 4) place [m] and volume [m3] of the wall particles
    multiplier         (N,) L_i [m2]
    neighborhood       constants of the step (see `Neighborhood`)
    reference_density  rho_ref [kg/m3]
    """
    inverse_support, volume = np.float32(1.0) / neighborhood.support, neighborhood.volume
    for n in range(pairs.particle.size):
        i, b = pairs.particle[n], pairs.point[n]
        dx, dy, dz = nearest_images(
            points[i, 0] - wall[b, 0], points[i, 1] - wall[b, 1], points[i, 2] - wall[b, 2], neighborhood.period
        )
        r = math.sqrt(dx * dx + dy * dy + dz * dz + TINY)
        slope = (
            wall[b, 3]
            * kernel_slope_over_q(r * inverse_support, neighborhood.sigma)
            * inverse_support
            * inverse_support
        )
        slope *= -volume * reference_density * multiplier[i]
        add_wrench(reaction, pairs.body[n], pairs.arm, n, slope * dx, slope * dy, slope * dz)

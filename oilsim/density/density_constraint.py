"""Constant density as a constraint on positions (Qiu et al. 2021, Eq. 15-23 and Alg. 2, errata repaired).

    C_i = rho_i / rho_i0 - 1 = sum_j V_j W_ij - 1                                            compression [1] (Eq. 15, 16)
    dx_i = (1 / rho_i0) sum_j V_j (L_i + L_j) grad W_ij,   L_i = -(1 + omega) C_i / a_i      push [m] (Eq. 21-23)
    a_i = |g_i|^2 / rho_i0 + V^2 sum_j |grad W_ij|^2 / rho_j0,   g_i = sum_j V_j grad W_ij   diagonal (1 / alpha_i of Eq. 13)

All neighbours count with the rest density of particle i (modified particle number density). L = lambda rho_0 carries the ratio
rho_j0 / rho_i0 of Eq. 22, which makes the momentum of pairs exact. a_i is the diagonal of that operator, and Eq. 13 follows from it for
one phase. Densities enter as the weight w = rho_ref / rho_0. Wall particles push and are not pushed. The constraint is the inequality
C <= 0: a free surface is not pulled together. A heavy-ball momentum of 0.6 (Polyak 1964) halves the iterations.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, ONE, ZERO
from oilsim.backend.simd import LANES, below, gather, load, only, root, spread, summed
from oilsim.backend.thread_team import BLOCK
from oilsim.boundaries.contacts import add_wrench
from oilsim.gradients.particle_sums import coverage_and_slope
from oilsim.neighborhood.neighbor_search import nearest_images, separations
from oilsim.neighborhood.smoothing_kernels import kernel, kernel_slope_over_q

# [1] share of the last change of L that the next one repeats; measured (form: Polyak 1964); halves the iterations
HEAVY_BALL = np.float32(0.6)
# [d^2] largest |L|; measured; one pair then pushes by a tenth of d at most, and no blob explodes
LARGEST_MULTIPLIER = np.float32(0.3)
# [1/m2] added to diagonals that may vanish; theory; far below the diagonal of a particle with one neighbour
TINY = np.float32(1e-20)


@njit(**FAST)
def density_and_diagonal(begin, end, neighborhood, compression, diagonal, gradient_sum):
    """Fill the three sums of the density constraint for the particles begin to end (Eq. 13, 15 and 16).

    neighborhood                     the `Neighborhood`
    compression (N,)         becomes C_i [1]
    diagonal (N,)            becomes a_i rho_ref [1/m2]
    gradient_sum (3, N)      becomes g_i [1/m]
    """
    points, period, fluid, sigma, volume = (
        neighborhood.points,
        neighborhood.period,
        neighborhood.fluid,
        neighborhood.sigma,
        neighborhood.volume,
    )
    inverse_support = ONE / neighborhood.support
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
        if neighborhood.walls.number[i] > 0:
            covered, (sx, sy, sz) = coverage_and_slope(i, neighborhood)
        sx, sy, sz = sx + summed(gx), sy + summed(gy), sz + summed(gz)
        gradient_sum[0, i], gradient_sum[1, i], gradient_sum[2, i] = sx, sy, sz
        own = sx * sx + sy * sy + sz * sz
        compression[i] = volume * (sigma + summed(content)) + covered - ONE
        diagonal[i] = summed(square) + own * points[i, 3]


@njit(**FAST)
def density_constraint(begin, end, neighborhood, compression):
    """Fill compression (N,) with C_i [1] of the particles begin to end at their present positions (Eq. 15, 16).

    Neighborhood: `Neighborhood`.
    """
    points, period, fluid, sigma = neighborhood.points, neighborhood.period, neighborhood.fluid, neighborhood.sigma
    inverse_support = ONE / neighborhood.support
    for i in range(begin, end):
        content = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            dx, dy, dz, _ = separations(i, points, points, load(fluid.neighbor, k, present), period)
            content += only(present, kernel(root(dx * dx + dy * dy + dz * dz) * inverse_support, sigma), ZERO)
        covered = ZERO
        if neighborhood.walls.number[i] > 0:
            covered, _ = coverage_and_slope(i, neighborhood)
        compression[i] = neighborhood.volume * (sigma + summed(content)) + covered - ONE


@njit(**FAST)
def density_multiplier(begin, end, compression, diagonal, relaxation, limit, multiplier, error):
    """Update the multipliers with heavy-ball momentum (Eq. 21, 23) and add up the compression.

    compression (N,)     C_i [1]
    diagonal (N,)        a_i rho_ref [1/m2]
    relaxation           omega [1]
    limit                largest |L_i| [m2]; a limit on the multiplier, not on the push, keeps the momentum of every pair
    multiplier (N,)      L_i of the last iteration [m2], becomes that of this one, between -limit and 0
    error (blocks,)      becomes the block sums of (C_i)+ [1]
    """
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            error[i // BLOCK] = 0.0
        excess = max(compression[i], ZERO)
        step = -(ONE + relaxation) * compression[i] / (diagonal[i] + TINY)
        multiplier[i] = max(min(step + HEAVY_BALL * multiplier[i], ZERO), -limit)
        error[i // BLOCK] += excess


@njit(**FAST)
def density_push(begin, end, neighborhood, multiplier, push):
    """Fill push (3, N) with the position corrections dx_i [m] of Eq. 22; neighborhood: `Neighborhood`, multiplier (N,): L_i [m2]."""
    points, period, fluid = neighborhood.points, neighborhood.period, neighborhood.fluid
    inverse_support = ONE / neighborhood.support
    factor = neighborhood.volume * inverse_support * inverse_support
    for i in range(begin, end):
        own = multiplier[i]
        px = py = pz = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            slope = kernel_slope_over_q(root(dx * dx + dy * dy + dz * dz) * inverse_support, neighborhood.sigma)
            slope = only(present, slope * (own + gather(multiplier, j)), ZERO)
            px += slope * dx
            py += slope * dy
            pz += slope * dz
        bx = by = bz = ZERO
        if own != ZERO and neighborhood.walls.number[i] > 0:
            _, (bx, by, bz) = coverage_and_slope(i, neighborhood)
        mobility = points[i, 3]
        push[0, i] = mobility * (factor * summed(px) + own * bx)
        push[1, i] = mobility * (factor * summed(py) + own * by)
        push[2, i] = mobility * (factor * summed(pz) + own * bz)


@njit(**FAST)
def push_reaction(pairs, neighborhood, multiplier, reference_density, reaction):
    """Add to `reaction` the opposite of mass times the push of Eq. 22 that moving bodies give to particles.

    pairs                 the step's `BodyPairs`
    neighborhood                  the `Neighborhood`
    multiplier (N,)       L_i [m2]
    reference_density     rho_ref [kg/m3]
    reaction (bodies, 6)  mass times displacement [kg m] and its moment [kg m2]
    """
    points, wall, inverse_support = neighborhood.points, neighborhood.wall_points, ONE / neighborhood.support
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
        slope *= -neighborhood.volume * reference_density * multiplier[i]
        add_wrench(reaction, pairs.body[n], pairs.arm, n, slope * dx, slope * dy, slope * dz)

"""Sums over the neighbours of a particle, in one pass: density, gradients and moments.

    e_i = sum_j V W_ij + sum_b V_b W_ib - 1                     compression [1] (Qiu et al. 2021, Eq. 15 and 16)
    g_i = sum_j V grad W_ij + sum_b V_b grad W_ib               gradient sum [1/m], 0 inside the liquid, outwards at a free surface
    M_i = sum_j V grad W_ij x_ij^T + sum_b V_b grad W_ib x_ib^T moment matrix [1], the unit matrix where gradients are exact
    G_i = sum_j (v_j - v_i) (L_i V grad W_ij)^T                 velocity gradient [1/s], exact for linear flows

j runs over fluid neighbours and b over wall neighbours, x_ij = x_j - x_i, and L_i is the inverse of the fluid's part of M_i (kernel
gradient correction, Bonet and Lok 1999). Walls have no velocity to differ from, so G takes fluid neighbours alone.

Density, relaxation and these sums share one sum over wall neighbours, `sum_over_walls`. `pressure_gradient.cache_wall_gradients`
has its own, because a body must receive exactly the vectors that are cached, each corrected and summed in the same order.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, ONE, ZERO, inlined
from oilsim.backend.simd import LANES, below, gather_four, load, only, root, spread, summed
from oilsim.gradients.gradient_correction import determinant, fill_correction, inverse
from oilsim.gradients.relaxation_time import GRADIENT, set_velocity_gradient
from oilsim.neighborhood.neighbor_search import separations
from oilsim.neighborhood.smoothing_kernels import kernel, kernel_slope_over_q

# [1] determinant of the fluid's moment from which a velocity gradient is taken; theory; neighbours that fill an eighth of space, as in a
# corner of three walls, have 1 / 8^3
REGULAR = np.float32(0.01)


@inlined
def sum_over_fluid(i, neighborhood, flow):
    """Sum over the fluid neighbours j of particle i: the fluid's parts of density, g_i and M_i, and what G_i is made of.

    Returns sum_j W_ij [1/m3], sum_j V grad W_ij [1/m] (3), sum_j V grad W_ij x_ij^T [1] (6) and sum_j V (v_j - v_i) grad W_ij^T [1/s] (9).
    flow (N, 16) holds velocities [m/s].
    """
    points, period, fluid, sigma = neighborhood.points, neighborhood.period, neighborhood.fluid, neighborhood.sigma
    inverse_support = ONE / neighborhood.support
    factor = -neighborhood.volume * inverse_support * inverse_support
    ui, vi, wi = flow[i, 0], flow[i, 1], flow[i, 2]
    content = gx = gy = gz = mxx = mxy = mxz = myy = myz = mzz = spread(ZERO)
    axx = axy = axz = ayx = ayy = ayz = azx = azy = azz = spread(ZERO)
    first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        j = load(fluid.neighbor, k, present)
        dx, dy, dz, _ = separations(i, points, points, j, period)
        uj, vj, wj, _ = gather_four(flow, j, 0)
        du, dv, dw = ui - uj, vi - vj, wi - wj
        q = only(present, root(dx * dx + dy * dy + dz * dz) * inverse_support, ONE)
        slope = kernel_slope_over_q(q, sigma)
        ax, ay, az = slope * dx, slope * dy, slope * dz
        content += kernel(q, sigma)
        gx -= ax
        gy -= ay
        gz -= az
        mxx += ax * dx
        mxy += ax * dy
        mxz += ax * dz
        myy += ay * dy
        myz += ay * dz
        mzz += az * dz
        axx += du * ax
        axy += du * ay
        axz += du * az
        ayx += dv * ax
        ayy += dv * ay
        ayz += dv * az
        azx += dw * ax
        azy += dw * ay
        azz += dw * az
    moment = (
        factor * summed(mxx), factor * summed(mxy), factor * summed(mxz),
        factor * summed(myy), factor * summed(myz), factor * summed(mzz),
    )  # fmt: skip
    strain = (
        factor * summed(axx), factor * summed(axy), factor * summed(axz),
        factor * summed(ayx), factor * summed(ayy), factor * summed(ayz),
        factor * summed(azx), factor * summed(azy), factor * summed(azz),
    )  # fmt: skip
    return summed(content), (factor * summed(gx), factor * summed(gy), factor * summed(gz)), moment, strain


@inlined
def sum_over_walls(i, neighborhood, scale):
    """Sum over the wall neighbours b of particle i: coverage, slope and moments.

    Returns the coverage sum_b V_b W_ib [1], and times scale H^2 the slope sum_b V_b grad W_ib [1/m] (3) and the moment
    sum_b V_b grad W_ib x_ib^T [1] (6); scale: 1 / H^2 [1/m2], or 1 where the sums are scaled afterwards. The compiler removes what a caller
    does not use.
    """
    wall, period, walls, sigma = neighborhood.wall_points, neighborhood.period, neighborhood.walls, neighborhood.sigma
    inverse_support = ONE / neighborhood.support
    coverage = gx = gy = gz = mxx = mxy = mxz = myy = myz = mzz = spread(ZERO)
    first, last = walls.start[i], walls.start[i] + np.int64(walls.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        b = load(walls.neighbor, k, present)
        dx, dy, dz, volume = separations(i, neighborhood.points, wall, b, period)
        q = root(dx * dx + dy * dy + dz * dz) * inverse_support
        share = only(present, volume, ZERO)
        coverage += share * kernel(q, sigma)
        slope = scale * share * kernel_slope_over_q(q, sigma)
        ax, ay, az = slope * dx, slope * dy, slope * dz
        gx += ax
        gy += ay
        gz += az
        mxx -= ax * dx
        mxy -= ax * dy
        mxz -= ax * dz
        myy -= ay * dy
        myz -= ay * dz
        mzz -= az * dz
    moment = summed(mxx), summed(mxy), summed(mxz), summed(myy), summed(myz), summed(mzz)
    return summed(coverage), (summed(gx), summed(gy), summed(gz)), moment


@inlined
def coverage_and_slope(i, neighborhood):
    """Return the coverage sum_b V_b W_ib [1] and the slope sum_b V_b grad W_ib [1/m] (3) of particle i; neighborhood: `Neighborhood`."""
    inverse_support = ONE / neighborhood.support
    coverage, (gx, gy, gz), _ = sum_over_walls(i, neighborhood, ONE)
    factor = inverse_support * inverse_support
    return coverage, (factor * gx, factor * gy, factor * gz)


@njit(**FAST)
def sum_over_neighbors(begin, end, neighborhood, shares, compression, gradient_sum, flow, matrix):
    """Fill compression, gradient sum, velocity gradient and correction matrix of the particles begin to end.

    neighborhood                     the `Neighborhood`
    shares                   the `CorrectionShares`
    compression (N,)         becomes e_i [1]
    gradient_sum (3, N)      becomes g_i [1/m]
    flow (N, 16)             holds velocities [m/s], receives G_i [1/s]; G_i is 0 where the fluid neighbours do not span space
    matrix (N, 8)            becomes Y_i [1] of `gradient_correction`, as xx, xy, xz, yy, yz, zz
    """
    inverse_support = ONE / neighborhood.support
    scale, plane = inverse_support * inverse_support, shares.plane
    for i in range(begin, end):
        content, slope, moment, strain = sum_over_fluid(i, neighborhood, flow)
        if plane:
            moment = moment[0], moment[1], moment[2], ONE, moment[4], moment[5]
        if determinant(moment) > REGULAR:
            set_velocity_gradient(i, strain, inverse(moment), flow)
        else:
            for axis in range(3):
                row = GRADIENT + 4 * axis
                flow[i, row] = flow[i, row + 1] = flow[i, row + 2] = ZERO
        solid, push, more = ZERO, (ZERO, ZERO, ZERO), (ZERO, ZERO, ZERO, ZERO, ZERO, ZERO)
        if neighborhood.walls.number[i] > 0:
            solid, push, more = sum_over_walls(i, neighborhood, scale)
        compression[i] = neighborhood.volume * (neighborhood.sigma + content) + solid - ONE
        for axis in range(3):
            gradient_sum[axis, i] = slope[axis] + push[axis]
        whole = (
            moment[0] + more[0], moment[1] + more[1], moment[2] + more[2],
            ONE if plane else moment[3] + more[3], moment[4] + more[4], moment[5] + more[5],
        )  # fmt: skip
        fill_correction(i, whole, shares, matrix)

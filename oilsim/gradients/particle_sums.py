"""Everything a particle learns from its neighbourhood in one pass: density, gradients and moments.

e_i   = sum_j V W_ij + sum_b V_b W_ib - 1                     compression (Qiu et al. 2021, Eq. 15 and 16)
g_i   = sum_j V grad W_ij + sum_b V_b grad W_ib               0 inside a liquid, points out of it at a free surface
M_i   = sum_j V grad W_ij x_ij^T + walls                      moment matrix, the unit matrix where gradients are exact; x_ij = x_j - x_i
G_i   = sum_j (v_j - v_i) (L_i V grad W_ij)^T                 velocity gradient, exact for linear fields; L from liquid neighbours alone
"""

from __future__ import annotations

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, gather_four, load, only, root, spread, summed
from oilsim.gradients.gradient_correction import fill_face_matrix
from oilsim.gradients.symmetric_3x3 import determinant, inverse
from oilsim.neighborhood.neighbor_search import separations
from oilsim.neighborhood.smoothing_kernels import kernel, kernel_slope_over_q

# columns of `field` (N, 16), whose rows neighbours ask for in fours: v and the weight, then the rows of G, the first one with b_i (see
# `relaxation`)
WEIGHT, GRADIENT, STRENGTH = 3, 4, 7
REGULAR = np.float32(0.01)  # determinant of a moment matrix from which a gradient is taken
ZERO, ONE = np.float32(0.0), np.float32(1.0)


@inlined
def add_liquid(i, points, field, period, fluid, sigma, support, volume):
    """Liquid's part of the particle's density over V, of g and of M, and sum_j V (v_j - v_i) grad W_ij^T: one, 3, 6 and 9 sums."""
    inverse_support = ONE / support
    factor = -volume * inverse_support * inverse_support
    ui, vi, wi = field[i, 0], field[i, 1], field[i, 2]
    content = gx = gy = gz = mxx = mxy = mxz = myy = myz = mzz = spread(ZERO)
    axx = axy = axz = ayx = ayy = ayz = azx = azy = azz = spread(ZERO)
    first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        j = load(fluid.neighbor, k, present)
        dx, dy, dz, _ = separations(i, points, points, j, period)
        uj, vj, wj, _ = gather_four(field, j, 0)
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
def add_walls(i, points, wall, period, walls, sigma, support):
    """Walls' part of the particle's density, of g and of M: sum_b V_b W_ib, then 3 and 6 sums."""
    inverse_support = ONE / support
    scale = inverse_support * inverse_support
    content = gx = gy = gz = mxx = mxy = mxz = myy = myz = mzz = spread(ZERO)
    first, last = walls.start[i], walls.start[i] + np.int64(walls.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        b = load(walls.neighbor, k, present)
        dx, dy, dz, volume = separations(i, points, wall, b, period)
        q = root(dx * dx + dy * dy + dz * dz) * inverse_support
        share = only(present, volume, ZERO)
        content += share * kernel(q, sigma)
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
    return summed(content), (summed(gx), summed(gy), summed(gz)), moment


@inlined
def velocity_gradient(field, i):
    """G of particle i, row by row, as nine."""
    return (
        field[i, 4], field[i, 5], field[i, 6], field[i, 8], field[i, 9], field[i, 10], field[i, 12], field[i, 13], field[i, 14],
    )  # fmt: skip


@inlined
def fill_gradient(i, gradients, spans, field):
    """Fill G of `field` from sums over liquid neighbours.

    gradients    factor V times the sums of (v_i - v_j) grad W_ij^T, row by row (9)
    spans        moment matrix of the liquid neighbours
    """
    bxx, bxy, bxz, byy, byz, bzz = inverse(spans)
    for axis in range(3):
        ax, ay, az = gradients[3 * axis], gradients[3 * axis + 1], gradients[3 * axis + 2]
        row = GRADIENT + 4 * axis
        field[i, row] = ax * bxx + ay * bxy + az * bxz
        field[i, row + 1] = ax * bxy + ay * byy + az * byz
        field[i, row + 2] = ax * bxz + ay * byz + az * bzz


@njit(**FAST)
def local_fields(
    begin,
    end,
    points,
    wall,
    period,
    fluid,
    walls,
    sigma,
    support,
    volume,
    plane,
    lattice,
    compression,
    gradient_sum,
    field,
    matrix,
):
    """Fill e (N,), g (3, N) [1/m], G in `field` (N, 16) and `matrix` (N, 8), the Y that `faces` makes of M, as xx, xy, xz, yy, yz, zz.

    points (N, 4): place [m] and weight rho_ref / rho_0; wall (M, 4): place [m] and volume [m3]; `plane`: y is absent. lattice: m_0.
    `field` holds v [m/s]; G is 0 where the liquid neighbours do not span space.
    """
    for i in range(begin, end):
        content, slope, moment, strain = add_liquid(i, points, field, period, fluid, sigma, support, volume)
        if plane:
            moment = moment[0], moment[1], moment[2], ONE, moment[4], moment[5]
        if determinant(moment) > REGULAR:
            fill_gradient(i, strain, moment, field)
        else:
            for n in range(GRADIENT, 16):
                field[i, n] = ZERO
        solid, push, more = ZERO, (ZERO, ZERO, ZERO), (ZERO, ZERO, ZERO, ZERO, ZERO, ZERO)
        if walls.number[i] > 0:
            solid, push, more = add_walls(i, points, wall, period, walls, sigma, support)
        compression[i] = volume * (sigma + content) + solid - ONE
        for axis in range(3):
            gradient_sum[axis, i] = slope[axis] + push[axis]
        whole = (
            moment[0] + more[0], moment[1] + more[1], moment[2] + more[2],
            ONE if plane else moment[3] + more[3], moment[4] + more[4], moment[5] + more[5],
        )  # fmt: skip
        fill_face_matrix(i, whole, lattice, matrix)

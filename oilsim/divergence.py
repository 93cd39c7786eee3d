"""Divergence-free velocity (Qiu et al. 2021, Eq. 7-14), its linear operator, and the gradients that both schemes share.

    C_i(v) = (1 / rho) D rho / Dt = sum_j V_j (v_i - v_j) . grad W_ij                          (Eq. 7 with its sign mended)
    u_i = (1 / rho_i0) sum_j V_j (kappa_i + kappa_j) grad W_ij,   v = v* - u                     (Eq. 14)
    (A kappa)_i = C_i(u),   kappa >= 0,   A kappa - C(v*) >= 0,   complementary

kappa = pressure x time step [Pa s]; here divided by rho_ref [m2/s]. A is symmetric and positive semi-definite, u conserves the
momentum of every pair, and wall particles take the impulse -V kappa_i V_b grad W_ib. With the gradients of all pairs cached,
walls appear only in g_i = sum_j V_j grad W_ij, so that a product visits fluid pairs alone.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.neighbors import nearest_images
from oilsim.parallel import BLOCK
from oilsim.smoothing_kernels import FAST, kernel, kernel_slope

TINY = np.float32(1e-20)
REGULAR = np.float32(0.3)  # smallest determinant of the moment matrix that is still inverted
SPRAY = np.float32(0.6)  # density ratio below which particles may spread freely


@njit(inline="always", **FAST)
def corrected_divergence(m, b, plane):
    """Contraction of the inverse of the symmetric moment matrix m (xx, xy, xz, yy, yz, zz) with b (3x3 row by row).

    Returns sum_ab (m^-1)_ab b_ab, or the trace of b where m is near-singular. `plane`: y is absent.
    """
    xx, xy, xz, yy, yz, zz = m
    if plane:
        yy = np.float32(1.0)
    cxx = yy * zz - yz * yz
    cxy = xz * yz - xy * zz
    cxz = xy * yz - xz * yy
    determinant = xx * cxx + xy * cxy + xz * cxz
    if determinant < REGULAR:
        return b[0] + b[4] + b[8]
    cyy = xx * zz - xz * xz
    cyz = xy * xz - xx * yz
    czz = xx * yy - xy * xy
    contraction = cxx * b[0] + cyy * b[4] + czz * b[8]
    contraction += cxy * (b[1] + b[3]) + cxz * (b[2] + b[6]) + cyz * (b[5] + b[7])
    return contraction / determinant


@njit(**FAST)
def cache_gradients(
    begin, end, position, wall, wall_volume, weight, period, fluid, walls, sigma, support, volume,
    gradient, wall_gradient, gradient_sum, diagonal, density, coverage,
):  # fmt: skip
    """Cache V grad W_ij per fluid pair in `gradient` (3, P) and V_b grad W_ib in `wall_gradient`, and sum them up.

    Fills g_i (3, N) [1/m], the diagonal of A times rho_ref [1/m2], `density` with rho_i / rho_i0 and `coverage` with the walls'
    part of it.
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
            slope = volume * kernel_slope(q, sigma) * inverse_support / r
            ax, ay, az = slope * dx, slope * dy, slope * dz
            gradient[0, k] = ax
            gradient[1, k] = ay
            gradient[2, k] = az
            gx += ax
            gy += ay
            gz += az
            share = ax * ax + ay * ay + az * az
            square += share if weight is None else share * weight[j]
        covered = np.float32(0.0)
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            dx, dy, dz = nearest_images(xi - wall[0, b], yi - wall[1, b], zi - wall[2, b], period)
            r = math.sqrt(dx * dx + dy * dy + dz * dz + TINY)
            q = r * inverse_support
            covered += wall_volume[b] * kernel(q, sigma)
            slope = wall_volume[b] * kernel_slope(q, sigma) * inverse_support / r
            ax, ay, az = slope * dx, slope * dy, slope * dz
            wall_gradient[0, k] = ax
            wall_gradient[1, k] = ay
            wall_gradient[2, k] = az
            gx += ax
            gy += ay
            gz += az
        density[i] = total * volume + covered
        coverage[i] = covered
        gradient_sum[0, i] = gx
        gradient_sum[1, i] = gy
        gradient_sum[2, i] = gz
        own = gx * gx + gy * gy + gz * gz
        diagonal[i] = square + (own if weight is None else own * weight[i]) + TINY


@njit(**FAST)
def divergence_source(
    begin,
    end,
    position,
    velocity,
    period,
    fluid,
    walls,
    gradient,
    gradient_sum,
    density,
    inverse_time_step,
    plane,
    source,
):
    """Fill `source` [1/s] with C_i(v*) for the split scheme, walls at rest (moving ones are added as contacts).

    Away from walls the gradients are corrected (kernel-gradient correction, Bonet & Lok 1999) so that a smooth shear on
    disordered particles has no divergence; spray below SPRAY of the rest density may contract at will.
    """
    for i in range(begin, end):
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        ui, vi, wi = velocity[0, i], velocity[1, i], velocity[2, i]
        if walls.number[i] > 0:
            plain = gradient_sum[0, i] * ui + gradient_sum[1, i] * vi + gradient_sum[2, i] * wi
            for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
                j = fluid.neighbor[k]
                plain -= (
                    gradient[0, k] * velocity[0, j] + gradient[1, k] * velocity[1, j] + gradient[2, k] * velocity[2, j]
                )
        else:
            bxx = bxy = bxz = byx = byy = byz = bzx = bzy = bzz = np.float32(0.0)
            mxx = mxy = mxz = myy = myz = mzz = np.float32(0.0)
            for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
                j = fluid.neighbor[k]
                ax, ay, az = gradient[0, k], gradient[1, k], gradient[2, k]
                dx, dy, dz = nearest_images(xi - position[0, j], yi - position[1, j], zi - position[2, j], period)
                du, dv, dw = ui - velocity[0, j], vi - velocity[1, j], wi - velocity[2, j]
                mxx -= ax * dx
                mxy -= ax * dy
                mxz -= ax * dz
                myy -= ay * dy
                myz -= ay * dz
                mzz -= az * dz
                bxx += ax * du
                bxy += ax * dv
                bxz += ax * dw
                byx += ay * du
                byy += ay * dv
                byz += ay * dw
                bzx += az * du
                bzy += az * dv
                bzz += az * dw
            plain = corrected_divergence(
                (mxx, mxy, mxz, myy, myz, mzz), (bxx, bxy, bxz, byx, byy, byz, bzx, bzy, bzz), plane
            )
        source[i] = plain + min(density[i] - SPRAY, np.float32(0.0)) * inverse_time_step


@njit(**FAST)
def pressure_velocity(begin, end, fluid, gradient, gradient_sum, weight, kappa, change):
    """Fill `change` (3, N) with u_i of Eq. 14 [m/s] from kappa [m2/s]."""
    for i in range(begin, end):
        own = kappa[i]
        ux, uy, uz = own * gradient_sum[0, i], own * gradient_sum[1, i], own * gradient_sum[2, i]
        for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
            other = kappa[fluid.neighbor[k]]
            ux += gradient[0, k] * other
            uy += gradient[1, k] * other
            uz += gradient[2, k] * other
        if weight is not None:
            ux *= weight[i]
            uy *= weight[i]
            uz *= weight[i]
        change[0, i] = ux
        change[1, i] = uy
        change[2, i] = uz


@njit(**FAST)
def velocity_divergence(begin, end, fluid, gradient, gradient_sum, velocity, rate):
    """Fill `rate` [1/s] with C_i of `velocity` (3, N), walls at rest (Eq. 7)."""
    for i in range(begin, end):
        value = gradient_sum[0, i] * velocity[0, i] + gradient_sum[1, i] * velocity[1, i]
        value += gradient_sum[2, i] * velocity[2, i]
        for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
            j = fluid.neighbor[k]
            value -= gradient[0, k] * velocity[0, j] + gradient[1, k] * velocity[1, j] + gradient[2, k] * velocity[2, j]
        rate[i] = value


@njit(**FAST)
def divergence_multiplier(begin, end, rate, diagonal, fluid, time_step, kappa, correction, error):
    """One step of Alg. 1: correction C_i / a_i where density would rise; block sums of dt (C_i)+ go to `error`.

    kappa sums the corrections. Particles with few neighbours are left alone, as in Bender & Koschier 2016: they are spray.
    """
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            error[i // BLOCK] = 0.0
        excess = max(rate[i], np.float32(0.0)) if fluid.number[i] >= 8 else np.float32(0.0)
        correction[i] = excess / diagonal[i]
        kappa[i] += correction[i]
        error[i // BLOCK] += excess * time_step

"""One gentle step towards constant density, even order and quiet velocities; positions never become velocity.

    dx_i = sum_j V (L_i + L_j) grad W_ij + 2 L_i sum_b V_b grad W_ib,    L_i = -(omega e_i / a + beta_i d^2 / 2)
    v_i -= sum_j theta_ij V W_ij 2 rho_j / (rho_i + rho_j) [v_i - v_j + (G_i + G_j) x_ij / 2],    theta_ij = (theta_i + theta_j) / 2

The density constraint of Qiu et al. 2021 (Eq. 15-22) mends a share omega of the error a pass, with the lattice's
a = V^2 sum |grad W|^2 for the diagonal of Eq. 13; what is left is carried to the next step. Inside the liquid the error counts with
both signs; within reach of a free surface only compression counts, and nothing is shifted. beta grows with the strain of the flow
and keeps neighbours evenly spread (particle shifting; Lind et al. 2012). The filter takes off what linear flow cannot explain, so that
shear and rotation pass (`resolved_strain`). Both conserve the momentum of every pair of liquid particles.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.local_fields import ONE, STRAIN, THETA, WEIGHT, ZERO
from oilsim.neighbors import nearest_images
from oilsim.smoothing_kernels import FAST, kernel, kernel_slope_over_q

OMEGA = 0.2  # share of the density error mended a pass
SURFACE = np.float32(0.3)  # |g_i| d from which a particle lies at a free surface
LARGEST_SHIFT = np.float32(0.5)  # beta of any flow
SHIFT_BY_STRAIN = np.float32(15.0)  # beta for each unit of strain x time step


@njit(**FAST)
def mark_surface(begin, end, gradient_sum, spacing, surface):
    """Set `surface` (N,) to 1 where the kernel's gradients do not cancel: at free surfaces and in spray."""
    for i in range(begin, end):
        gx, gy, gz = gradient_sum[0, i] * spacing, gradient_sum[1, i] * spacing, gradient_sum[2, i] * spacing
        surface[i] = np.uint8(gx * gx + gy * gy + gz * gz > SURFACE * SURFACE)


@njit(**FAST)
def mark_near_surface(begin, end, fluid, surface, near):
    """Set `near` (N,) to 1 for surface particles and all that have one among their neighbours."""
    for i in range(begin, end):
        found = surface[i]
        for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
            found |= surface[fluid.neighbor[k]]
        near[i] = found


@njit(**FAST)
def relaxation_multiplier(begin, end, compression, near, field, rate, limit, shift, time_step, multiplier):
    """Fill `multiplier` with L_i [m2]: rate omega / a [m2], limit the largest |L| [m2], shift d^2 / 2 [m2] or 0 for none."""
    for i in range(begin, end):
        error = rate * compression[i]
        if near[i]:
            multiplier[i] = -min(max(error, ZERO), limit)
        else:
            beta = min(SHIFT_BY_STRAIN * time_step * field[i, STRAIN], LARGEST_SHIFT)
            multiplier[i] = -max(min(error, limit), -limit) - beta * shift


@njit(inline="always", **FAST)
def wall_push(i, position, wall, wall_volume, own, period, walls, sigma, inverse_support):
    """2 L_i sum_b V_b grad W_ib [m]."""
    px = py = pz = ZERO
    if own != ZERO:
        factor = np.float32(2.0) * own * inverse_support * inverse_support
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            dx, dy, dz = nearest_images(
                position[0, i] - wall[0, b], position[1, i] - wall[1, b], position[2, i] - wall[2, b], period
            )
            q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
            slope = factor * wall_volume[b] * kernel_slope_over_q(q, sigma)
            px += slope * dx
            py += slope * dy
            pz += slope * dz
    return px, py, pz


@njit(**FAST)
def relax(
    begin, end, position, wall, wall_volume, field, multiplier, filtering, period, fluid, walls, sigma, support, volume,
    push, change,
):  # fmt: skip
    """Fill `push` (3, N) with dx_i [m] and `change` (3, N) with what v_i gains [m/s]; `filtering` or only relaxing."""
    inverse_support = ONE / support
    half = np.float32(0.5)
    for i in range(begin, end):
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        mine = field[i]
        ui, vi, wi, theta, weight = mine[0], mine[1], mine[2], mine[THETA], mine[WEIGHT]
        gxx, gxy, gxz, gyx, gyy, gyz, gzx, gzy, gzz = (
            mine[3], mine[4], mine[5], mine[6], mine[7], mine[8], mine[9], mine[10], mine[11]
        )  # fmt: skip
        own = multiplier[i]
        px = py = pz = sx = sy = sz = ZERO
        for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
            j = fluid.neighbor[k]
            dx, dy, dz = nearest_images(position[0, j] - xi, position[1, j] - yi, position[2, j] - zi, period)
            q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
            slope = (own + multiplier[j]) * kernel_slope_over_q(q, sigma)
            px -= slope * dx
            py -= slope * dy
            pz -= slope * dz
            if filtering:
                other = field[j]
                w = kernel(q, sigma) * (theta + other[THETA]) * weight / (weight + other[WEIGHT])
                sx += w * (
                    ui - other[0] + half * ((gxx + other[3]) * dx + (gxy + other[4]) * dy + (gxz + other[5]) * dz)
                )
                sy += w * (
                    vi - other[1] + half * ((gyx + other[6]) * dx + (gyy + other[7]) * dy + (gyz + other[8]) * dz)
                )
                sz += w * (
                    wi - other[2] + half * ((gzx + other[9]) * dx + (gzy + other[10]) * dy + (gzz + other[11]) * dz)
                )
        factor = volume * inverse_support * inverse_support
        bx, by, bz = wall_push(i, position, wall, wall_volume, own, period, walls, sigma, inverse_support)
        px, py, pz = weight * (factor * px + bx), weight * (factor * py + by), weight * (factor * pz + bz)
        push[0, i], push[1, i], push[2, i] = px, py, pz
        change[0, i] = -volume * sx
        change[1, i] = -volume * sy
        change[2, i] = -volume * sz

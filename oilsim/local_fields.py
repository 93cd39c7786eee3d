"""Everything a particle learns from its neighbourhood in one pass: density, gradients, moments and the noise in its velocity.

e_i   = sum_j V W_ij + sum_b V_b W_ib - 1                     compression (Qiu et al. 2021, Eq. 15 and 16)
g_i   = sum_j V grad W_ij + sum_b V_b grad W_ib               0 inside a liquid, points out of it at a free surface
M_i   = sum_j V grad W_ij x_ij^T + walls                      moment matrix, the unit matrix where gradients are exact; x_ij = x_j - x_i
G_i   = sum_j (v_j - v_i) (L_i V grad W_ij)^T                 velocity gradient, exact for linear fields; L from liquid neighbours alone
r_i   = sum_j V W_ij (v_i - v_j + G_i x_ij)                   what is left of the velocity beside that linear field: noise
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.moments import inverse, smallest_eigenvalue
from oilsim.neighbors import nearest_images
from oilsim.smoothing_kernels import FAST, kernel, kernel_slope_over_q

# columns of `field` (N, 16): v 0-2, G 3-11 row by row, then
NOISE, WEIGHT, STRAIN, THETA = 12, 13, 14, 15
REGULAR = np.float32(0.01)  # determinant of a moment matrix from which a gradient is taken
ZERO, ONE = np.float32(0.0), np.float32(1.0)


@njit(**FAST)
def local_fields(
    begin, end, position, velocity, wall, wall_volume, weight, period, fluid, walls, sigma, support, volume, plane,
    compression, gradient_sum, field, matrix,
):  # fmt: skip
    """Fill e (N,), g (3, N) [1/m], `field` (N, 16) and `matrix` (7, N): M^-1 as xx, xy, xz, yy, yz, zz and M's smallest eigenvalue.

    position, velocity (3, N) [m, m/s]; weight (N,) rho_ref / rho_0 or None; `plane`: y is absent. `field` gets v, G, |r|^2 and the
    weight; G and r are 0 where the liquid neighbours do not span space.
    """
    inverse_support = ONE / support
    scale = -inverse_support * inverse_support
    for i in range(begin, end):
        xi, yi, zi = position[0, i], position[1, i], position[2, i]
        ui, vi, wi = velocity[0, i], velocity[1, i], velocity[2, i]
        total = sigma
        gx = gy = gz = ZERO
        mxx = mxy = mxz = myy = myz = mzz = ZERO
        axx = axy = axz = ayx = ayy = ayz = azx = azy = azz = ZERO
        rx = ry = rz = cx = cy = cz = ZERO
        for k in range(fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])):
            j = fluid.neighbor[k]
            dx, dy, dz = nearest_images(position[0, j] - xi, position[1, j] - yi, position[2, j] - zi, period)
            q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
            w = kernel(q, sigma)
            slope = kernel_slope_over_q(q, sigma)
            ax, ay, az = slope * dx, slope * dy, slope * dz
            du, dv, dw = velocity[0, j] - ui, velocity[1, j] - vi, velocity[2, j] - wi
            total += w
            gx += ax
            gy += ay
            gz += az
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
            rx += w * du
            ry += w * dv
            rz += w * dw
            cx += w * dx
            cy += w * dy
            cz += w * dz
        factor = volume * scale
        total *= volume
        gx, gy, gz = factor * gx, factor * gy, factor * gz
        mxx, mxy, mxz, myy, myz, mzz = (
            factor * mxx,
            factor * mxy,
            factor * mxz,
            factor * myy,
            factor * myz,
            factor * mzz,
        )
        if plane:
            myy = ONE
        row = field[i]
        row[0], row[1], row[2], row[WEIGHT] = ui, vi, wi, ONE if weight is None else weight[i]
        determinant = mxx * (myy * mzz - myz * myz) - mxy * (mxy * mzz - myz * mxz) + mxz * (mxy * myz - myy * mxz)
        if determinant > REGULAR:
            bxx, bxy, bxz, byy, byz, bzz = inverse((mxx, mxy, mxz, myy, myz, mzz))
            bxx, bxy, bxz, byy, byz, bzz = (
                factor * bxx,
                factor * bxy,
                factor * bxz,
                factor * byy,
                factor * byz,
                factor * bzz,
            )
            row[3] = axx * bxx + axy * bxy + axz * bxz
            row[4] = axx * bxy + axy * byy + axz * byz
            row[5] = axx * bxz + axy * byz + axz * bzz
            row[6] = ayx * bxx + ayy * bxy + ayz * bxz
            row[7] = ayx * bxy + ayy * byy + ayz * byz
            row[8] = ayx * bxz + ayy * byz + ayz * bzz
            row[9] = azx * bxx + azy * bxy + azz * bxz
            row[10] = azx * bxy + azy * byy + azz * byz
            row[11] = azx * bxz + azy * byz + azz * bzz
            rx = volume * (row[3] * cx + row[4] * cy + row[5] * cz - rx)
            ry = volume * (row[6] * cx + row[7] * cy + row[8] * cz - ry)
            rz = volume * (row[9] * cx + row[10] * cy + row[11] * cz - rz)
            row[NOISE] = rx * rx + ry * ry + rz * rz
        else:
            for n in range(3, 13):
                row[n] = ZERO
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            dx, dy, dz = nearest_images(wall[0, b] - xi, wall[1, b] - yi, wall[2, b] - zi, period)
            q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
            total += wall_volume[b] * kernel(q, sigma)
            slope = scale * wall_volume[b] * kernel_slope_over_q(q, sigma)
            ax, ay, az = slope * dx, slope * dy, slope * dz
            gx += ax
            gy += ay
            gz += az
            mxx += ax * dx
            mxy += ax * dy
            mxz += ax * dz
            myy += ay * dy
            myz += ay * dz
            mzz += az * dz
        compression[i] = total - ONE
        gradient_sum[0, i], gradient_sum[1, i], gradient_sum[2, i] = gx, gy, gz
        if plane:
            myy = ONE
        moment = (mxx, mxy, mxz, myy, myz, mzz)
        matrix[0, i], matrix[1, i], matrix[2, i], matrix[3, i], matrix[4, i], matrix[5, i] = inverse(moment)
        matrix[6, i] = smallest_eigenvalue(moment)

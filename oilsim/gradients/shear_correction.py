"""Moments of the pressure's pair vectors brought to 1 where particles pass each other.

The matrices Y_i of `faces` make sum_j G_ij x_ij^T, for which linear pressures and flows want the unit matrix, right in the mean of Y_i
and Y_j only. To a change of Y_i the moments answer in full where neighbours change alike, and by a third where changes alternate from one
particle to the next. Three halves of a Jacobi step, the best of all lengths for these two (Richardson 1911), halve what is left of either,

    Y_i += 3/2 s_i (1 - sum_j G_ij x_ij^T),     s_i = min(1, gamma_i t_u),

and shear loses a third of what it lost, vortices a third to a half. Such forces are further from being an energy's gradient and do work
on particles that come back to where they were: with a whole step and s = 1 water at rest, 32 spacings deep, comes to 0.9 % of sqrt(g H)
in half a minute. Where layers pass each other particles do not come back. So the share s_i is how far, of a spacing, they pass in the
unit of time (`time_unit`), with the shear rate gamma_i. Within reach of free surfaces and walls Y_i stays: mended there, pools move twice
as much.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, load, only, root, spread, summed
from oilsim.gradients.gradient_correction import face_between
from oilsim.gradients.relaxation_time import squared_shear_rate
from oilsim.neighborhood.neighbor_search import separations
from oilsim.neighborhood.smoothing_kernels import kernel_slope_over_q

ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
LARGEST = np.float32(0.1)  # change of an entry of Y; in a splash one particle in a hundred would take more
LENGTH = np.float32(1.5)  # of the step, in Jacobi's
STRETCH = 3.0 * float(LARGEST)  # by which pair vectors may be longer for it


@inlined
def limited(change):
    """A change of an entry of Y, LARGEST at most."""
    return max(min(change, LARGEST), -LARGEST)


@njit(**FAST)
def mend_moments(
    begin, end, points, matrix, field, near, unit, plane, period, fluid, walls, sigma, support, volume, mended
):
    """Fill `mended` (N, 8) with the Y_i of the module's docstring from those of `matrix` (N, 8).

    points (N, 4): place [m] and weight; field (N, 16) as from `particle_sums`; near (N,): a free surface is within reach; unit t_u [s];
    `plane`: y is absent.
    """
    inverse_support = ONE / support
    factor = -volume * inverse_support * inverse_support
    for i in range(begin, end):
        for entry in range(8):
            mended[i, entry] = matrix[i, entry]
        if near[i] or walls.number[i] > 0:
            continue
        xx = xy = xz = yy = yz = zz = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            q = only(present, root(dx * dx + dy * dy + dz * dz) * inverse_support, ONE)
            slope = factor * kernel_slope_over_q(q, sigma)
            gx, gy, gz = face_between(matrix, i, j, slope * dx, slope * dy, slope * dz)
            xx += gx * dx
            yy += gy * dy
            zz += gz * dz
            xy += gx * dy + gy * dx
            xz += gx * dz + gz * dx
            yz += gy * dz + gz * dy
        share = LENGTH * min(unit * math.sqrt(squared_shear_rate(field, i)), ONE)
        mended[i, 0] += limited(share * (ONE - summed(xx)))
        mended[i, 1] -= limited(share * HALF * summed(xy))
        mended[i, 2] -= limited(share * HALF * summed(xz))
        mended[i, 3] += ZERO if plane else limited(share * (ONE - summed(yy)))
        mended[i, 4] -= limited(share * HALF * summed(yz))
        mended[i, 5] += limited(share * (ONE - summed(zz)))

"""Correction matrices improved where particles pass each other.

Linear pressures and flows want the moments sum_j G_ij x_ij^T of the pair vectors to be the unit matrix. The matrices Y_i of
`gradient_correction` achieve this only in the mean of Y_i and Y_j. The moments follow a change of Y_i in full where neighbours change
alike, and by a third where the change alternates from one particle to the next. Three halves of a Jacobi step, the best length for these
two (Richardson 1911), halve the rest of either:

    Y_i += 3/2 s_i (1 - sum_j G_ij x_ij^T),     s_i = min(1, gamma_i t_u).

Shear then loses a third of the momentum that it lost, and vortices lose a third to a half of the energy. But such forces are further from
being the gradient of an energy, and do work on particles that come back to where they were: with s = 1 everywhere and a whole Jacobi step,
water at rest, 32 spacings deep, reaches 0.9 % of sqrt(g H) in half a minute. Particles do not come back where layers pass each other. The
share s_i is therefore the way, in spacings, by which layers pass in the unit of time t_u of `relaxation_time`, with the shear rate gamma_i.
Near free surfaces and walls Y_i stays as it is: with this correction there, pools move twice as much.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, HALF, ONE, ZERO, inlined
from oilsim.backend.simd import LANES, below, load, only, root, spread, summed
from oilsim.gradients.gradient_correction import times_mean_correction
from oilsim.gradients.relaxation_time import squared_shear_rate
from oilsim.neighborhood.neighbor_search import separations
from oilsim.neighborhood.smoothing_kernels import kernel_slope_over_q

# [1] largest change of an entry of Y; measured; one particle in a hundred of a splash would take more
LARGEST = np.float32(0.1)
# [1] length of the step in Jacobi steps; theory (Richardson 1911); smooth and alternating changes are repaired alike
LENGTH = np.float32(1.5)
# [1] by how much of their length pair vectors may grow; theory; three entries of a row change by LARGEST
STRETCH = 3.0 * float(LARGEST)


@inlined
def limited(change):
    """Return a change of an entry of Y, limited to LARGEST either way."""
    return max(min(change, LARGEST), -LARGEST)


@njit(**FAST)
def correct_for_shear(begin, end, neighborhood, matrix, flow, surface, unit, plane, repaired):
    """Fill `repaired` with the correction matrices of the module's docstring.

    neighborhood              the `Neighborhood`
    matrix (N, 8)     Y_i of `gradient_correction` [1]
    flow (N, 16)      columns as in `flow`, with the velocity gradients [1/s]
    surface (N,)      uint8, `FreeSurface` of each particle
    unit              t_u [s]
    plane             whether y is absent
    repaired (N, 8)     becomes Y_i after the correction [1]
    """
    points, period, fluid, sigma = neighborhood.points, neighborhood.period, neighborhood.fluid, neighborhood.sigma
    inverse_support = ONE / neighborhood.support
    factor = -neighborhood.volume * inverse_support * inverse_support
    for i in range(begin, end):
        for entry in range(8):
            repaired[i, entry] = matrix[i, entry]
        if surface[i] or neighborhood.walls.number[i] > 0:
            continue
        xx = xy = xz = yy = yz = zz = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            q = only(present, root(dx * dx + dy * dy + dz * dz) * inverse_support, ONE)
            slope = factor * kernel_slope_over_q(q, sigma)
            gx, gy, gz = times_mean_correction(matrix, i, j, slope * dx, slope * dy, slope * dz)
            xx += gx * dx
            yy += gy * dy
            zz += gz * dz
            xy += gx * dy + gy * dx
            xz += gx * dz + gz * dx
            yz += gy * dz + gz * dy
        share = LENGTH * min(unit * math.sqrt(squared_shear_rate(flow, i)), ONE)
        repaired[i, 0] += limited(share * (ONE - summed(xx)))
        repaired[i, 1] -= limited(share * HALF * summed(xy))
        repaired[i, 2] -= limited(share * HALF * summed(xz))
        repaired[i, 3] += ZERO if plane else limited(share * (ONE - summed(yy)))
        repaired[i, 4] -= limited(share * HALF * summed(yz))
        repaired[i, 5] += limited(share * (ONE - summed(zz)))

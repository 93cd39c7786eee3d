"""The pressure that walls take, extrapolated from the liquid beside them.

    p_b = p_i + c_i x_ib . grad p_i,      grad p_i = B_i sum_j G_ij (p_j - p_i),      B_i = (sum_j G_ij x_ij^T)^-1

with the pair vectors G_ij of `pressure_gradient` and x_ij = x_j - x_i. The factor c_i is 0 where liquid neighbours are too few for a
gradient. Walls press as far as they are wet (`wet_walls`). So the water's edge is balanced as the surface far from a wall is, and water
that rises along a wall is not taken for compressed.
"""

from __future__ import annotations

import numpy as np

from oilsim.backend.float32 import HALF, ONE, ZERO
from oilsim.backend.jit import inlined
from oilsim.backend.simd import LANES, below, load, spread, summed
from oilsim.gradients.gradient_correction import times_symmetric
from oilsim.gradients.symmetric_3x3 import inverse, smallest_eigenvalue
from oilsim.neighborhood.neighbor_search import rows, separations

# [1] smallest eigenvalue of the liquid's moment up to which c is 0; tuned; not on record
THIN = np.float32(0.1)
# [1] smallest eigenvalue of the liquid's moment from which c has its full value; tuned; not on record
FULL = np.float32(0.2)


@inlined
def moment_of(i, points, others, period, pairs, gradient):
    """Return sum_k G_ik x_ik^T over the pairs of particle i, row by row (9), in units of the vectors times metres.

    points, others (rows, 4) begin with the places [m] of the particles and of their neighbours; gradient (3, P): pair vectors.
    """
    gradient_x, gradient_y, gradient_z = rows(gradient)
    txx = txy = txz = tyx = tyy = tyz = tzx = tzy = tzz = spread(ZERO)
    first, last = pairs.start[i], pairs.start[i] + np.int64(pairs.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        dx, dy, dz, _ = separations(i, points, others, load(pairs.neighbor, k, present), period)
        ax, ay, az = load(gradient_x, k, present), load(gradient_y, k, present), load(gradient_z, k, present)
        txx -= ax * dx
        txy -= ax * dy
        txz -= ax * dz
        tyx -= ay * dx
        tyy -= ay * dy
        tyz -= ay * dz
        tzx -= az * dx
        tzy -= az * dy
        tzz -= az * dz
    return (
        summed(txx),
        summed(txy),
        summed(txz),
        summed(tyx),
        summed(tyy),
        summed(tyz),
        summed(tzx),
        summed(tzy),
        summed(tzz),
    )


@inlined
def scaled(factor, m):
    """Return a factor times a matrix m (9,), in their unit, as nine numbers."""
    return (
        factor * m[0], factor * m[1], factor * m[2], factor * m[3], factor * m[4], factor * m[5], factor * m[6], factor * m[7],
        factor * m[8],
    )  # fmt: skip


@inlined
def symmetric(m, unit):
    """Return the symmetric part of a matrix m (9,), in its unit, as xx, xy, xz, yy, yz, zz, with `unit` added to yy."""
    return (
        m[0], HALF * (m[1] + m[3]), HALF * (m[2] + m[6]), m[4] + unit, HALF * (m[5] + m[7]), m[8],
    )  # fmt: skip


@inlined
def spanned_share(own):
    """Return s_i, how far the liquid's moment (six numbers) suffices for a gradient, from 0 to 1."""
    return max(min((smallest_eigenvalue(own) - THIN) / (FULL - THIN), ONE), ZERO)


@inlined
def extrapolation_matrix(trust, own):
    """Return trust times B_i as six numbers, from the liquid's moment (six numbers)."""
    if trust <= ZERO:
        return ZERO, ZERO, ZERO, ZERO, ZERO, ZERO
    xx, xy, xz, yy, yz, zz = inverse(own)
    return trust * xx, trust * xy, trust * xz, trust * yy, trust * yz, trust * zz


@inlined
def fill_wall_pressure(i, hood, vectors, inside, plane, by_body, extrapolation, lever):
    """Fill row i of `extrapolation` (N, 9) with K_i of `pressure_gradient` [1], row by row, and row i of `lever` beside a moving body.

    hood              the `Neighborhood`
    vectors           `PressureVectors`, whose pair vectors of particle i are cached already
    inside            sum_j G_ij [1/m] (3)
    plane             whether y is absent
    by_body (N,)      whether a moving body is within reach
    lever (N, 9)      becomes c_i B_i, as six numbers [1], and sum_j G_ij [1/m], for `rigid_response`; None where no body moves
    """
    solid = moment_of(i, hood.points, hood.wall_points, hood.period, hood.walls, vectors.wall_gradient)
    liquid = scaled(
        vectors.gradient.quantum,
        moment_of(i, hood.points, hood.points, hood.period, hood.fluid, vectors.gradient.whole),
    )
    own = symmetric(liquid, ONE if plane else ZERO)
    gain = extrapolation_matrix(spanned_share(own), own)
    if lever is not None and by_body[i]:
        for entry in range(6):
            lever[i, entry] = gain[entry]
        for axis in range(3):
            lever[i, 6 + axis] = inside[axis]
    for row in range(3):
        kx, ky, kz = times_symmetric(solid[3 * row], solid[3 * row + 1], solid[3 * row + 2], gain)
        extrapolation[i, 3 * row], extrapolation[i, 3 * row + 1], extrapolation[i, 3 * row + 2] = kx, ky, kz

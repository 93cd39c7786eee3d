"""The pressure that walls take, extrapolated from the liquid beside them.

    p_b = p_i + c_i x_ib . grad p_i,      grad p_i = B_i sum_j G_ij (p_j - p_i),      B_i = (sum_j G_ij x_ij^T)^-1      (see `divergence`)

c fades to 0 where liquid neighbours are too few for a gradient, and at the free surface beside walls at rest: its transpose, which makes
the divergence, would take water that rises along a wall for water that is compressed, and waves of 64 spacings would run 0.5 % faster.
Without it walls pull the water's edge down by 0.25 rho g d^2 a metre, which makes the pressure in a pool of 12 spacings' width a tenth
of a spacing too high. So they hold the edge by the gradient that a free surface must have, across itself and from weight alone,

    v_i -= dt s_i (1 - o_i) N_i n_i (n_i . g),      N_i = sum_b G_ib x_ib^T,      n_i the surface's normal,      c_i = s_i o_i,

s by how the liquid's neighbours span space, o by how covered the particle is, as far as the liquid is under pressure. A sheet that falls
along a wall has its normal across gravity, and is not held.
Bodies keep c at the surface: the uppermost particles would press their dry part up, and they would ride high.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, load, spread, summed
from oilsim.gradients.gradient_correction import times_symmetric
from oilsim.gradients.symmetric_3x3 import inverse, smallest_eigenvalue
from oilsim.neighborhood.neighbor_search import rows, separations

ZERO, ONE, THREE, HALF = np.float32(0.0), np.float32(1.0), np.float32(3.0), np.float32(0.5)
THIN, FULL = np.float32(0.1), np.float32(0.2)  # smallest eigenvalue of the liquid's moment, between which c rises
OPEN, COVERED = np.float32(0.7), np.float32(0.95)  # of that of liquid and walls: 1 inside, a half at a free surface
FLAT = np.float32(0.25)  # |S| H that tells a free surface by half, S the sum of G_ij and G_ib: 1.5 at a flat one
PRESSED = 0.25  # spacings of depth whose pressure makes an edge fully held


@inlined
def moment_of(i, points, others, period, pairs, gradient):
    """sum_k G_ik x_ik^T over the pairs of i, row by row (9), in units of what is cached."""
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
    """factor m for a matrix of nine."""
    return (
        factor * m[0], factor * m[1], factor * m[2], factor * m[3], factor * m[4], factor * m[5], factor * m[6], factor * m[7],
        factor * m[8],
    )  # fmt: skip


@inlined
def symmetric(m, unit):
    """The symmetric part of nine rows as six, with `unit` added to yy."""
    return (
        m[0], HALF * (m[1] + m[3]), HALF * (m[2] + m[6]), m[4] + unit, HALF * (m[5] + m[7]), m[8],
    )  # fmt: skip


@inlined
def spanned_share(own):
    """How far the liquid's moment suffices for a gradient, 0 to 1."""
    return max(min((smallest_eigenvalue(own) - THIN) / (FULL - THIN), ONE), ZERO)


@inlined
def covered_share(own, wall):
    """How far liquid and walls surround the particle, 0 at a free surface to 1."""
    whole = (
        own[0] + wall[0], own[1] + wall[1], own[2] + wall[2], own[3] + wall[3], own[4] + wall[4], own[5] + wall[5],
    )  # fmt: skip
    part = max(min((smallest_eigenvalue(whole) - OPEN) / (COVERED - OPEN), ONE), ZERO)
    return part * part * (THREE - part - part)


@inlined
def extrapolation_matrix(trust, own):
    """trust B from the liquid's moment (six)."""
    if trust <= ZERO:
        return ZERO, ZERO, ZERO, ZERO, ZERO, ZERO
    xx, xy, xz, yy, yz, zz = inverse(own)
    return trust * xx, trust * xy, trust * xz, trust * yy, trust * yz, trust * zz


@inlined
def fill_wall_pressure(
    i, points, wall, period, fluid, walls, gradient, wall_gradient, by_body, plane, gravity, inside, outside, inverse_support,
    extrapolation, waterline, lever,
):  # fmt: skip
    """Fill row i of `extrapolation` (N, 9) with K_i, row by row, and of `waterline` (3, N) with the acceleration of an edge [m/s2].

    inside, outside: sum_j G_ij and sum_b G_ib [1/m], whose sum S points into the liquid at a free surface; `plane`: y is absent; gravity
    (3) [m/s2]. Where by_body (N,) tells that a moving body is within reach row i of `lever` (N, 9) becomes c_i B_i, as six, and `inside`,
    for `rigid_response`; None where no body moves.
    """
    solid = moment_of(i, points, wall, period, walls, wall_gradient)
    liquid = scaled(gradient.quantum, moment_of(i, points, points, period, fluid, gradient.whole))
    own = symmetric(liquid, ONE if plane else ZERO)
    spanned = spanned_share(own)
    covered = ONE if by_body[i] else covered_share(own, symmetric(solid, ZERO))
    gain = extrapolation_matrix(spanned * covered, own)
    if lever is not None and by_body[i]:
        for entry in range(6):
            lever[i, entry] = gain[entry]
        for axis in range(3):
            lever[i, 6 + axis] = inside[axis]
    nx, ny, nz = inside[0] + outside[0], inside[1] + outside[1], inside[2] + outside[2]
    flat = FLAT * inverse_support
    across = (nx * gravity[0] + ny * gravity[1] + nz * gravity[2]) / (nx * nx + ny * ny + nz * nz + flat * flat)
    across *= spanned * (ONE - covered)
    for row in range(3):
        mx, my, mz = solid[3 * row], solid[3 * row + 1], solid[3 * row + 2]
        kx, ky, kz = times_symmetric(mx, my, mz, gain)
        extrapolation[i, 3 * row], extrapolation[i, 3 * row + 1], extrapolation[i, 3 * row + 2] = kx, ky, kz
        waterline[row, i] = -across * (mx * nx + my * ny + mz * nz)


@njit(**FAST)
def hold_waterline(begin, end, walls, waterline, kappa, pressed, time_step, velocity):
    """Add to `velocity` (3, N) what walls at rest give the water's edge, all of it where kappa was `pressed` [m2/s] or more."""
    for i in range(begin, end):
        if walls.number[i] > 0:
            share = time_step * min(kappa[i] / pressed, ONE)
            velocity[0, i] += share * waterline[0, i]
            velocity[1, i] += share * waterline[1, i]
            velocity[2, i] += share * waterline[2, i]

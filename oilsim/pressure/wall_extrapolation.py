"""The pressure that walls take, extrapolated from the liquid beside them.

    p_b = p_i + c_i x_ib . grad p_i,      grad p_i = B_i sum_j G_ij (p_j - p_i),      B_i = (sum_j G_ij x_ij^T)^-1

with the pair vectors G_ij of `pressure_gradient` and x_ij = x_j - x_i. The factor c_i is 0 where liquid neighbours are too few for a
gradient, and at the free surface beside walls at rest: its transpose makes the divergence, and would take water that rises along a wall for
water that is compressed, and waves of 64 spacings would run 0.5 % faster.

Without extrapolation walls pull the water's edge down by 0.25 rho g d^2 a metre, and the pressure in a pool of 12 spacings' width is that
of a tenth of a spacing more. So walls hold the edge by the gradient that a free surface must have, across itself and from weight alone:

    v_i -= dt s_i (1 - o_i) N_i n_i (n_i . g),      N_i = sum_b G_ib x_ib^T,      n_i: normal of the surface,      c_i = s_i o_i.

s_i tells how well the liquid neighbours span space, and o_i how far the particle is covered. The hold counts as far as the liquid is
under pressure. The normal of a sheet that falls along a wall is across gravity, and the sheet is not held. Beside bodies c_i stays as it
is at the surface: the uppermost particles would press on the dry part of bodies, and these would ride high.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.arrays import Real
from oilsim.backend.jit import FAST, HALF, ONE, THREE, ZERO, inlined
from oilsim.gradients.gradient_correction import inverse, smallest_eigenvalue, times_symmetric

# [1] smallest eigenvalue of the liquid's moment up to which c is 0; tuned; not on record
THIN = np.float32(0.1)
# [1] smallest eigenvalue of the liquid's moment from which c has its full value; tuned; not on record
FULL = np.float32(0.2)
# [1] smallest eigenvalue of the moment of liquid and walls up to which a particle counts as open; measured; a free surface has a half
OPEN = np.float32(0.7)
# [1] smallest eigenvalue of the moment of liquid and walls from which a particle counts as covered; measured; inside it is 1
COVERED = np.float32(0.95)
# [1] |S| H that tells a free surface by half, S the sum of pair vectors G_ij and G_ib; measured; a flat surface has 1.5
FLAT = np.float32(0.25)
# [d] depth whose pressure makes an edge fully held; tuned; not on record
PRESSED = 0.25


class WallPressure(NamedTuple):
    """The terms by which the particles of a step press on the walls beside them.

    extrapolation (N, 9)    K_i of `pressure_gradient`, row by row [1]
    waterline (3, N)        acceleration by which walls at rest hold the water's edge [m/s2]
    """

    extrapolation: Real
    waterline: Real


@inlined
def symmetric(m):
    """Return the symmetric part of a matrix m (9,), in its unit, as xx, xy, xz, yy, yz, zz."""
    return m[0], HALF * (m[1] + m[3]), HALF * (m[2] + m[6]), m[4], HALF * (m[5] + m[7]), m[8]


@inlined
def spanned_share(own):
    """Return s_i, how far the liquid's moment (six numbers) suffices for a gradient, from 0 to 1."""
    return max(min((smallest_eigenvalue(own) - THIN) / (FULL - THIN), ONE), ZERO)


@inlined
def covered_share(own, wall):
    """Return o_i [1], how far liquid and walls surround the particle, from 0 at a free surface to 1.

    own, wall: moments of the liquid and of the walls, (6,) each [1]: xx, xy, xz, yy, yz, zz.
    """
    whole = (
        own[0] + wall[0], own[1] + wall[1], own[2] + wall[2], own[3] + wall[3], own[4] + wall[4], own[5] + wall[5],
    )  # fmt: skip
    part = max(min((smallest_eigenvalue(whole) - OPEN) / (COVERED - OPEN), ONE), ZERO)
    return part * part * (THREE - part - part)


@inlined
def extrapolation_matrix(trust, own):
    """Return trust times B_i as six numbers, from the liquid's moment (six numbers)."""
    if trust <= ZERO:
        return ZERO, ZERO, ZERO, ZERO, ZERO, ZERO
    xx, xy, xz, yy, yz, zz = inverse(own)
    return trust * xx, trust * xy, trust * xz, trust * yy, trust * yz, trust * zz


@inlined
def fill_wall_pressure(i, liquid, wall, gravity, support, by_body, wall_pressure, lever):
    """Fill row i of `wall_pressure`, and of `lever` beside a moving body.

    liquid            sum_j G_ij [1/m], three numbers, and the symmetric part of sum_j G_ij x_ij^T [1], six; xx, xy, xz, yy, yz, zz
    wall              sum_b G_ib [1/m], which with the liquid's points into the liquid at a free surface, and sum_b G_ib x_ib^T [1], nine
    gravity, support  g (3) [m/s2]; support radius H [m]
    by_body (N,)      whether a moving body is within reach
    wall_pressure     `WallPressure`
    lever (N, 9)      becomes c_i B_i, as six numbers [1], and sum_j G_ij [1/m], for `rigid_response`; None where no body moves
    """
    (inside, own), (outside, solid) = liquid, wall
    spanned = spanned_share(own)
    covered = ONE if by_body[i] else covered_share(own, symmetric(solid))
    gain = extrapolation_matrix(spanned * covered, own)
    if lever is not None and by_body[i]:
        for entry in range(6):
            lever[i, entry] = gain[entry]
        for axis in range(3):
            lever[i, 6 + axis] = inside[axis]
    nx, ny, nz = inside[0] + outside[0], inside[1] + outside[1], inside[2] + outside[2]
    flat = FLAT * (ONE / support)
    across = (nx * gravity[0] + ny * gravity[1] + nz * gravity[2]) / (nx * nx + ny * ny + nz * nz + flat * flat)
    across *= spanned * (ONE - covered)
    extrapolation, waterline = wall_pressure
    for row in range(3):
        mx, my, mz = solid[3 * row], solid[3 * row + 1], solid[3 * row + 2]
        kx, ky, kz = times_symmetric(mx, my, mz, gain)
        extrapolation[i, 3 * row], extrapolation[i, 3 * row + 1], extrapolation[i, 3 * row + 2] = kx, ky, kz
        waterline[row, i] = -across * (mx * nx + my * ny + mz * nz)


@njit(**FAST)
def hold_waterline(begin, end, walls, waterline, kappa, pressed, time_step, velocity):
    """Add to velocity (3, N) [m/s] what walls at rest give the water's edge.

    walls: lists of wall neighbours; waterline (3, N) [m/s2]; kappa (N,): pressure of the last step [m2/s], of which `pressed` [m2/s] or
    more holds the edge in full; time_step [s].
    """
    for i in range(begin, end):
        if walls.number[i] > 0:
            share = time_step * max(min(kappa[i] / pressed, ONE), ZERO)  # suction, in a filled box, holds nothing
            velocity[0, i] += share * waterline[0, i]
            velocity[1, i] += share * waterline[1, i]
            velocity[2, i] += share * waterline[2, i]

"""The correction matrices Y_i of the pair vectors, by which the pressure acts.

    G_ij = (Y_i + Y_j) / 2 V grad W_ij,       G_ib = (Y_i + 1 / m_0) / 2 V_b grad W_ib                    pair vectors [1/m]
    Y_i = (1 - z) / m_0 + z M_i^-1,           z = x smoothstep(lambda_i; THIN, FULL)                      correction matrix [1]

M_i is the moment matrix of `particle_sums`, lambda_i its smallest eigenvalue, and m_0 the moment of a lattice.

With Y = M^-1 gradients of linear pressures and divergences of linear flows are exact in the mean of Y_i and Y_j (Lanson and Vila 2008,
Hopkins 2015). With Y = 1 / m_0 the force is the gradient of an energy, and water at rest is an elastic solid: its particles are pressed
into a crystal, which resists shear with a modulus of the order of the pressure. Waves of 5 % steepness then run 4 to 5 % too fast at any
spacing.

The force of M^-1 alone is the gradient of no energy. It does work on particles that come back to where they were, and deep water that is
left to itself circulates ever faster: a plane column of 64 spacings, as wide as deep, reaches 1 % of sqrt(g H) after 70 s. A twentieth of
the elastic force holds it at 0.4 %, and changes a wave of 64 spacings by less than 0.2 %. EXACT leaves that twentieth. It also stiffens
waves between liquids, which buoyancy drives back only weakly (`docs/tried.md`).

The elastic force resists shear by some 3e-4 of the pressure. A thick liquid that moves slowly has less stress than that, and a cylinder led
down through it feels a third too much drag with 4 spacings of diameter. But it needs no such force, because viscosity stills what the
pressure drives. So where viscosity stills the finest motion faster than the filter of noise does, the elastic share falls in proportion:

    1 - x = (1 - EXACT) min(1, rate of the filter / rate of viscosity),     rates 1 / (SETTLING t_u) and FINEST nu / d^2.

Walls are a lattice and have the lattice's matrix. With Y_i in its place water in a tank moves twice as much at rest. Where M is nearly
singular, in spray and in thin films, Y fades to the lattice's matrix too.

Determinant, inverse and smallest eigenvalue of symmetric 3x3 matrices, given as six numbers xx, xy, xz, yy, yz, zz.

Where particles pass each other the matrices are improved. Linear pressures and flows want the moments sum_j G_ij x_ij^T of the pair
vectors to be the unit matrix. The matrices Y_i above achieve this only in the mean of Y_i and Y_j. The moments follow a change of Y_i in
full where neighbours change alike, and by a third where the change alternates from one particle to the next. Three halves of a Jacobi step,
the best length for these two (Richardson 1911), halve the rest of either:

    Y_i += 3/2 s_i (1 - sum_j G_ij x_ij^T),     s_i = min(1, gamma_i t_u).

Shear then loses a third of the momentum that it lost, and vortices lose a third to a half of the energy. But such forces are further from
being the gradient of an energy, and do work on particles that come back to where they were: with s = 1 everywhere and a whole Jacobi step,
water at rest, 32 spacings deep, reaches 0.9 % of sqrt(g H) in half a minute. Particles do not come back where layers pass each other. The
share s_i is therefore the way, in spacings, by which layers pass in the unit of time t_u of `relaxation_time`, with the shear rate gamma_i.
Near free surfaces and walls Y_i stays as it is: with this correction there, pools move twice as much.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, HALF, ONE, THREE, TWO, ZERO, inlined
from oilsim.backend.simd import LANES, below, gather_four, load, only, root, spread, summed
from oilsim.gradients.relaxation_time import squared_shear_rate
from oilsim.neighborhood.neighbor_search import separations
from oilsim.neighborhood.smoothing_kernels import kernel_slope_over_q

# [1] added to denominators that may vanish; theory; far below what moment matrices of 1 are rounded by
TINY = np.float32(1e-12)
# [1] coefficients of a polynomial for cos((2 asin s + 2 pi) / 3) on 0 <= s <= 1; theory (Chebyshev interpolation); error below 2e-7
THIRD = tuple(np.float32(c) for c in (-0.5000002, -0.5773319, 0.1108055, -0.0514748, 0.0263997, -0.0105018, 0.0021035))


@inlined
def determinant(m):
    """Return the determinant of m."""
    xx, xy, xz, yy, yz, zz = m
    return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)


@inlined
def inverse(m):
    """Return the inverse of m as six numbers; it grows without bound as m becomes singular."""
    xx, xy, xz, yy, yz, zz = m
    cxx, cxy, cxz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    factor = np.float32(1.0) / (xx * cxx + xy * cxy + xz * cxz + TINY)
    return (
        factor * cxx,
        factor * cxy,
        factor * cxz,
        factor * (xx * zz - xz * xz),
        factor * (xy * xz - xx * yz),
        factor * (xx * yy - xy * xy),
    )


@inlined
def smallest_eigenvalue(m):
    """Return the smallest eigenvalue of m, by the trigonometric solution of its characteristic cubic (Smith 1961).

    The function cos((acos c + 2 pi) / 3) is smooth in s = sqrt((1 - c) / 2). The polynomial THIRD in s replaces its slow calls.
    """
    xx, xy, xz, yy, yz, zz = m
    mean = (xx + yy + zz) / np.float32(3.0)
    ax, ay, az = xx - mean, yy - mean, zz - mean
    across = xy * xy + xz * xz + yz * yz
    size = math.sqrt((ax * ax + ay * ay + az * az + np.float32(2.0) * across) / np.float32(6.0)) + TINY
    determinant = ax * (ay * az - yz * yz) - xy * (xy * az - yz * xz) + xz * (xy * yz - ay * xz)
    cosine = determinant / (np.float32(2.0) * size * size * size)
    s = math.sqrt(max(min(np.float32(0.5) - np.float32(0.5) * cosine, np.float32(1.0)), np.float32(0.0)))
    third = THIRD[0] + s * (THIRD[1] + s * (THIRD[2] + s * (THIRD[3] + s * (THIRD[4] + s * (THIRD[5] + s * THIRD[6])))))
    return mean + np.float32(2.0) * size * third


# [1] smallest eigenvalue of M up to which Y is the lattice's; tuned; not on record
THIN = np.float32(0.6)
# [1] smallest eigenvalue of M from which Y has its full share of M^-1; tuned; not on record
FULL = np.float32(0.9)
# [1] share of M^-1 inside a thin liquid; measured; a half calms plane columns no more than this does, and waves run 2 to 3 % faster
EXACT = np.float32(0.95)


class CorrectionShares(NamedTuple):
    """The moment m_0 of a lattice [1], the share x of M^-1 in each particle's liquid (N,) [1], and whether y is absent."""

    lattice_moment: np.float32
    exact: NDArray[np.float32]
    plane: bool


def exact_share(damping: float) -> float:
    """Return the share x [1] of M^-1 in a liquid whose viscosity stills the finest motion `damping` [1] times as fast as the filter."""
    return 1.0 - (1.0 - float(EXACT)) / max(1.0, damping)


@inlined
def fill_correction(i, moment, shares, matrix):
    """Fill row i of matrix (N, 8) with Y_i [1], as xx, xy, xz, yy, yz, zz.

    moment: M_i [1] as six numbers; shares: `CorrectionShares`.
    """
    lattice_moment = shares.lattice_moment
    z = max(min((smallest_eigenvalue(moment) - THIN) / (FULL - THIN), ONE), ZERO)
    z *= shares.exact[i] * z * (THREE - TWO * z)
    plain = (ONE - z) / lattice_moment
    if z <= ZERO:
        moment = (ONE, ZERO, ZERO, ONE, ZERO, ONE)
    xx, xy, xz, yy, yz, zz = inverse(moment)
    matrix[i, 0], matrix[i, 1], matrix[i, 2] = plain + z * xx, z * xy, z * xz
    matrix[i, 3], matrix[i, 4], matrix[i, 5] = plain + z * yy, z * yz, plain + z * zz


def largest_stretch(lattice_moment: float, exact: float) -> float:
    """Return the most [1] by which Y, and so the mean of two, lengthens a vector: the greatest over the fade, for m_0 and a share x."""
    eigenvalue = np.linspace(THIN, FULL, 101)
    z = (eigenvalue - THIN) / (FULL - THIN)
    z *= exact * z * (3.0 - 2.0 * z)
    return max(1.0, float(((1.0 - z) / lattice_moment + z / eigenvalue).max()))


@inlined
def times_symmetric(vx, vy, vz, m):
    """Return m v, which is v m too, for a symmetric matrix m (6,) in its unit: xx, xy, xz, yy, yz, zz; v = (vx, vy, vz)."""
    return (
        vx * m[0] + vy * m[1] + vz * m[2],
        vx * m[1] + vy * m[3] + vz * m[4],
        vx * m[2] + vy * m[4] + vz * m[5],
    )


@inlined
def times_mean_correction(matrix, i, j, ax, ay, az):
    """Return (Y_i + Y_j) / 2 a for lanes of fluid neighbours j, in the unit of a; matrix (N, 8): Y [1], as from `fill_correction`."""
    xx, xy, xz, yy = gather_four(matrix, j, 0)
    yz, zz, _, _ = gather_four(matrix, j, 4)
    ax, ay, az = HALF * ax, HALF * ay, HALF * az
    both = (
        matrix[i, 0] + xx,
        matrix[i, 1] + xy,
        matrix[i, 2] + xz,
        matrix[i, 3] + yy,
        matrix[i, 4] + yz,
        matrix[i, 5] + zz,
    )
    return times_symmetric(ax, ay, az, both)


@inlined
def mean_correction_at_walls(matrix, i, lattice_moment):
    """Return (Y_i + 1 / m_0) / 2 [1] as six numbers; matrix (N, 8) as from `fill_correction`, lattice_moment: m_0 [1]."""
    lattice = ONE / lattice_moment
    return (
        HALF * (matrix[i, 0] + lattice), HALF * matrix[i, 1], HALF * matrix[i, 2],
        HALF * (matrix[i, 3] + lattice), HALF * matrix[i, 4], HALF * (matrix[i, 5] + lattice),
    )  # fmt: skip


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

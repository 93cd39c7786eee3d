"""The pressure's force on velocities and its adjoint, the divergence (Qiu et al. 2021, Eq. 7-14).

    u_i = (rho_ref / rho_i0) (H kappa)_i,   v = v* - u,   (A kappa)_i = (H^T u)_i,   kappa >= 0,  A kappa - H^T v* >= 0, complementary.

kappa = pressure x time step / rho_ref [m2/s]. Both schemes share the form, with pair vectors G_ij = -G_ji [1/m]:

    (H kappa)_i = sum_j G_ij (kappa_i + kappa_j) + sum_b G_ib (w kappa_i + c_i x_ib . grad kappa_i)     [m/s]
    (H^T v)_i   = sum_j G_ij . (v_i - v_j) + ...    the exact transpose, the rate of compression        [1/s]

paper   G_ij = V grad W_ij, G_ib = V_b grad W_ib, w = 1, c = 0                                          (Eq. 7 and 14, sign repaired)
split   G_ij = (Y_i + Y_j) / 2 V grad W_ij, G_ib likewise with V_b and the lattice's Y (`gradient_correction`), w = 2 and c = 1: a wall
        takes the pressure that the liquid's gradient extrapolates to it. A linear pressure is then balanced near walls as it is inside,
        and water lies still. c fades to 0 where liquid neighbours are too few for a gradient, and at the free surface beside walls at
        rest (`wall_extrapolation`). There its transpose would hold the water's edge, and waves would lose three times as much.

The gradient at i comes from its liquid neighbours, B_i sum_j G_ij (kappa_j - kappa_i), B_i = (sum_j G_ij x_ij^T)^-1. The walls' part is
therefore K_i (sum_j G_ij kappa_j - kappa_i sum_j G_ij), with one matrix K_i = c_i sum_b G_ib x_ib^T B_i for each particle:

    (H kappa)_i = own_i kappa_i + (1 + K_i) sum_j G_ij kappa_j,     own_i = (1 - K_i) sum_j G_ij + w sum_b G_ib
    (H^T v)_i   = own_i . v_i - sum_j G_ij . (1 + K_j)^T v_j        x_ij = x_j - x_i

A = H^T (rho_ref / rho_0) H is symmetric and positive semi-definite, and walls take exactly what the liquid loses.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.arrays import Real
from oilsim.backend.jit import FAST, HALF, ONE, TWO, ZERO, inlined
from oilsim.backend.simd import LANES, below, gather, gather_four, load, only, root, rounded, spread, store, summed
from oilsim.backend.thread_team import BLOCK
from oilsim.gradients.gradient_correction import mean_correction_at_walls, times_mean_correction, times_symmetric
from oilsim.neighborhood.neighbor_search import rows, separations
from oilsim.neighborhood.smoothing_kernels import kernel, kernel_slope_over_q
from oilsim.pressure.wall_extrapolation import fill_wall_pressure

# [1/m2] added to the diagonal, which vanishes for a lone particle; theory; far below the diagonal of a particle with one neighbour
TINY = np.float32(1e-20)
# [1] neighbours below which the paper's scheme takes a particle for spray and leaves it alone; paper (Bender and Koschier 2016); not on
# record
FEWEST = 8


class PairVectors(NamedTuple):
    """A vector for every fluid pair: `whole` (3, P), int16, times `quantum` [1/m].

    The products wait for memory, which delivers 16 bits twice as fast as 32. The rounded vectors of the two of a pair are exactly opposite.
    """

    whole: NDArray[np.int16]
    quantum: np.float32


class PressureVectors(NamedTuple):
    """Vectors of the pressure's force H.

    gradient                G_ij of fluid pairs, as `PairVectors` [1/m]
    wall_gradient (3, Q)    G_ib of wall pairs [1/m]
    own (3, N)              own_i, the factor of the particle's own pressure [1/m]
    """

    gradient: PairVectors
    wall_gradient: Real
    own: Real


class PressureSums(NamedTuple):
    """Sums for each particle that come with the pair vectors.

    diagonal (N,)           that of A [1/m2]
    openness (N,)           rho_ref / rho_0 |H 1|^2 [1/m2], large at a free surface
    coverage (N,)           sum_b V_b W_ib, the walls' share of the kernel [1]
    wall_slope (3, N)       sum_b G_ib [1/m]
    """

    diagonal: Real
    openness: Real
    coverage: Real
    wall_slope: Real


class PressureConstants(NamedTuple):
    """Constants of the pressure's force.

    lattice_moment    m_0, moment of a lattice [1]
    wall_weight       w [1]
    plane             whether y is absent
    gravity           g (3) [m/s2]
    """

    lattice_moment: np.float32
    wall_weight: np.float32
    plane: bool
    gravity: tuple[np.float32, ...]


@inlined
def load_vector(vectors, k, present):
    """Return lanes of three components [1/m] from entry k on; vectors: `PairVectors`."""
    quantum = vectors.quantum
    return (
        quantum * load(vectors.whole[0], k, present), quantum * load(vectors.whole[1], k, present),
        quantum * load(vectors.whole[2], k, present),
    )  # fmt: skip


@inlined
def store_vector(vectors, k, present, ax, ay, az):
    """Store lanes of three components ax, ay, az to `vectors` (3, P), in their unit, from entry k on."""
    store(vectors[0], k, present, ax)
    store(vectors[1], k, present, ay)
    store(vectors[2], k, present, az)


@inlined
def cache_wall_gradients(i, neighborhood, matrix, lattice_moment, wall_gradient):
    """Fill wall_gradient (3, Q) with G_ib [1/m] of particle i.

    neighborhood: `Neighborhood`; matrix (N, 8): Y_i [1], or None for 1; lattice_moment: m_0 [1]. Returns the coverage sum_b V_b W_ib [1],
    the sum of the vectors [1/m] (3) and their moment sum_b G_ib x_ib^T [1], row by row (9).
    """
    wall, period, walls = neighborhood.wall_points, neighborhood.period, neighborhood.walls
    inverse_support = ONE / neighborhood.support
    factor = inverse_support * inverse_support
    if matrix is not None:
        correction = mean_correction_at_walls(matrix, i, lattice_moment)
    cover = wx = wy = wz = txx = txy = txz = tyx = tyy = tyz = tzx = tzy = tzz = spread(ZERO)
    first, last = walls.start[i], walls.start[i] + np.int64(walls.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        b = load(walls.neighbor, k, present)
        dx, dy, dz, volume = separations(i, neighborhood.points, wall, b, period)
        q = root(dx * dx + dy * dy + dz * dz) * inverse_support
        content = only(present, volume, ZERO)
        cover += content * kernel(q, neighborhood.sigma)
        slope = factor * content * kernel_slope_over_q(q, neighborhood.sigma)
        ax, ay, az = slope * dx, slope * dy, slope * dz
        if matrix is not None:
            ax, ay, az = times_symmetric(ax, ay, az, correction)
        store_vector(wall_gradient, k, present, ax, ay, az)
        wx += ax
        wy += ay
        wz += az
        txx -= ax * dx
        txy -= ax * dy
        txz -= ax * dz
        tyx -= ay * dx
        tyy -= ay * dy
        tyz -= ay * dz
        tzx -= az * dx
        tzy -= az * dy
        tzz -= az * dz
    moment = (
        summed(txx), summed(txy), summed(txz), summed(tyx), summed(tyy), summed(tyz), summed(tzx), summed(tzy), summed(tzz),
    )  # fmt: skip
    return summed(cover), (summed(wx), summed(wy), summed(wz)), moment


@njit(**FAST)
def cache_gradients(begin, end, neighborhood, matrix, constants, by_body, vectors, sums, wall_pressure, lever):
    """Store the pair vectors G_ij and G_ib of the particles begin to end, and the sums that the pressure operator needs.

    neighborhood              the `Neighborhood`
    matrix (N, 8)     Y_i [1]; None for 1
    constants         `PressureConstants`
    by_body (N,)      whether a moving body is within reach
    vectors, sums     `PressureVectors` and `PressureSums` to fill
    wall_pressure     `WallPressure` to fill for particles with wall neighbours; None where c = 0
    lever (N, 9)      filled as `fill_wall_pressure` says; None where no body moves
    """
    points, period, fluid = neighborhood.points, neighborhood.period, neighborhood.fluid
    quantum, inverse_support, wall_weight = vectors.gradient.quantum, ONE / neighborhood.support, constants.wall_weight
    own, wall_slope = vectors.own, sums.wall_slope
    factor, half = inverse_support * inverse_support * neighborhood.volume / quantum, HALF * quantum
    for i in range(begin, end):
        fx = fy = fz = square = txx = txy = txz = tyy = tyz = tzz = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, weight = separations(i, points, points, j, period)
            q = root(dx * dx + dy * dy + dz * dz) * inverse_support
            slope = only(present, factor * kernel_slope_over_q(q, neighborhood.sigma), ZERO)
            ax, ay, az = slope * dx, slope * dy, slope * dz
            if matrix is not None:
                ax, ay, az = times_mean_correction(matrix, i, j, ax, ay, az)
            ax, ay, az = rounded(ax), rounded(ay), rounded(az)
            store_vector(vectors.gradient.whole, k, present, ax, ay, az)
            fx += ax
            fy += ay
            fz += az
            square += (ax * ax + ay * ay + az * az) * weight
            if wall_pressure is not None:
                txx -= ax * dx
                txy -= ax * dy + ay * dx
                txz -= ax * dz + az * dx
                tyy -= ay * dy
                tyz -= ay * dz + az * dy
                tzz -= az * dz
        sx, sy, sz = quantum * summed(fx), quantum * summed(fy), quantum * summed(fz)
        gx, gy, gz = sx, sy, sz
        wx, wy, wz, coverage = ZERO, ZERO, ZERO, ZERO
        if neighborhood.walls.number[i] > 0:
            coverage, (wx, wy, wz), solid = cache_wall_gradients(
                i, neighborhood, matrix, constants.lattice_moment, vectors.wall_gradient
            )
            gx, gy, gz = gx + wall_weight * wx, gy + wall_weight * wy, gz + wall_weight * wz
            if wall_pressure is not None:
                moment = (
                    quantum * summed(txx), half * summed(txy), half * summed(txz),
                    ONE if constants.plane else quantum * summed(tyy), half * summed(tyz), quantum * summed(tzz),
                )  # fmt: skip
                inside, outside = ((sx, sy, sz), moment), ((wx, wy, wz), solid)
                fill_wall_pressure(
                    i, inside, outside, constants.gravity, neighborhood.support, by_body, wall_pressure, lever
                )
                k = wall_pressure.extrapolation[i]
                gx -= k[0] * sx + k[1] * sy + k[2] * sz
                gy -= k[3] * sx + k[4] * sy + k[5] * sz
                gz -= k[6] * sx + k[7] * sy + k[8] * sz
        own[0, i], own[1, i], own[2, i] = gx, gy, gz
        sums.coverage[i] = coverage
        wall_slope[0, i], wall_slope[1, i], wall_slope[2, i] = wx, wy, wz
        nx, ny, nz = TWO * sx + wall_weight * wx, TWO * sy + wall_weight * wy, TWO * sz + wall_weight * wz
        sums.openness[i] = (nx * nx + ny * ny + nz * nz) * points[i, 3]
        sums.diagonal[i] = quantum * quantum * summed(square) + (gx * gx + gy * gy + gz * gz) * points[i, 3] + TINY


@inlined
def show_velocity(i, vx, vy, vz, walls, extrapolation, seen):
    """Fill row i of seen (N, 4) with (1 + K_i)^T v_i [m/s], the velocity that neighbours see.

    walls: lists of wall neighbours; extrapolation (N, 9): K_i [1], None for 0.
    """
    sx, sy, sz = vx, vy, vz
    if extrapolation is not None and walls.number[i] > 0:
        k = extrapolation[i]
        sx += k[0] * vx + k[3] * vy + k[6] * vz
        sy += k[1] * vx + k[4] * vy + k[7] * vz
        sz += k[2] * vx + k[5] * vy + k[8] * vz
    seen[i, 0], seen[i, 1], seen[i, 2] = sx, sy, sz


@njit(**FAST)
def pressure_velocity(begin, end, chosen, neighborhood, vectors, extrapolation, kappa, change, seen, push):
    """Compute the effect u_i = (rho_ref / rho_i0) (H kappa)_i of a pressure on the velocities of chosen particles (Eq. 14).

    chosen (K,)             particles, of which those from begin to end are computed
    neighborhood                    the `Neighborhood`
    vectors                 `PressureVectors`
    extrapolation (N, 9)    K_i [1]; None for 0
    kappa (N,)              pressure [m2/s]
    change (3, N)           becomes u_i [m/s]
    seen (N, 4)             becomes (1 + K_i)^T u_i [m/s], which neighbours see
    push (N, 3)             becomes sum_j G_ij kappa_j [m/s], by which bodies beside walls are pressed too; None where no body moves
    """
    neighbor, quantum, own, walls, fluid = (
        neighborhood.fluid.neighbor,
        vectors.gradient.quantum,
        vectors.own,
        neighborhood.walls,
        neighborhood.fluid,
    )
    whole_x, whole_y, whole_z = rows(vectors.gradient.whole)
    for n in range(begin, end):
        i, tx, ty, tz = chosen[n], spread(ZERO), spread(ZERO), spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            other = gather(kappa, load(neighbor, k, present))
            tx += load(whole_x, k, present) * other
            ty += load(whole_y, k, present) * other
            tz += load(whole_z, k, present) * other
        sx, sy, sz = quantum * summed(tx), quantum * summed(ty), quantum * summed(tz)
        if push is not None:
            push[i, 0], push[i, 1], push[i, 2] = sx, sy, sz
        ux, uy, uz = own[0, i] * kappa[i] + sx, own[1, i] * kappa[i] + sy, own[2, i] * kappa[i] + sz
        if extrapolation is not None and walls.number[i] > 0:
            k = extrapolation[i]
            ux += k[0] * sx + k[1] * sy + k[2] * sz
            uy += k[3] * sx + k[4] * sy + k[5] * sz
            uz += k[6] * sx + k[7] * sy + k[8] * sz
        weight = neighborhood.points[i, 3]
        ux, uy, uz = weight * ux, weight * uy, weight * uz
        change[0, i], change[1, i], change[2, i] = ux, uy, uz
        show_velocity(i, ux, uy, uz, walls, extrapolation, seen)


@njit(**FAST)
def seen_velocity(begin, end, walls, extrapolation, velocity, seen):
    """Fill seen (N, 4) with (1 + K_i)^T v_i [m/s] of velocity (3, N) [m/s]; walls: lists of wall neighbours, extrapolation (N, 9): K_i."""
    for i in range(begin, end):
        show_velocity(i, velocity[0, i], velocity[1, i], velocity[2, i], walls, extrapolation, seen)


@njit(**FAST)
def velocity_divergence(begin, end, chosen, fluid, vectors, velocity, seen, rate):
    """Compute the rate of compression (H^T v)_i of chosen particles beside walls at rest (Eq. 7).

    chosen (K,): particles, of which those from begin to end are computed; fluid: neighbour lists; vectors: `PressureVectors`;
    velocity (3, N): v_i [m/s]; seen (N, 4): (1 + K_i)^T v_i [m/s]; rate (N,): becomes the rate [1/s].
    """
    neighbor, quantum, own = fluid.neighbor, vectors.gradient.quantum, vectors.own
    whole_x, whole_y, whole_z = rows(vectors.gradient.whole)
    for n in range(begin, end):
        i, inflow = chosen[n], spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            ux, uy, uz, _ = gather_four(seen, load(neighbor, k, present), 0)
            inflow += load(whole_x, k, present) * ux
            inflow += load(whole_y, k, present) * uy
            inflow += load(whole_z, k, present) * uz
        outflow = own[0, i] * velocity[0, i] + own[1, i] * velocity[1, i] + own[2, i] * velocity[2, i]
        rate[i] = outflow - quantum * summed(inflow)


@njit(**FAST)
def divergence_multiplier(begin, end, rate, diagonal, fluid, time_step, kappa, correction, error):
    """Compute one Jacobi step of Alg. 1, C_i / a_i where density would rise.

    rate (N,)            C_i, the rate of compression [1/s]
    diagonal (N,)        a_i, the diagonal of A [1/m2]
    fluid                neighbour lists; particles with fewer than FEWEST neighbours are left alone
    time_step            dt [s]
    kappa (N,)           sum of the corrections so far [m2/s], to which this one is added
    correction (N,)      becomes C_i / a_i or 0 [m2/s]
    error (blocks,)      becomes the block sums of dt (C_i)+ [1]
    """
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            error[i // BLOCK] = 0.0
        excess = max(rate[i], ZERO) if fluid.number[i] >= FEWEST else ZERO
        correction[i] = excess / diagonal[i]
        kappa[i] += correction[i]
        error[i // BLOCK] += excess * time_step

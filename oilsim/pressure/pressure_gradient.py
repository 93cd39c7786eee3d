"""Divergence-free velocity (Qiu et al. 2021, Eq. 7-14): the pressure's force on velocities and its adjoint, the divergence.

    u_i = (rho_ref / rho_i0) (H kappa)_i,   v = v* - u,   (A kappa)_i = (H^T u)_i,   kappa >= 0,  A kappa - H^T v* >= 0, complementary.

kappa = pressure x time step / rho_ref [m2/s]. Both schemes share the form, with pair vectors G_ij = -G_ji [1/m]:

    (H kappa)_i = sum_j G_ij (kappa_i + kappa_j) + sum_b G_ib (w kappa_i + c_i x_ib . grad kappa_i)
    (H^T v)_i   = sum_j G_ij . (v_i - v_j) + ...    the exact transpose, the rate of compression [1/s]

paper   G_ij = V grad W_ij, G_ib = V_b grad W_ib, w = 1, c = 0                                          (Eq. 7 and 14, sign mended)
split   G_ij = (Y_i + Y_j) / 2 V grad W_ij, G_ib likewise with V_b and the lattice's Y (see `faces`), w = 2 and c = 1: a wall takes the
        pressure that the liquid's gradient extrapolates to it. A linear pressure is then balanced near walls as it is inside, and
        water lies still. c fades to 0 where liquid neighbours are too few for a gradient, and at the free surface beside walls at rest,
        where its transpose would hold the water's edge: waves would lose three times as much. Beside bodies it stays, because the
        uppermost particles would press their dry part up, and they would ride high.

The gradient at i comes from its liquid neighbours, B_i sum_j G_ij (kappa_j - kappa_i), B_i = (sum_j G_ij x_ij^T)^-1, so that the walls'
part is K_i (sum_j G_ij kappa_j - kappa_i sum_j G_ij) with one matrix K_i = c_i sum_b G_ib x_ib^T B_i per particle:

    (H kappa)_i = own_i kappa_i + (1 + K_i) sum_j G_ij kappa_j,     own_i = (1 - K_i) sum_j G_ij + w sum_b G_ib
    (H^T v)_i   = own_i . v_i - sum_j G_ij . (1 + K_j)^T v_j        x_ij = x_j - x_i

A = H^T (rho_ref / rho_0) H is symmetric and positive semi-definite, and what walls take is exactly what the liquid loses.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, gather, gather_four, load, only, root, rounded, spread, store, summed
from oilsim.backend.thread_team import BLOCK
from oilsim.gradients.gradient_correction import face_between, face_to_walls, times_symmetric
from oilsim.neighborhood.neighbor_search import rows, separations
from oilsim.neighborhood.smoothing_kernels import kernel, kernel_slope_over_q
from oilsim.pressure.wall_extrapolation import fill_wall_pressure

TINY = np.float32(1e-20)
ZERO, ONE, TWO = np.float32(0.0), np.float32(1.0), np.float32(2.0)


class PairVectors(NamedTuple):
    """A vector for every fluid pair, `whole` (3, P) times `quantum` [1/m].

    Products wait for memory, and 16 bits are twice as soon there as 32. What is rounded is as exactly opposite for the two of a pair.
    """

    whole: NDArray[np.int16]
    quantum: np.float32


@inlined
def load_vector(vectors, k, present):
    """Lanes of three components [1/m] from k on."""
    quantum = vectors.quantum
    return (
        quantum * load(vectors.whole[0], k, present), quantum * load(vectors.whole[1], k, present),
        quantum * load(vectors.whole[2], k, present),
    )  # fmt: skip


@inlined
def store_vector(vectors, k, present, ax, ay, az):
    """Lanes of three components to `vectors` (3, P) from k on."""
    store(vectors[0], k, present, ax)
    store(vectors[1], k, present, ay)
    store(vectors[2], k, present, az)


@inlined
def cache_wall_gradients(i, points, wall, matrix, lattice, period, walls, sigma, inverse_support, wall_gradient):
    """Cache G_ib of particle i; returns their sum [1/m] and the coverage sum V_b W_ib."""
    factor = inverse_support * inverse_support
    if matrix is not None:
        face = face_to_walls(matrix, i, lattice)
    wx = wy = wz = cover = spread(ZERO)
    first, last = walls.start[i], walls.start[i] + np.int64(walls.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        b = load(walls.neighbor, k, present)
        dx, dy, dz, volume = separations(i, points, wall, b, period)
        q = root(dx * dx + dy * dy + dz * dz) * inverse_support
        content = only(present, volume, ZERO)
        cover += content * kernel(q, sigma)
        slope = factor * content * kernel_slope_over_q(q, sigma)
        ax, ay, az = slope * dx, slope * dy, slope * dz
        if matrix is not None:
            ax, ay, az = times_symmetric(ax, ay, az, face)
        store_vector(wall_gradient, k, present, ax, ay, az)
        wx += ax
        wy += ay
        wz += az
    return summed(wx), summed(wy), summed(wz), summed(cover)


@njit(**FAST)
def cache_gradients(
    begin, end, points, wall, matrix, lattice, period, fluid, walls, sigma, support, volume, wall_weight, by_body, plane, gravity,
    gradient, wall_gradient, own, extrapolation, waterline, lever, diagonal, coverage, wall_slope, openness,
):  # fmt: skip
    """Cache G_ij per fluid pair in `gradient`, G_ib in `wall_gradient` (3, Q) [1/m], and what particles need of them.

    points (N, 4): place [m] and weight rho_ref / rho_0; wall (M, 4): place [m] and volume [m3]; matrix (N, 8) Y_i or None for 1; lattice
    m_0; wall_weight w; by_body (N,): a body is within reach.
    Fills own (3, N) [1/m], `extrapolation` (N, 9) K_i row by row where walls are near (None: c = 0), the diagonal of A [1/m2],
    `coverage` sum V_b W_ib, `wall_slope` (3, N) sum G_ib [1/m] and `openness` rho_ref / rho_0 |H 1|^2 [1/m2].
    """
    quantum, inverse_support = gradient.quantum, ONE / support
    factor = inverse_support * inverse_support * volume / quantum
    for i in range(begin, end):
        fx = fy = fz = square = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, weight = separations(i, points, points, j, period)
            q = root(dx * dx + dy * dy + dz * dz) * inverse_support
            slope = only(present, factor * kernel_slope_over_q(q, sigma), ZERO)
            ax, ay, az = slope * dx, slope * dy, slope * dz
            if matrix is not None:
                ax, ay, az = face_between(matrix, i, j, ax, ay, az)
            ax, ay, az = rounded(ax), rounded(ay), rounded(az)
            store_vector(gradient.whole, k, present, ax, ay, az)
            fx += ax
            fy += ay
            fz += az
            square += (ax * ax + ay * ay + az * az) * weight
        sx, sy, sz = quantum * summed(fx), quantum * summed(fy), quantum * summed(fz)
        gx, gy, gz = sx, sy, sz
        wx, wy, wz, coverage[i] = ZERO, ZERO, ZERO, ZERO
        if walls.number[i] > 0:
            wx, wy, wz, coverage[i] = cache_wall_gradients(
                i, points, wall, matrix, lattice, period, walls, sigma, inverse_support, wall_gradient
            )
            gx, gy, gz = gx + wall_weight * wx, gy + wall_weight * wy, gz + wall_weight * wz
            if extrapolation is not None:
                fill_wall_pressure(
                    i, points, wall, period, fluid, walls, gradient, wall_gradient, by_body, plane, gravity, (sx, sy, sz),
                    (wx, wy, wz), inverse_support, extrapolation, waterline, lever,
                )  # fmt: skip
                k = extrapolation[i]
                gx -= k[0] * sx + k[1] * sy + k[2] * sz
                gy -= k[3] * sx + k[4] * sy + k[5] * sz
                gz -= k[6] * sx + k[7] * sy + k[8] * sz
        own[0, i], own[1, i], own[2, i] = gx, gy, gz
        wall_slope[0, i], wall_slope[1, i], wall_slope[2, i] = wx, wy, wz
        nx, ny, nz = TWO * sx + wall_weight * wx, TWO * sy + wall_weight * wy, TWO * sz + wall_weight * wz
        openness[i] = (nx * nx + ny * ny + nz * nz) * points[i, 3]
        diagonal[i] = quantum * quantum * summed(square) + (gx * gx + gy * gy + gz * gz) * points[i, 3] + TINY


@inlined
def show_velocity(i, vx, vy, vz, walls, extrapolation, seen):
    """Set row i of `seen` (N, 4) to (1 + K_i)^T v_i, the velocity that neighbours see."""
    sx, sy, sz = vx, vy, vz
    if extrapolation is not None and walls.number[i] > 0:
        k = extrapolation[i]
        sx += k[0] * vx + k[3] * vy + k[6] * vz
        sy += k[1] * vx + k[4] * vy + k[7] * vz
        sz += k[2] * vx + k[5] * vy + k[8] * vz
    seen[i, 0], seen[i, 1], seen[i, 2] = sx, sy, sz


@njit(**FAST)
def pressure_velocity(
    begin, end, chosen, points, fluid, walls, gradient, own, extrapolation, kappa, change, seen, push
):
    """Fill `change` (3, N) with u_i [m/s] from kappa [m2/s] (Eq. 14), and `seen` (N, 4) with what neighbours see, for the i `chosen`.

    push (N, 3) becomes sum_j G_ij kappa_j [m/s], by which bodies beside walls are pressed too; None where none moves.
    """
    neighbor, quantum = fluid.neighbor, gradient.quantum
    whole_x, whole_y, whole_z = rows(gradient.whole)
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
        weight = points[i, 3]
        ux, uy, uz = weight * ux, weight * uy, weight * uz
        change[0, i], change[1, i], change[2, i] = ux, uy, uz
        show_velocity(i, ux, uy, uz, walls, extrapolation, seen)


@njit(**FAST)
def seen_velocity(begin, end, walls, extrapolation, velocity, seen):
    """Fill `seen` (N, 4) from velocity (3, N) [m/s]."""
    for i in range(begin, end):
        show_velocity(i, velocity[0, i], velocity[1, i], velocity[2, i], walls, extrapolation, seen)


@njit(**FAST)
def velocity_divergence(begin, end, chosen, fluid, gradient, own, velocity, seen, rate):
    """Fill `rate` [1/s] with (H^T v)_i of the i `chosen`, walls at rest (Eq. 7); `seen` as from `show_velocity`."""
    neighbor, quantum = fluid.neighbor, gradient.quantum
    whole_x, whole_y, whole_z = rows(gradient.whole)
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

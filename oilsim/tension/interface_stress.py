"""Interfacial tension between liquids, as a stress along their interfaces.

Each liquid has a tension s against liquids that have none: an oil that against water. Smoothed over neighbours it makes a field whose
gradient is normal to the interface, and whose integral across it is the tension, however wide the interface is:

    a_i = sum_j V W_ij s_j / sum_j V W_ij                               smoothed tension [N/m]; j = i is one of the sum
    b_i = L_i sum_j V (a_j - a_i) grad W_ij                             its gradient [Pa], L_i as in `particle_sums`
    T_i = |b_i| (1 - n_i n_i^T),   n_i = b_i / |b_i|                    stress of the interface [Pa] (Lafaurie et al. 1994)
    rho_i0 dv_i/dt = 1/m_0 sum_j V (T_i + T_j) grad W_ij + 2/m_0 T_i sum_b V_b grad W_ib

The force of a pair is antisymmetric, so momentum is exact. Colour functions for particles and the stress in this form: Hu and Adams 2006.
Walls continue the field of the liquid beside them, so interfaces meet walls and hulls at a right angle. Two liquids with tensions of their
own have the difference between them. A free surface has none: the sums are divided by what there is to be summed.

The stress pulls along the interface. Where the pressure is less than |b|, at most sigma times `STEEPEST` / d, the sum of both is a pull,
and particles draw together under a pull: the interface breaks up. So liquid that fills a box gets a pressure of at least that much
(`least_pressure`), and under a free surface an interface must lie deeper than |b| / (rho g).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.float32 import ONE, TWO, ZERO
from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, gather, gather_four, load, only, root, spread, summed
from oilsim.boundaries.contacts import add_wrench
from oilsim.gradients.particle_sums import REGULAR, coverage_and_slope
from oilsim.gradients.symmetric_3x3 import determinant, inverse
from oilsim.neighborhood.neighbor_search import nearest_images, separations
from oilsim.neighborhood.smoothing_kernels import kernel, kernel_slope_over_q

Real = NDArray[np.float32]
# [1/d] steepest gradient of the smoothed field of a flat interface between liquids of 0 and 1; theory; half as much again as the
# kernel's integral over a plane through its middle, 0.54 in two and 0.55 in three dimensions
STEEPEST = 0.8
# [Pa2] added to squares of gradients that may vanish; theory; far below that of any interface
TINY = np.float32(1e-20)


def least_pressure(tension: float, spacing: float) -> float:
    """Return the pressure [Pa] above which no interface of a tension [N/m] is under a pull; spacing d [m]."""
    return STEEPEST * tension / spacing


@njit(**FAST)
def smooth_tensions(begin, end, hood, tension, smoothed):
    """Fill smoothed (N,) with a_i [N/m] of the module's docstring; tension (N,) holds s_i [N/m]; hood: the `Neighborhood`."""
    points, period, fluid, sigma = hood.points, hood.period, hood.fluid, hood.sigma
    inverse_support = ONE / hood.support
    for i in range(begin, end):
        content = weighted = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            weight = only(present, kernel(root(dx * dx + dy * dy + dz * dz) * inverse_support, sigma), ZERO)
            content += weight
            weighted += weight * gather(tension, j)
        smoothed[i] = (sigma * tension[i] + summed(weighted)) / (sigma + summed(content))


@njit(**FAST)
def fill_stress(begin, end, hood, plane, smoothed, stress):
    """Fill stress (N, 8) with T_i [Pa] of the module's docstring, as xx, xy, xz, yy, yz, zz; the last two columns stay as they are.

    hood: the `Neighborhood`; plane: whether y is absent; smoothed (N,): a_i [N/m].
    """
    points, period, fluid, sigma = hood.points, hood.period, hood.fluid, hood.sigma
    inverse_support = ONE / hood.support
    factor = -hood.volume * inverse_support * inverse_support
    for i in range(begin, end):
        gx = gy = gz = mxx = mxy = mxz = myy = myz = mzz = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            slope = kernel_slope_over_q(root(dx * dx + dy * dy + dz * dz) * inverse_support, sigma)
            slope = only(present, slope, ZERO)
            rise = smoothed[i] - gather(smoothed, j)
            ax, ay, az = slope * dx, slope * dy, slope * dz
            gx += rise * ax
            gy += rise * ay
            gz += rise * az
            mxx += ax * dx
            mxy += ax * dy
            mxz += ax * dz
            myy += ay * dy
            myz += ay * dz
            mzz += az * dz
        moment = (
            factor * summed(mxx), factor * summed(mxy), factor * summed(mxz),
            factor * summed(myy), factor * summed(myz), factor * summed(mzz),
        )  # fmt: skip
        if plane:
            moment = moment[0], moment[1], moment[2], ONE, moment[4], moment[5]
        set_stress(i, factor * summed(gx), factor * summed(gy), factor * summed(gz), moment, plane, stress)


@inlined
def set_stress(i, gx, gy, gz, moment, plane, stress):
    """Set row i of stress (N, 8) [Pa], as `fill_stress` has it, from the sum (gx, gy, gz) [Pa] and the fluid's moment [1].

    It is 0 where neighbours do not span space.
    """
    if not determinant(moment) > REGULAR:
        for n in range(6):
            stress[i, n] = ZERO
        return
    xx, xy, xz, yy, yz, zz = inverse(moment)
    bx, by, bz = xx * gx + xy * gy + xz * gz, xy * gx + yy * gy + yz * gz, xz * gx + yz * gy + zz * gz
    size = math.sqrt(bx * bx + by * by + bz * bz + TINY)
    nx, ny, nz = bx / size, by / size, bz / size
    stress[i, 0] = size * (ONE - nx * nx)
    stress[i, 1] = -size * nx * ny
    stress[i, 2] = -size * nx * nz
    stress[i, 3] = ZERO if plane else size * (ONE - ny * ny)
    stress[i, 4] = -size * ny * nz
    stress[i, 5] = size * (ONE - nz * nz)


@njit(**FAST)
def pull_along_interfaces(begin, end, hood, stress, scale, velocity):
    """Add dt dv_i/dt of the module's docstring to `velocity` (3, N) [m/s].

    hood: the `Neighborhood`; stress (N, 8) as from `fill_stress`; scale: dt / (m_0 rho_ref) [m3 s/kg].
    """
    points, period, fluid, sigma = hood.points, hood.period, hood.fluid, hood.sigma
    inverse_support = ONE / hood.support
    factor = hood.volume * inverse_support * inverse_support
    for i in range(begin, end):
        fx = fy = fz = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            slope = kernel_slope_over_q(root(dx * dx + dy * dy + dz * dz) * inverse_support, sigma)
            slope = only(present, slope, ZERO)
            xx, xy, xz, yy = gather_four(stress, j, 0)
            yz, zz, _, _ = gather_four(stress, j, 4)
            xx, xy, xz = xx + stress[i, 0], xy + stress[i, 1], xz + stress[i, 2]
            yy, yz, zz = yy + stress[i, 3], yz + stress[i, 4], zz + stress[i, 5]
            ax, ay, az = slope * dx, slope * dy, slope * dz
            fx += xx * ax + xy * ay + xz * az
            fy += xy * ax + yy * ay + yz * az
            fz += xz * ax + yz * ay + zz * az
        bx = by = bz = ZERO
        if hood.walls.number[i] > 0:
            _, (sx, sy, sz) = coverage_and_slope(i, hood)
            bx, by, bz = times_stress(stress, i, TWO * sx, TWO * sy, TWO * sz)
        mobility = scale * points[i, 3]
        velocity[0, i] += mobility * (factor * summed(fx) + bx)
        velocity[1, i] += mobility * (factor * summed(fy) + by)
        velocity[2, i] += mobility * (factor * summed(fz) + bz)


@inlined
def times_stress(stress, i, ax, ay, az):
    """Return T_i a, in the unit of both; stress (N, 8) [Pa]."""
    return (
        stress[i, 0] * ax + stress[i, 1] * ay + stress[i, 2] * az,
        stress[i, 1] * ax + stress[i, 3] * ay + stress[i, 4] * az,
        stress[i, 2] * ax + stress[i, 4] * ay + stress[i, 5] * az,
    )


@njit(**FAST)
def pull_on_bodies(pairs, hood, stress, moment, force):
    """Add to `force` (bodies, 6) the pull of interfaces on moving bodies, opposite to that on the liquid [N, N m].

    pairs: the step's `BodyPairs`; hood: the `Neighborhood`; stress (N, 8) as from `fill_stress`; moment: m_0 [1].
    """
    points, wall, inverse_support = hood.points, hood.wall_points, ONE / hood.support
    for n in range(pairs.particle.size):
        i, b = pairs.particle[n], pairs.point[n]
        dx, dy, dz = nearest_images(
            points[i, 0] - wall[b, 0], points[i, 1] - wall[b, 1], points[i, 2] - wall[b, 2], hood.period
        )
        q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
        slope = -TWO * hood.volume * wall[b, 3] * kernel_slope_over_q(q, hood.sigma) * inverse_support * inverse_support
        x, y, z = times_stress(stress, i, dx, dy, dz)
        add_wrench(force, pairs.body[n], pairs.arm, n, slope / moment * x, slope / moment * y, slope / moment * z)

"""Interfacial tension between liquids, as a stress along their interfaces.

Each liquid has a tension s against liquids that have none: an oil that against water. Smoothed over neighbours it makes a field whose
gradient is normal to the interface, and whose integral across it is the tension, however wide the interface is:

    a_i = sum_j V W_ij s_j / sum_j V W_ij                               smoothed tension [N/m]; j = i is one of the sum
    b_i = L_i sum_j V (a_j - a_i) grad W_ij                             its gradient [Pa], L_i as in `particle_sums`
    T_i = |b_i| (1 - n_i n_i^T),   n_i = b_i / |b_i|                    stress of the interface [Pa] (Lafaurie et al. 1994)
    rho_i0 dv_i/dt = 1/m_0 sum_j V (T_i + T_j) grad W_ij + 2/m_0 sum_b V_b (n_w . grad W_ib) t_ib

The force of a pair is antisymmetric, so momentum is exact. Colour functions for particles and the stress in this form: Hu and Adams 2006.
Two liquids with tensions of their own have the difference between them. A free surface has none: the sums are divided by what there is
to be summed.

A wall pulls on the liquid beside it [Pa] as Young's law has it. With the normal n_w into the wall, along sum_b V_b grad W_ib, and the
contact angle theta of the wall through the liquid with the larger tension,

    t_ib = (n_w . T_i n_w) n_w - cos theta_b (b_i - (b_i . n_w) n_w)

The second part, summed along the wall across the line where both liquids meet it, is sigma cos theta: an interface at that angle pulls as
much the other way. At 90 degrees walls do not pull along themselves. Bodies receive the opposite of t_ib.

The stress pulls along the interface. Where the pressure is less than |b|, at most sigma times `STEEPEST` / d, the sum of both is a pull,
and particles draw together under a pull: the interface breaks up. So liquid that fills a box gets a pressure of at least that much
(`oilsim.core.phases.least_pressure`), and under a free surface an interface must lie deeper than |b| / (rho g).
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from oilsim.backend.jit import FAST, ONE, TWO, ZERO, inlined
from oilsim.backend.simd import LANES, below, gather, gather_four, load, only, root, spread, summed
from oilsim.boundaries.contacts import add_wrench
from oilsim.gradients.gradient_correction import determinant, inverse
from oilsim.gradients.particle_sums import REGULAR, coverage_and_slope
from oilsim.neighborhood.neighbor_search import nearest_images, separations
from oilsim.neighborhood.smoothing_kernels import kernel, kernel_slope_over_q

# [Pa2] added to squares of gradients that may vanish; theory; far below that of any interface
TINY = np.float32(1e-20)


@njit(**FAST)
def smooth_tensions(begin, end, neighborhood, tension, smoothed):
    """Fill smoothed (N,) with a_i [N/m] of the module's docstring; tension (N,) holds s_i [N/m]; neighborhood: the `Neighborhood`."""
    points, period, fluid, sigma = neighborhood.points, neighborhood.period, neighborhood.fluid, neighborhood.sigma
    inverse_support = ONE / neighborhood.support
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
def fill_slopes(begin, end, neighborhood, plane, smoothed, slopes):
    """Fill slopes (N, 8) with b_i [Pa], 1 / |b_i| [1/Pa] and n_w [1] of the module's docstring; the last column stays as it is.

    neighborhood: the `Neighborhood`; plane: whether y is absent; smoothed (N,): a_i [N/m]. n_w is 0 away from walls.
    """
    points, period, fluid, sigma = neighborhood.points, neighborhood.period, neighborhood.fluid, neighborhood.sigma
    inverse_support = ONE / neighborhood.support
    factor = -neighborhood.volume * inverse_support * inverse_support
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
        set_slope(i, factor * summed(gx), factor * summed(gy), factor * summed(gz), moment, slopes)
        nx = ny = nz = ZERO
        if neighborhood.walls.number[i] > 0:
            _, (sx, sy, sz) = coverage_and_slope(i, neighborhood)
            size = math.sqrt(sx * sx + sy * sy + sz * sz + TINY)
            nx, ny, nz = sx / size, sy / size, sz / size
        slopes[i, 4], slopes[i, 5], slopes[i, 6] = nx, ny, nz


@inlined
def set_slope(i, gx, gy, gz, moment, slopes):
    """Set b_i and 1 / |b_i| in row i of slopes (N, 8) from the sum (gx, gy, gz) [Pa] and the fluid's moment [1].

    b_i is 0 where neighbours do not span space.
    """
    bx = by = bz = ZERO
    if determinant(moment) > REGULAR:
        xx, xy, xz, yy, yz, zz = inverse(moment)
        bx, by, bz = xx * gx + xy * gy + xz * gz, xy * gx + yy * gy + yz * gz, xz * gx + yz * gy + zz * gz
    slopes[i, 0], slopes[i, 1], slopes[i, 2] = bx, by, bz
    slopes[i, 3] = ONE / math.sqrt(bx * bx + by * by + bz * bz + TINY)


@njit(**FAST)
def pull_along_interfaces(begin, end, neighborhood, wetting, slopes, scale, velocity):
    """Add dt dv_i/dt of the module's docstring to `velocity` (3, N) [m/s].

    neighborhood: the `Neighborhood`; wetting (M,): cos theta_b [1]; slopes (N, 8) as from `fill_slopes`; scale: dt / (m_0 rho_ref) [m3
    s/kg].
    """
    points, period, fluid, sigma = neighborhood.points, neighborhood.period, neighborhood.fluid, neighborhood.sigma
    inverse_support = ONE / neighborhood.support
    factor = neighborhood.volume * inverse_support * inverse_support
    for i in range(begin, end):
        fx = fy = fz = spread(ZERO)
        ox, oy, oz, per_size = slopes[i, 0], slopes[i, 1], slopes[i, 2], slopes[i, 3]
        own_size = per_size * (ox * ox + oy * oy + oz * oz)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            slope = kernel_slope_over_q(root(dx * dx + dy * dy + dz * dz) * inverse_support, sigma)
            slope = only(present, slope, ZERO)
            ax, ay, az = slope * dx, slope * dy, slope * dz
            bx, by, bz, over = gather_four(slopes, j, 0)
            size = own_size + over * (bx * bx + by * by + bz * bz)
            own = per_size * (ox * ax + oy * ay + oz * az)
            other = over * (bx * ax + by * ay + bz * az)
            fx += size * ax - own * ox - other * bx
            fy += size * ay - own * oy - other * by
            fz += size * az - own * oz - other * bz
        x, y, z = factor * summed(fx), factor * summed(fy), factor * summed(fz)
        if neighborhood.walls.number[i] > 0:
            facing, wetted = wall_slopes(i, neighborhood, wetting, slopes)
            wx, wy, wz = wall_pull(i, slopes, facing, wetted)
            x, y, z = x + wx, y + wy, z + wz
        mobility = scale * points[i, 3]
        velocity[0, i] += mobility * x
        velocity[1, i] += mobility * y
        velocity[2, i] += mobility * z


@inlined
def wall_slopes(i, neighborhood, wetting, slopes):
    """Return sum_b V_b n_w . grad W_ib, and the same with the factor cos theta_b [1/m].

    neighborhood: the `Neighborhood`; wetting (M,): cos theta_b [1]; slopes (N, 8) as from `fill_slopes`.
    """
    inverse_support = ONE / neighborhood.support
    nx, ny, nz = slopes[i, 4], slopes[i, 5], slopes[i, 6]
    facing = wetted = spread(ZERO)
    first, last = neighborhood.walls.start[i], neighborhood.walls.start[i] + np.int64(neighborhood.walls.number[i])
    for k in range(first, last, LANES):
        present = below(last, k)
        b = load(neighborhood.walls.neighbor, k, present)
        dx, dy, dz, volume = separations(i, neighborhood.points, neighborhood.wall_points, b, neighborhood.period)
        q = root(dx * dx + dy * dy + dz * dz) * inverse_support
        slope = only(present, volume, ZERO) * kernel_slope_over_q(q, neighborhood.sigma) * (nx * dx + ny * dy + nz * dz)
        facing += slope
        wetted += slope * gather(wetting, b)
    factor = inverse_support * inverse_support
    return factor * summed(facing), factor * summed(wetted)


@inlined
def wall_pull(i, slopes, facing, wetted):
    """Return 2 sum_b V_b (n_w . grad W_ib) t_ib [Pa/m]; slopes (N, 8) as from `fill_slopes`, the others as from `wall_slopes`."""
    bx, by, bz, over = slopes[i, 0], slopes[i, 1], slopes[i, 2], slopes[i, 3]
    nx, ny, nz = slopes[i, 4], slopes[i, 5], slopes[i, 6]
    along = bx * nx + by * ny + bz * nz
    normal = facing * over * (bx * bx + by * by + bz * bz - along * along) + wetted * along
    return TWO * (normal * nx - wetted * bx), TWO * (normal * ny - wetted * by), TWO * (normal * nz - wetted * bz)


@njit(**FAST)
def pull_on_bodies(pairs, neighborhood, wetting, slopes, moment, force):
    """Add to `force` (bodies, 6) the pull of interfaces on moving bodies, opposite to that on the liquid [N, N m].

    pairs: the step's `BodyPairs`; neighborhood: the `Neighborhood`; wetting, slopes as in `pull_along_interfaces`; moment: m_0 [1].
    """
    points, wall, inverse_support = neighborhood.points, neighborhood.wall_points, ONE / neighborhood.support
    for n in range(pairs.particle.size):
        i, b = pairs.particle[n], pairs.point[n]
        dx, dy, dz = nearest_images(
            points[i, 0] - wall[b, 0], points[i, 1] - wall[b, 1], points[i, 2] - wall[b, 2], neighborhood.period
        )
        q = math.sqrt(dx * dx + dy * dy + dz * dz) * inverse_support
        slope = kernel_slope_over_q(q, neighborhood.sigma) * inverse_support * inverse_support
        facing = wall[b, 3] * slope * (slopes[i, 4] * dx + slopes[i, 5] * dy + slopes[i, 6] * dz)
        x, y, z = wall_pull(i, slopes, facing, facing * wetting[b])
        share = -neighborhood.volume / moment
        add_wrench(force, pairs.body[n], pairs.arm, n, share * x, share * y, share * z)

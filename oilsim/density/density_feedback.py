"""What a step's finite length, and densities that are wrong already, ask of the divergence.

A step x += dt v changes volumes by det(1 + dt G) = 1 + dt div v - dt^2 tr(G G) / 2 + ...: strain compresses and rotation swells, unless
the divergence makes up for it. Position corrections even density out between neighbours, but a whole body of liquid that has swollen
or shrunk by a little feels none: the pressure brings it back to its density in `return_time`.

At a free surface the sum e_i + 1 = sum_j V W_ij falls short for want of neighbours, not of density. A flat one at the distance s leaves

    N(s) = 1 - int_s^H w(z) dz  of the sum, and its slope is  |g| = w(s),      w(z) the kernel's integral over a plane z away,

both times the density f of the liquid below, in rest densities. So |g| d / (1 + e) tells s, and f = (1 + e) / N(s). A lattice's first
layer sums up to 3 % more than that: a pool on its lattice melts if that is taken off it, and disordered water is pressed if it is asked to
have it, so that in between nothing is asked for. Liquid whose density
nobody watches there swells wherever a flow draws its surface together, since relaxation mends only compression at free surfaces:
before a towed skirt stands a heap without weight, and waves of 32 particles run 0.8 % too fast. It counts as far as the liquid is under
pressure: what falls free has edges and corners for a surface, and must not push itself apart. Pressure cannot pull, so that nothing here
holds drops or sheets together. Spray contracts at will.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, inlined
from oilsim.boundaries.boundary_particles import plane_integral
from oilsim.gradients.particle_sums import velocity_gradient
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, kernel_slope_over_q, lattice, normalisation

ZERO, HALF, ONE, TWO = np.float32(0.0), np.float32(0.5), np.float32(1.0), np.float32(2.0)
SPRAY = np.float32(0.6)  # density ratio below which particles may spread freely
RETURN = 1.5  # time in which a swollen or shrunken liquid returns to its density, in units of `time_unit`
RETURN_IN_A_BOX = (
    7.5  # that of liquid without free surface, which cannot swell, and would only follow the noise of its density
)
LARGEST_RETURN = np.float32(0.05)  # share of its volume that either asks for at most
PLACES, ENTRIES = 64, 64  # distances from a free surface at which N is taken, and entries of the table made of it


@lru_cache
def surface_shares(dimension: int) -> tuple[NDArray[np.float32], float]:
    """(2, ENTRIES): N by the integral, and as a lattice's layers have it, at equal steps of |g| d / (1 + e) from 0, deep inside, to its
    value on a free surface; and entries per unit of that.
    """
    distance = np.linspace(0.0, SUPPORT, PLACES)
    slope = np.array([plane_integral(float(s), dimension) for s in distance])
    missing = np.concatenate([np.cumsum((0.5 * (slope[1:] + slope[:-1]) * np.diff(distance))[::-1])[::-1], [0.0]])
    ratio, share = (slope / (1.0 - missing))[::-1], (1.0 - missing)[::-1]
    layers, found = np.array([_lattice_layer(depth, dimension) for depth in (2, 1, 0)]).T
    steps = np.linspace(0.0, ratio[-1], ENTRIES)
    least = np.interp(steps, ratio, share)
    most = least * np.interp(steps, layers, found / np.interp(layers, ratio, share))
    return np.stack([least, most]).astype(np.float32), (ENTRIES - 1) / float(ratio[-1])


def _lattice_layer(depth: int, dimension: int) -> tuple[float, float]:
    """|g| d / (1 + e) and 1 + e of a lattice's particle, `depth` layers below those at the free surface."""
    points = lattice(1.0, dimension)
    points = points[points[:, 2] <= depth]
    q, sigma = np.linalg.norm(points, axis=1) / SUPPORT, normalisation(1.0, dimension)
    content = kernel(q, sigma).sum()
    slope = (kernel_slope_over_q(q, sigma) * points[:, 2]).sum() / SUPPORT**2
    return abs(slope) / content, content


@inlined
def density_below_surface(error, gx, gy, gz, shares, per_slope):
    """f - 1 from e_i and g_i [1/m], `shares` and `per_slope` [m] as for `add_density_feedback`; 0 where it may be that of a lattice as
    well as of the integral, and where no flat free surface has such a slope.
    """
    place = per_slope * np.float32(math.sqrt(gx * gx + gy * gy + gz * gz)) / max(ONE + error, HALF)
    entry = np.int64(place)
    if entry >= shares.shape[1] - 1:
        return ZERO
    part = place - np.float32(entry)
    least = shares[0, entry] + part * (shares[0, entry + 1] - shares[0, entry])
    most = shares[1, entry] + part * (shares[1, entry + 1] - shares[1, entry])
    return min((ONE + error) / least - ONE, ZERO) + max((ONE + error) / most - ONE, ZERO)


@njit(**FAST)
def add_density_feedback(
    begin, end, compression, gradient_sum, near, kappa, pressed, field, shares, per_slope, time_step, return_time, rate
):
    """Add to `rate` [1/s] what the module's docstring says; `field` as from `particle_sums`, `shares` as from `surface_shares`.

    compression (N,) e_i; gradient_sum (3, N): g_i [1/m]; near (N,): a free surface is within reach; kappa (N,) [m2/s], of which `pressed`
    [m2/s] makes a particle at a free surface count in full; per_slope: entries of shares for each |g| / (1 + e) [m]; times [s].
    The series serves while a step deforms little, and counts up to LARGEST_RETURN of the volume: taken at its word for a drop that hits
    water, it would throw it back faster than it came.
    """
    half, rate_of_step, rate_of_return = HALF * time_step, ONE / time_step, ONE / return_time
    most = LARGEST_RETURN * rate_of_step
    for i in range(begin, end):
        error = compression[i]
        rate[i] += min(ONE + error - SPRAY, ZERO) * rate_of_step
        xx, xy, xz, yx, yy, yz, zx, zy, zz = velocity_gradient(field, i)
        trace = xx * xx + yy * yy + zz * zz + TWO * (xy * yx + xz * zx + yz * zy)
        rate[i] += max(min(half * trace, most), -most)
        if near[i]:
            error = density_below_surface(
                error, gradient_sum[0, i], gradient_sum[1, i], gradient_sum[2, i], shares, per_slope
            ) * min(kappa[i] / pressed, ONE)
        rate[i] += max(min(error, LARGEST_RETURN), -LARGEST_RETURN) * rate_of_return

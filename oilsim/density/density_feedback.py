"""The divergence that a step's finite length and wrong densities ask for.

A step x += dt v changes volumes by det(1 + dt G) = 1 + dt div v - dt^2 tr(G G) / 2 + ...: strain compresses and rotation swells. The
divergence makes up for it with dt tr(G G) / 2. Position corrections even density out between neighbours, but a whole body of liquid that
has swollen or shrunk by a little feels none of them. The pressure therefore brings its density back in a return time, with the divergence
e_i over that time.

Near a free surface the sum e_i + 1 = sum_j V W_ij falls short because neighbours are missing, and tells nothing of the density by itself.
At the distance s from a flat surface the sum is f N(s), and its slope |g_i| is f w(s):

    N(s) = 1 - int_s^H w(z) dz,    w(z): the kernel's integral over a plane z away,    f: density of the liquid below, in rest densities.

So |g| d / (1 + e) tells s, and f = (1 + e) / N(s). The sum over a lattice's first layer is up to 3 % above N: with the integral alone a
pool on its lattice melts, and with the lattice's value alone disordered water is pressed. Between the two nothing is asked for.

Without this the liquid swells wherever a flow draws its surface together, because relaxation repairs only compression there: a heap without
weight stands before a towed skirt, and waves of 32 particles run 0.8 % too fast. The density near a surface counts as far as the
liquid is under pressure. Falling liquid has edges and corners for a surface, and must not push itself apart. Pressure cannot pull, and so
nothing here holds drops or sheets together. Spray contracts at will.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, HALF, ONE, TWO, ZERO, inlined
from oilsim.boundaries.boundary_particles import plane_integral
from oilsim.gradients.free_surface import SPRAY
from oilsim.gradients.relaxation_time import velocity_gradient
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, kernel_slope_over_q, lattice, normalisation

# [t_u] time in which a swollen or shrunken liquid returns to its density; tuned; not on record
RETURN = 1.5
# [t_u] the same for liquid without a free surface; measured; it cannot swell, and would only follow the noise of its density
RETURN_IN_A_BOX = 7.5
# [1] largest share of the volume that strain and density each ask for in their time; measured; a drop that hits water is not thrown back
LARGEST_RETURN = np.float32(0.05)
# [1] distances from a free surface at which N is computed; numerical; not on record
PLACES = 64
# [1] entries of the table made of them; numerical; not on record
ENTRIES = 64


class SurfaceTable(NamedTuple):
    """N(s) at equal steps of |g| d / (1 + e), from 0 deep inside to its value at a free surface.

    shares (2, ENTRIES)     N by the integral, and N as the layers of a lattice have it [1]
    per_slope               entries per unit of |g| / (1 + e) [m]
    """

    shares: NDArray[np.float32]
    per_slope: np.float32


class FeedbackScales(NamedTuple):
    """Scales of the density feedback in a step.

    pressed         kappa [m2/s] from which the density of a particle near a free surface counts in full
    time_step       dt [s]
    return_time     time in which densities return [s]
    """

    pressed: np.float32
    time_step: np.float32
    return_time: np.float32


@lru_cache
def surface_table(spacing: float, dimension: int) -> SurfaceTable:
    """Return the table of N for a particle spacing d [m]."""
    distance = np.linspace(0.0, SUPPORT, PLACES)
    slope = np.array([plane_integral(float(s), dimension) for s in distance])
    missing = np.concatenate([np.cumsum((0.5 * (slope[1:] + slope[:-1]) * np.diff(distance))[::-1])[::-1], [0.0]])
    ratio, share = (slope / (1.0 - missing))[::-1], (1.0 - missing)[::-1]
    layers, found = np.array([_lattice_layer(depth, dimension) for depth in (2, 1, 0)]).T
    steps = np.linspace(0.0, ratio[-1], ENTRIES)
    least = np.interp(steps, ratio, share)
    most = least * np.interp(steps, layers, found / np.interp(layers, ratio, share))
    per_slope = (ENTRIES - 1) / float(ratio[-1])
    return SurfaceTable(np.stack([least, most]).astype(np.float32), np.float32(per_slope * spacing))


def _lattice_layer(depth: int, dimension: int) -> tuple[float, float]:
    """Return |g| d / (1 + e) and 1 + e of a particle on a lattice, `depth` layers below those at the free surface."""
    points = lattice(1.0, dimension)
    points = points[points[:, 2] <= depth]
    q, sigma = np.linalg.norm(points, axis=1) / SUPPORT, normalisation(1.0, dimension)
    content = kernel(q, sigma).sum()
    slope = (kernel_slope_over_q(q, sigma) * points[:, 2]).sum() / SUPPORT**2
    return abs(slope) / content, content


@inlined
def density_below_surface(error, gx, gy, gz, table):
    """Return f - 1 [1] of the liquid below a flat surface, from e_i [1] and g_i [1/m]; table: a `SurfaceTable`.

    The result is 0 between the integral's and the lattice's value, and where no flat free surface has such a slope.
    """
    shares = table.shares
    place = table.per_slope * np.float32(math.sqrt(gx * gx + gy * gy + gz * gz)) / max(ONE + error, HALF)
    entry = np.int64(place)
    if entry >= shares.shape[1] - 1:
        return ZERO
    part = place - np.float32(entry)
    least = shares[0, entry] + part * (shares[0, entry + 1] - shares[0, entry])
    most = shares[1, entry] + part * (shares[1, entry + 1] - shares[1, entry])
    return min((ONE + error) / least - ONE, ZERO) + max((ONE + error) / most - ONE, ZERO)


@njit(**FAST)
def add_density_feedback(begin, end, compression, gradient_sum, surface, flow, kappa, table, scales, rate):
    """Add to `rate` the divergence that the module's docstring derives.

    compression (N,)       e_i [1]
    gradient_sum (3, N)    g_i [1/m]
    surface (N,)           uint8, `FreeSurface` of each particle
    flow (N, 16)           columns as in `flow`, with the velocity gradients [1/s]
    kappa (N,)             pressure of the last step times time over rho_ref [m2/s]
    table, scales          a `SurfaceTable` and `FeedbackScales`
    rate (N,)              rate of compression [1/s], to which the feedback is added

    The series in dt holds where a step deforms little, and counts up to LARGEST_RETURN of the volume. Without that limit a drop that hits
    water is thrown back faster than it came.
    """
    half, rate_of_step, rate_of_return = HALF * scales.time_step, ONE / scales.time_step, ONE / scales.return_time
    most = LARGEST_RETURN * rate_of_step
    for i in range(begin, end):
        error = compression[i]
        rate[i] += min(ONE + error - SPRAY, ZERO) * rate_of_step
        xx, xy, xz, yx, yy, yz, zx, zy, zz = velocity_gradient(flow, i)
        trace = xx * xx + yy * yy + zz * zz + TWO * (xy * yx + xz * zx + yz * zy)
        rate[i] += max(min(half * trace, most), -most)
        if surface[i]:
            error = density_below_surface(
                error, gradient_sum[0, i], gradient_sum[1, i], gradient_sum[2, i], table
            ) * min(kappa[i] / scales.pressed, ONE)
        rate[i] += max(min(error, LARGEST_RETURN), -LARGEST_RETURN) * rate_of_return

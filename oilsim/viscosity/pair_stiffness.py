"""Viscous stiffness of pairs of particles: K_ij = k_ij a_ij a_ij^T with the pair vectors a_ij of the step (Qiu et al. 2021, Eq. 25).

    rho_i0 (dv/dt)_i = sum_j K_ij v_ji,   K_ij = f(r) mu_ij V_j x_ij x_ij^T
    paper   f = 2 (dim + 2) (-W'(r) / r) / r^2                                               Eq. 25 but for its 0.01 h^2 (see REGULAR)
    split   f = dim (dim + 2) w(r) (1 / S_i + 1 / S_j),    S_i = sum_j V w r^4,    w = (1 + LEVEL q^2) W(r)

Any f whose fourth moment has this value is consistent. The f of Eq. 25 rests on the nearest neighbours, of which some directions have more
than others: on a square lattice it gives 0.84 of the viscosity along the axes and 1.12 along the diagonals, 0.95 in disorder. The weight w
spreads over more neighbours: a square lattice has the same viscosity in every direction (without LEVEL 0.3 % more along its axes), a cubic
one within 2 %. S is that of the lattice within reach of free surfaces and walls. Inside, S is the particle's own; where flow disorders the
particles, the lattice's S would make viscosity 3 to 5 % too large.

K_ij is symmetric and positive semi-definite. It acts along the line of centres, or nearly so where pair vectors are corrected (see
`gradient_correction`). mu_ij is the harmonic mean of the two liquids' viscosities, which keeps the shear stress continuous across an
interface; the paper couples particles of one phase only, so that mu_ij = 0 elsewhere. No-slip walls take part as particles of given
velocity. A no-slip wall of rest velocity stands half a spacing behind its surface. Its k is scaled so that the first layer of liquid, half
a spacing before the surface, feels the stress mu v / (d / 2) of a linear profile.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.arrays import Index, Real
from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, gather, load, only, positive, root, spread, store, summed
from oilsim.neighborhood.neighbor_search import separations
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, kernel_slope_over_q, lattice, normalisation
from oilsim.pressure.pressure_gradient import PairVectors, load_vector

ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
# [1] part of q^2 in the weight w; theory; sum w x^2 y^2 = sum w r^4 / 8 on a square lattice
LEVEL = np.float32(0.6)
# [d^2] beside r^2 of a pair; paper (Eq. 25 has 0.01 h^2); that takes 1 % off the viscosity, and nothing needs it
REGULAR = 1e-4


class ViscousLiquid(NamedTuple):
    """The particles that take part in a viscous step.

    active     (A,) uint32, indices of particles of viscous liquids
    points     (N, 4) place [m] and weight [1] of all particles
    phase      (N,) uint8, index of each particle's liquid
    viscosity  (phases, phases) mu_ij of pairs of liquids [Pa s]
    """

    active: Index
    points: Real
    phase: NDArray[np.uint8]
    viscosity: Real


class PairGradients(NamedTuple):
    """Pair vectors a = V grad W of the step: `PairVectors` of fluid neighbours, and those (3, Q) of wall neighbours [1/m]."""

    fluid: PairVectors
    walls: Real


class Profile(NamedTuple):
    """Constants of f(r): regular, the square beside r^2 in Eq. 25 [m2]; factor, see `profile_factor` [1; 1/m4 in the split scheme]."""

    regular: np.float32
    factor: np.float32


class Stiffness(NamedTuple):
    """Coefficients of one viscous step, K_ij = k_ij a_ij a_ij^T.

    pairs  (P,) k of fluid neighbours [kg/(m s)]
    walls  (Q,) k of wall neighbours [kg/(m s)], (0,) if no wall holds the liquid
    block  (6, N) sum_j K_ij as xx, xy, xz, yy, yz, zz [kg/(m3 s)]
    """

    pairs: Real
    walls: Real
    block: Real


@inlined
def viscous_weight(q, sigma):
    """Return w at q = r / H [1/m3; 1/m2 in two dimensions]; sigma is that of W."""
    return (ONE + LEVEL * q * q) * kernel(q, sigma)


@lru_cache
def lattice_fourth_moment(dimension: int) -> float:
    """Return S of the module's docstring for a lattice of spacing 1."""
    squares = (lattice(1.0, dimension) ** 2).sum(axis=1)
    weight = viscous_weight(np.sqrt(squares) / SUPPORT, normalisation(1.0, dimension))
    return float((weight * squares**2).sum())


@lru_cache
def wall_factor(dimension: int, eq_25: bool) -> float:
    """Return the scale of k for no-slip walls: stress of a linear profile over that of a sheet of wall points, for spacing 1."""
    sigma = normalisation(1.0, dimension)
    across = np.linspace(0.0, SUPPORT, 601)
    r = np.hypot(1.0, across)
    # mean of x^2 over directions in the plane, times the measure of a ring; both sides of a line in two dimensions
    ring = np.pi * across**3 if dimension == 3 else 2.0 * across**2
    q = r / SUPPORT
    weight = -kernel_slope_over_q(q, sigma) / SUPPORT**2 / (r**2 + REGULAR) if eq_25 else viscous_weight(q, sigma)
    return 2.0 / (profile_factor(1.0, dimension, eq_25) * float(np.trapezoid(weight * ring, across)))


def profile_factor(spacing: float, dimension: int, eq_25: bool) -> float:
    """Return the factor of f(r) before its profile: 2 (dim + 2) [1] for Eq. 25, twice dim (dim + 2) / S [1/m4] for w(r)."""
    return 2.0 * (dimension + 2.0) * (1.0 if eq_25 else dimension / (lattice_fourth_moment(dimension) * spacing**4))


@njit(**FAST)
def fourth_moment_share(begin, end, points, near, neighborhood, factor, share):
    """Fill `share` (N,) with the lattice's S over that of each particle [1], 1 within reach of free surfaces and walls.

    points (N, 4): place [m] and weight; near (N,) uint8: 1 within reach of a free surface; factor: V over the lattice's S [1/m4].
    """
    fluid, walls, inverse_support = neighborhood.fluid, neighborhood.walls, ONE / neighborhood.support
    for i in range(begin, end):
        if near[i] or walls.number[i] > 0:
            share[i] = ONE
            continue
        content = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, neighborhood.period)
            squared = dx * dx + dy * dy + dz * dz
            q = only(present, root(squared) * inverse_support, ONE)
            content += viscous_weight(q, neighborhood.sigma) * squared * squared
        share[i] = ONE / (factor * summed(content))


@inlined
def stiffness(a, x, volume, share, neighborhood, profile):
    """Return k / mu with K_ij = k a a^T: V_j f(r) of the module's docstring over (a / x)^2.

    a: pair vector V grad W [1/m]; x: separation [m]; volume V_j [m3]; share: None for Eq. 25, anything else for the split scheme;
    profile: the `Profile`.
    """
    (ax, ay, az), (dx, dy, dz) = a, x
    squared = dx * dx + dy * dy + dz * dz
    slope = positive(-(ax * dx + ay * dy + az * dz)) + np.float32(1e-12)
    if share is None:
        return profile.factor * squared / ((squared + profile.regular) * slope)
    ratio = squared / slope
    weight = viscous_weight(root(squared) * (ONE / neighborhood.support), neighborhood.sigma)
    return profile.factor * volume * weight * ratio * ratio


@inlined
def add_outer(block, s, ax, ay, az):
    """Return block + s a a^T for a symmetric `block` (6,), in its unit: xx, xy, xz, yy, yz, zz; a = (ax, ay, az)."""
    sx, sy, sz = s * ax, s * ay, s * az
    return (
        block[0] + sx * ax, block[1] + sx * ay, block[2] + sx * az,
        block[3] + sy * ay, block[4] + sy * az, block[5] + sz * az,
    )  # fmt: skip


@inlined
def load_rows(vectors, k, present):
    """Return three vectors of lanes from place k on of `vectors` (3, Q), in their unit."""
    return load(vectors[0], k, present), load(vectors[1], k, present), load(vectors[2], k, present)


@inlined
def store_block(block, i, sums):
    """Set column i of `block` (6, N) to the sums of six vectors of lanes, in their unit; sums: two groups of three."""
    block[0, i], block[1, i], block[2, i] = summed(sums[0]), summed(sums[1]), summed(sums[2])
    block[3, i], block[4, i], block[5, i] = summed(sums[3]), summed(sums[4]), summed(sums[5])


@njit(**FAST)
def viscous_coefficients(begin, end, liquid, wall, wall_viscosity, neighborhood, gradients, profile, share, result):
    """Fill k of every pair of an active particle, and sum_j K_ij (Eq. 25, or the split scheme's f; see the module's docstring).

    liquid          the `ViscousLiquid`
    wall            (M, 4) place [m] and volume [m3] of wall particles
    wall_viscosity  (M,) scale of mu [1], 0 where the liquid slips; None where no wall holds the liquid
    gradients       the `PairGradients`
    profile         the `Profile`
    share           (N,) as from `fourth_moment_share`, None for Eq. 25
    result          the `Stiffness` to fill
    """
    fluid, walls, period, points, phase = (
        neighborhood.fluid,
        neighborhood.walls,
        neighborhood.period,
        liquid.points,
        liquid.phase,
    )
    for n in range(begin, end):
        i = liquid.active[n]
        own = liquid.viscosity[phase[i]]
        nothing = spread(ZERO)
        sums = (nothing, nothing, nothing, nothing, nothing, nothing)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            ax, ay, az = load_vector(gradients.fluid, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            mu = spread(own[0]) if own.size == 1 else gather(own, gather(phase, j))
            k_ij = stiffness((ax, ay, az), (dx, dy, dz), neighborhood.volume, share, neighborhood, profile)
            if share is not None:
                k_ij *= HALF * (share[i] + gather(share, j))
            s = only(present, mu * k_ij, ZERO)
            store(result.pairs, k, present, s)
            sums = add_outer(sums, s, ax, ay, az)
        if wall_viscosity is not None:
            first, last = walls.start[i], walls.start[i] + np.int64(walls.number[i])
            for k in range(first, last, LANES):
                present = below(last, k)
                b = load(walls.neighbor, k, present)
                ax, ay, az = load_rows(gradients.walls, k, present)
                dx, dy, dz, volume = separations(i, points, wall, b, period)
                mu = own[phase[i]] * gather(wall_viscosity, b)
                k_ib = stiffness((ax, ay, az), (dx, dy, dz), volume, share, neighborhood, profile)
                s = only(present, mu * k_ib, ZERO)
                store(result.walls, k, present, s)
                sums = add_outer(sums, s, ax, ay, az)
        store_block(result.block, i, sums)


def viscosity_matrix(viscosities: list[float], same_phase_only: bool) -> Real:
    """Return mu_ij [Pa s] (phases, phases) for viscosities [Pa s]: harmonic means, or only the diagonal."""
    mu = np.asarray(viscosities, np.float64)
    sums = mu[:, None] + mu[None, :]
    mean = np.divide(2.0 * mu[:, None] * mu[None, :], sums, out=np.zeros_like(sums), where=sums > 0.0)
    return (np.diag(mu) if same_phase_only else mean).astype(np.float32)

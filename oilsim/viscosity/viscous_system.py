"""Viscosity: explicit (Qiu et al. 2021, Eq. 25) and implicit (Eq. 26-29, the sign of A mended) by conjugate gradients.

    rho_i0 (dv/dt)_i = sum_j K_ij v_ji,   K_ij = f(r) mu_ij V_j x_ij x_ij^T
    paper   f = 2 (dim + 2) (-W'(r) / r) / r^2                                               Eq. 25 but for its 0.01 h^2 (see REGULAR)
    split   f = dim (dim + 2) w(r) (1 / S_i + 1 / S_j),    S_i = sum_j V w r^4,    w = (1 + LEVEL q^2) W(r)

Any f whose fourth moment has this value is consistent. That of Eq. 25 rests on the nearest neighbours, of which some directions have more:
on a square lattice it gives 0.84 of the viscosity along the axes and 1.12 along the diagonals, 0.95 among disordered particles. w spreads
the weight: a square lattice has the same viscosity in every direction (0.3 % more along its axes without LEVEL), a cubic one within 2 %.
S is the lattice's within reach of free surfaces and walls; inside it is the particle's own, 3 to 5 % more than the lattice's where flow
disorders it, which would be that of viscosity.

K_ij is symmetric and positive semi-definite and acts along the line of centres, or nearly so where pair vectors are corrected (`faces`).
mu_ij is the harmonic mean of the two liquids, the value that keeps the shear stress continuous across an interface; the paper couples
particles of one phase only, which is mu_ij = 0 elsewhere. Walls with no slip take part as particles of given velocity. Implicitly,
with dv_i = v_i - v*_i,

    (rho_i0 + theta dt sum_j K_ij) dv_i - theta dt sum_j K_ij dv_j = dt sum_j K_ij v*_ji,
    paper   theta = 1, backward Euler
    split   theta = max(1/2, 1 - 2 / z),   z = FINEST nu dt / d^2

solved matrix-free with 3x3 block Jacobi, for the particles of viscous phases only. Backward Euler takes nu k^2 dt / 2 off every decay,
0.4 % of a vortex of 64 spacings at a Reynolds number of 100; the trapezoidal rule, 1/2, errs by the square of that. z is the share of
itself that the finest wave would lose in a step. Beyond 4 the trapezoidal rule would let it swing for long; with theta a step leaves
-1 / (z - 1) of it at most.

A no-slip wall of rest velocity stands half a spacing behind its surface; its k is scaled so that the first layer of liquid, half a
spacing before the surface, feels the stress mu v / (d / 2) of a linear profile.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST, inlined
from oilsim.backend.simd import LANES, below, gather, gather_four, load, only, positive, root, spread, store, summed
from oilsim.backend.thread_team import Team, block_count, total
from oilsim.neighborhood.neighbor_search import Pairs, fill_rows, separations
from oilsim.neighborhood.smoothing_kernels import SUPPORT, kernel, kernel_slope_over_q, lattice, normalisation
from oilsim.pressure.bounded_solver import dot
from oilsim.pressure.pressure_gradient import PairVectors, load_vector
from oilsim.viscosity.viscous_response import ViscousResponse

Real = NDArray[np.float32]

ZERO, ONE, HALF = np.float32(0.0), np.float32(1.0), np.float32(0.5)
LEVEL = np.float32(0.6)  # for which sum w x^2 y^2 = sum w r^4 / 8 on a square lattice
REGULAR = 1e-4  # of d^2, beside r^2 of a pair: the 0.01 h^2 of Eq. 25 takes 1 % off the viscosity, and nothing needs it
FINEST = 10.0  # nu / d^2 at which waves decay at most: 6.6 on a square lattice, 7.4 on a cubic one, more beside walls that hold
EXPLICIT_BELOW = 1e-2  # nu dt / d^2 under which one explicit step equals the implicit one to the square of this


@inlined
def viscous_weight(q, sigma):
    """w at q = r / H, [1/m3; 1/m2 in two dimensions]; sigma that of W."""
    return (ONE + LEVEL * q * q) * kernel(q, sigma)


@lru_cache
def lattice_fourth_moment(dimension: int) -> float:
    """S of a lattice of spacing 1."""
    squares = (lattice(1.0, dimension) ** 2).sum(axis=1)
    weight = viscous_weight(np.sqrt(squares) / SUPPORT, normalisation(1.0, dimension))
    return float((weight * squares**2).sum())


@lru_cache
def wall_factor(dimension: int, eq_25: bool) -> float:
    """Scale of k for no-slip walls: stress of a linear profile over that of a sheet of wall points, spacing 1."""
    sigma = normalisation(1.0, dimension)
    across = np.linspace(0.0, SUPPORT, 601)
    r = np.hypot(1.0, across)
    # mean of x^2 over directions in the plane, times the measure of a ring; both sides of a line in two dimensions
    ring = np.pi * across**3 if dimension == 3 else 2.0 * across**2
    q = r / SUPPORT
    weight = -kernel_slope_over_q(q, sigma) / SUPPORT**2 / (r**2 + REGULAR) if eq_25 else viscous_weight(q, sigma)
    return 2.0 / (profile_factor(1.0, dimension, eq_25) * float(np.trapezoid(weight * ring, across)))


def profile_factor(spacing: float, dimension: int, eq_25: bool) -> float:
    """What f(r) has before its profile, (-W'(r) / r) / r^2 [1] or w(r) [1/m4]."""
    return 2.0 * (dimension + 2.0) * (1.0 if eq_25 else dimension / (lattice_fourth_moment(dimension) * spacing**4))


@njit(**FAST)
def fourth_moment_share(begin, end, points, near, period, fluid, walls, sigma, support, factor, share):
    """Fill `share` (N,) with the lattice's S over that of each particle, 1 where `near` (N,) a free surface or by walls.

    factor: V over the lattice's S [1/m4].
    """
    inverse_support = ONE / support
    for i in range(begin, end):
        if near[i] or walls.number[i] > 0:
            share[i] = ONE
            continue
        content = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            squared = dx * dx + dy * dy + dz * dz
            q = only(present, root(squared) * inverse_support, ONE)
            content += viscous_weight(q, sigma) * squared * squared
        share[i] = ONE / (factor * summed(content))


@inlined
def stiffness(ax, ay, az, dx, dy, dz, volume, sigma, inverse_support, regular, factor):
    """k with K_ij = k a a^T for the cached gradient a = V grad W, or nearly: factor mu times the profile of f, volume V, over (a / x)^2.

    sigma that of w, None for Eq. 25.
    """
    squared = dx * dx + dy * dy + dz * dz
    slope = positive(-(ax * dx + ay * dy + az * dz)) + np.float32(1e-12)
    if sigma is None:
        return factor * squared / ((squared + regular) * slope)
    ratio = squared / slope
    return factor * volume * viscous_weight(root(squared) * inverse_support, sigma) * ratio * ratio


@inlined
def add_outer(block, s, ax, ay, az):
    """block + s a a^T, as xx, xy, xz, yy, yz, zz."""
    sx, sy, sz = s * ax, s * ay, s * az
    return (
        block[0] + sx * ax, block[1] + sx * ay, block[2] + sx * az,
        block[3] + sy * ay, block[4] + sy * az, block[5] + sz * az,
    )  # fmt: skip


@njit(**FAST)
def viscous_coefficients(
    begin, end, active, points, wall, phase, viscosity, wall_viscosity, period, fluid, walls, gradient, wall_gradient, volume, sigma,
    support, regular, factor, share, pair_stiffness, wall_stiffness, block,
):  # fmt: skip
    """Fill k of every pair of an active particle and `block` (6, N), sum_j K_ij as xx, xy, xz, yy, yz, zz [kg/(m3 s)].

    active (A,): particle indices; viscosity (phases, phases): mu_ij [Pa s]; wall_viscosity (M,): 1 where the wall holds
    the liquid, 0 where it slips, None where none holds; sigma that of W and share (N,) as above, None for Eq. 25.
    """
    inverse_support = ONE / support
    for n in range(begin, end):
        i = active[n]
        own = viscosity[phase[i]]
        nothing = spread(ZERO)
        sums = (nothing, nothing, nothing, nothing, nothing, nothing)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            ax, ay, az = load_vector(gradient, k, present)
            dx, dy, dz, _ = separations(i, points, points, j, period)
            mu = spread(own[0]) if own.size == 1 else gather(own, gather(phase, j))
            k_ij = stiffness(ax, ay, az, dx, dy, dz, volume, sigma, inverse_support, regular, factor)
            if share is not None:
                k_ij *= HALF * (share[i] + gather(share, j))
            s = only(present, mu * k_ij, ZERO)
            store(pair_stiffness, k, present, s)
            sums = add_outer(sums, s, ax, ay, az)
        if wall_viscosity is not None:
            first, last = walls.start[i], walls.start[i] + np.int64(walls.number[i])
            for k in range(first, last, LANES):
                present = below(last, k)
                b = load(walls.neighbor, k, present)
                ax = load(wall_gradient[0], k, present)
                ay = load(wall_gradient[1], k, present)
                az = load(wall_gradient[2], k, present)
                dx, dy, dz, content = separations(i, points, wall, b, period)
                mu = own[phase[i]] * gather(wall_viscosity, b)
                k_ib = stiffness(ax, ay, az, dx, dy, dz, content, sigma, inverse_support, regular, factor)
                s = only(present, mu * k_ib, ZERO)
                store(wall_stiffness, k, present, s)
                sums = add_outer(sums, s, ax, ay, az)
        block[0, i], block[1, i], block[2, i] = summed(sums[0]), summed(sums[1]), summed(sums[2])
        block[3, i], block[4, i], block[5, i] = summed(sums[3]), summed(sums[4]), summed(sums[5])


@njit(**FAST)
def viscous_force(begin, end, active, fluid, gradient, pair_stiffness, block, velocity, force):
    """Fill `force` (3, N) with sum_j K_ij (v_j - v_i) [N/m3] of active particles; velocity (N, 4), wall velocities count as 0."""
    for n in range(begin, end):
        i = active[n]
        fx = fy = fz = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            ax, ay, az = load_vector(gradient, k, present)
            uj, vj, wj, _ = gather_four(velocity, j, 0)
            s = load(pair_stiffness, k, present) * (ax * uj + ay * vj + az * wj)
            fx += s * ax
            fy += s * ay
            fz += s * az
        ui, vi, wi = velocity[i, 0], velocity[i, 1], velocity[i, 2]
        force[0, i] = summed(fx) - (block[0, i] * ui + block[1, i] * vi + block[2, i] * wi)
        force[1, i] = summed(fy) - (block[1, i] * ui + block[3, i] * vi + block[4, i] * wi)
        force[2, i] = summed(fz) - (block[2, i] * ui + block[4, i] * vi + block[5, i] * wi)


@njit(**FAST)
def wall_drag(begin, end, active, walls, wall_gradient, wall_stiffness, wall_velocity, force):
    """Add sum_b K_ib v_b [N/m3], what moving no-slip walls pull, to `force` (3, N) of active particles."""
    for n in range(begin, end):
        i = active[n]
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            ax, ay, az = wall_gradient[0, k], wall_gradient[1, k], wall_gradient[2, k]
            s = wall_stiffness[k] * (ax * wall_velocity[0, b] + ay * wall_velocity[1, b] + az * wall_velocity[2, b])
            force[0, i] += s * ax
            force[1, i] += s * ay
            force[2, i] += s * az


@njit(**FAST)
def precondition(begin, end, active, block, rest_density, time_step, residual, result):
    """result = (rho_0 + dt sum_j K_ij)^-1 residual, the 3x3 block Jacobi preconditioner, for active particles."""
    for n in range(begin, end):
        i = active[n]
        rho = rest_density[i]
        xx, xy, xz = rho + time_step * block[0, i], time_step * block[1, i], time_step * block[2, i]
        yy, yz, zz = rho + time_step * block[3, i], time_step * block[4, i], rho + time_step * block[5, i]
        cxx, cxy, cxz = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
        inverse = np.float32(1.0) / (xx * cxx + xy * cxy + xz * cxz)
        rx, ry, rz = residual[0, i] * inverse, residual[1, i] * inverse, residual[2, i] * inverse
        result[0, i] = cxx * rx + cxy * ry + cxz * rz
        result[1, i] = cxy * rx + (xx * zz - xz * xz) * ry + (xy * xz - xx * yz) * rz
        result[2, i] = cxz * rx + (xy * xz - xx * yz) * ry + (xx * yy - xy * xy) * rz


def viscosity_matrix(viscosities: list[float], same_phase_only: bool) -> Real:
    """mu_ij [Pa s] (phases, phases): harmonic means, or only the diagonal."""
    mu = np.asarray(viscosities, np.float64)
    sums = mu[:, None] + mu[None, :]
    mean = np.divide(2.0 * mu[:, None] * mu[None, :], sums, out=np.zeros_like(sums), where=sums > 0.0)
    return (np.diag(mu) if same_phase_only else mean).astype(np.float32)


class ViscousSystem:
    """The linear system of one step; `solve` makes a velocity implicit, `explicit` steps it forward."""

    def __init__(self, team: Team, active: NDArray[np.uint32], fluid: Pairs, gradient: PairVectors) -> None:
        self._team, self.active, self._fluid, self._gradient = team, active, fluid, gradient
        self.pair_stiffness = np.empty(gradient.whole.shape[1], np.float32)
        self.block: Real = np.empty((6, 0), np.float32)

    def assemble(
        self, points: Real, wall: Real, phase: NDArray[np.uint8], viscosity: Real, wall_viscosity: Real | None,
        period: tuple[np.float32, ...] | None, walls: Pairs, wall_gradient: Real, spacing: float, dimension: int,
        near: NDArray[np.uint8] | None,
    ) -> None:  # fmt: skip
        """Compute the coefficients of every pair at the present positions; near (N,) a free surface, None for Eq. 25."""
        self._walls, self._wall_gradient = walls, wall_gradient
        self.wall_stiffness = np.zeros(wall_gradient.shape[1] if wall_viscosity is not None else 0, np.float32)
        self.block, self._seen = np.zeros((6, len(points)), np.float32), np.empty((len(points), 4), np.float32)
        volume, support, sigma, share = np.float32(spacing**dimension), np.float32(SUPPORT * spacing), None, None
        if near is not None:
            sigma, share = np.float32(normalisation(spacing, dimension)), np.empty(near.size, np.float32)
            factor = volume / np.float32(lattice_fourth_moment(dimension) * spacing**4)
            self._team.run(
                fourth_moment_share,
                near.size,
                points,
                near,
                period,
                self._fluid,
                walls,
                sigma,
                support,
                factor,
                share,
            )
        self._team.run(
            viscous_coefficients, self.active.size, self.active, points, wall, phase, viscosity, wall_viscosity,
            period, self._fluid, walls, self._gradient, wall_gradient, volume, sigma, support,
            np.float32(REGULAR * spacing**2), np.float32(profile_factor(spacing, dimension, near is None)), share,
            self.pair_stiffness, self.wall_stiffness, self.block,
        )  # fmt: skip

    def force(self, velocity: Real, wall_velocity: Real | None) -> Real:
        """Viscous force density (3, N) [N/m3]; wall_velocity (3, M) [m/s], None for 0."""
        result = np.zeros_like(velocity)
        self._team.run(fill_rows, len(self._seen), velocity, velocity[0], self._seen)
        arguments = (self._fluid, self._gradient, self.pair_stiffness, self.block, self._seen, result)
        self._team.run(viscous_force, self.active.size, self.active, *arguments)
        if wall_velocity is not None and self.wall_stiffness.size:
            self._team.run(
                wall_drag, self.active.size, self.active, self._walls, self._wall_gradient,
                self.wall_stiffness, wall_velocity, result,
            )  # fmt: skip
        return result

    def explicit(self, velocity: Real, rest_density: Real, time_step: float, bodies: ViscousResponse | None) -> None:
        """velocity += dt force / rho_0 (Eq. 25), in place; bodies answer implicitly all the same."""
        velocity += (
            np.float32(time_step)
            / rest_density
            * self.force(velocity, None if bodies is None else bodies.lead(velocity))
        )

    def solve(
        self,
        velocity: Real,
        rest_density: Real,
        time_step: float,
        theta: float,
        bodies: ViscousResponse | None,
        tolerance: float,
        iterations: int,
    ) -> int:
        """The implicit step (Eq. 26, 27 with theta 1), in place; stops at `tolerance` times the explicit change; returns iterations."""
        dt = np.float32(theta * time_step)
        residual = np.float32(time_step) * self.force(velocity, None if bodies is None else bodies.lead(velocity))
        scaled = np.zeros_like(velocity)
        image = np.empty_like(velocity)
        self._precondition(residual, rest_density, dt, scaled)
        direction = scaled.copy()
        energy = first = self._dot(residual, scaled)
        used = 0
        while used < iterations and energy > tolerance * tolerance * first and energy > 0.0:
            image = rest_density * direction - dt * self.force(
                direction, None if bodies is None else bodies.follow(direction)
            )
            curvature = self._dot(direction, image)
            if not curvature > 0.0:  # too small for single precision
                break
            step = np.float32(energy / curvature)
            velocity += step * direction
            residual -= step * image
            self._precondition(residual, rest_density, dt, scaled)
            before, energy = energy, self._dot(residual, scaled)
            direction *= np.float32(energy / before)
            direction += scaled
            used += 1
        return used

    def _precondition(self, residual: Real, rest_density: Real, time_step: np.float32, result: Real) -> None:
        arguments = (self.active, self.block, rest_density, time_step, residual, result)
        self._team.run(precondition, self.active.size, *arguments)

    def _dot(self, left: Real, right: Real) -> float:
        left, right = left.reshape(-1), right.reshape(-1)
        sums = np.zeros(block_count(left.size))
        self._team.run(dot, left.size, left, right, sums)
        return total(sums)


def implicit_share(number: float) -> float:
    """The theta of the split scheme at a viscous number."""
    return max(0.5, 1.0 - 2.0 / (FINEST * number))


def is_mild(number: float) -> bool:
    """Whether one explicit step is as good as the implicit one at this viscous number."""
    return math.isfinite(number) and number < EXPLICIT_BELOW

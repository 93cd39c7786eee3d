"""The viscous step: explicit (Qiu et al. 2021, Eq. 25), or implicit by conjugate gradients (Eq. 26-29, with the sign of A corrected).

With dv_i = v_i - v*_i and the stiffness K_ij of `pair_stiffness` the implicit step is

    (rho_i0 + theta dt sum_j K_ij) dv_i - theta dt sum_j K_ij dv_j = dt sum_j K_ij v*_ji,
    paper   theta = 1, backward Euler
    split   theta = max(1/2, 1 - 2 / z),   z = FINEST nu dt / d^2,

and is solved matrix-free with 3x3 block Jacobi, for the particles of viscous phases only. Backward Euler takes nu k^2 dt / 2 off every
decay, 0.4 % of a vortex of 64 spacings at a Reynolds number of 100; the trapezoidal rule, theta = 1/2, errs by the square of that. The
number z is the share of itself that the finest wave would lose in a step. Beyond z = 4 the trapezoidal rule would let that wave swing for
long; with this theta a step leaves at most -1 / (z - 1) of it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.arrays import Real
from oilsim.backend.jit import FAST
from oilsim.backend.simd import LANES, below, gather_four, load, spread, summed
from oilsim.backend.thread_team import Team, block_count, total
from oilsim.neighborhood.neighbor_search import Neighborhood, fill_rows
from oilsim.pressure.bounded_solver import dot
from oilsim.pressure.pressure_gradient import load_vector
from oilsim.viscosity.pair_stiffness import (
    REGULAR,
    PairGradients,
    Profile,
    Stiffness,
    ViscousLiquid,
    fourth_moment_share,
    lattice_fourth_moment,
    profile_factor,
    viscous_coefficients,
)
from oilsim.viscosity.viscous_response import Motion, ViscousResponse

ZERO = np.float32(0.0)
# [1] rate of the finest wave over nu / d^2, at most; theory; 6.6 on a square lattice, 7.4 on a cubic one, more beside no-slip walls
FINEST = 10.0
# [1] nu dt / d^2 under which a step is explicit; theory; it equals the implicit one to the square of this
EXPLICIT_BELOW = 1e-2


@njit(**FAST)
def viscous_force(begin, end, active, fluid, gradient, stiffness, velocity, force):
    """Fill `force` (3, N) with sum_j K_ij (v_j - v_i) [N/m3] of active particles, walls as if at rest (Eq. 25).

    active    (A,) uint32, their indices
    fluid     lists of fluid neighbours
    gradient  `PairVectors` of these
    stiffness the `Stiffness`
    velocity  (N, 4) velocity [m/s], and another number
    """
    block = stiffness.block
    for n in range(begin, end):
        i = active[n]
        fx = fy = fz = spread(ZERO)
        first, last = fluid.start[i], fluid.start[i] + np.int64(fluid.number[i])
        for k in range(first, last, LANES):
            present = below(last, k)
            j = load(fluid.neighbor, k, present)
            ax, ay, az = load_vector(gradient, k, present)
            uj, vj, wj, _ = gather_four(velocity, j, 0)
            s = load(stiffness.pairs, k, present) * (ax * uj + ay * vj + az * wj)
            fx += s * ax
            fy += s * ay
            fz += s * az
        ui, vi, wi = velocity[i, 0], velocity[i, 1], velocity[i, 2]
        force[0, i] = summed(fx) - (block[0, i] * ui + block[1, i] * vi + block[2, i] * wi)
        force[1, i] = summed(fy) - (block[1, i] * ui + block[3, i] * vi + block[4, i] * wi)
        force[2, i] = summed(fz) - (block[2, i] * ui + block[4, i] * vi + block[5, i] * wi)


@njit(**FAST)
def wall_drag(begin, end, active, walls, wall_gradient, wall_stiffness, wall_velocity, force):
    """Add sum_b K_ib v_b [N/m3], the pull of moving no-slip walls, to `force` (3, N) of active particles.

    active          (A,) uint32, their indices
    walls           lists of wall neighbours
    wall_gradient   (3, Q) pair vectors of these [1/m]
    wall_stiffness  (Q,) k of these [kg/(m s)]
    wall_velocity   (3, M) of the wall particles [m/s]
    """
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
    """Fill `result` (3, N) with (rho_0 + dt sum_j K_ij)^-1 residual, the 3x3 block Jacobi preconditioner, for active particles.

    active (A,) uint32; block (6, N) of `Stiffness` [kg/(m3 s)]; rest_density (N,) [kg/m3]; time_step theta dt [s]; residual (3, N).
    """
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


class ViscousSystem:
    """The linear system of one step; `solve` makes a velocity implicit, `explicit` steps it forward."""

    def __init__(self, team: Team, liquid: ViscousLiquid, neighborhood: Neighborhood, gradients: PairGradients) -> None:
        self._team, self._liquid, self._neighborhood, self._gradients = team, liquid, neighborhood, gradients
        self._seen = np.empty((len(liquid.points), 4), np.float32)

    def assemble(
        self, wall: Real, wall_viscosity: Real | None, spacing: float, dimension: int, near: NDArray[np.uint8] | None
    ) -> None:
        """Compute the coefficients of every pair at the present positions.

        wall, wall_viscosity as for `viscous_coefficients`; spacing d [m]; near (N,) uint8: 1 within reach of a free surface, None for
        Eq. 25.
        """
        points, gradients, neighborhood, share = self._liquid.points, self._gradients, self._neighborhood, None
        if near is not None:
            share = np.empty(near.size, np.float32)
            factor = neighborhood.volume / np.float32(lattice_fourth_moment(dimension) * spacing**4)
            self._team.run(fourth_moment_share, near.size, points, near, neighborhood, factor, share)
        self.stiffness = Stiffness(
            np.empty(gradients.fluid.whole.shape[1], np.float32),
            np.zeros(gradients.walls.shape[1] if wall_viscosity is not None else 0, np.float32),
            np.zeros((6, len(points)), np.float32),
        )
        profile = Profile(
            np.float32(REGULAR * spacing**2), np.float32(profile_factor(spacing, dimension, near is None))
        )
        self._team.run(
            viscous_coefficients, self._liquid.active.size, self._liquid, wall, wall_viscosity, neighborhood, gradients, profile, share,
            self.stiffness,
        )  # fmt: skip

    def force(self, velocity: Real, wall_velocity: Real | None) -> Real:
        """Return the viscous force density (3, N) [N/m3] at velocity (3, N) [m/s]; wall_velocity (3, M) [m/s], None for 0."""
        active, neighborhood, gradients = self._liquid.active, self._neighborhood, self._gradients
        result = np.zeros_like(velocity)
        self._team.run(fill_rows, len(self._seen), velocity, velocity[0], self._seen)
        arguments = (active, neighborhood.fluid, gradients.fluid, self.stiffness, self._seen, result)
        self._team.run(viscous_force, active.size, *arguments)
        if wall_velocity is not None and self.stiffness.walls.size:
            pairs = neighborhood.walls, gradients.walls, self.stiffness.walls
            self._team.run(wall_drag, active.size, active, *pairs, wall_velocity, result)
        return result

    def explicit(self, velocity: Real, rest_density: Real, time_step: float, bodies: ViscousResponse | None) -> None:
        """Add dt force / rho_0 (Eq. 25) to velocity (3, N) [m/s] in place; bodies respond implicitly all the same.

        rest_density (N,) [kg/m3]; time_step [s].
        """
        velocity += (
            np.float32(time_step)
            / rest_density
            * self.force(velocity, None if bodies is None else bodies.lead(velocity))
        )

    def solve(
        self, velocity: Real, rest_density: Real, time_step: float, theta: float, bodies: ViscousResponse | None, tolerance: float,
        iterations: int, middle: Motion | None = None,
    ) -> tuple[int, float]:  # fmt: skip
        """Make velocity (3, N) [m/s] implicit in place (Eq. 26, 27 with theta 1); return the iterations used, and what is left.

        rest_density (N,) [kg/m3]; time_step [s]; stops when `tolerance` [1] of the explicit change is left. middle: the motion
        (1 - theta) v_n + theta v*, v_n before the forces of the step; None: they have changed nothing.
        """
        dt = np.float32(theta * time_step)
        at = velocity if middle is None else middle.velocity
        residual = np.float32(time_step) * self.force(at, None if bodies is None else bodies.lead(velocity, middle))
        scaled = np.zeros_like(velocity)
        image = np.empty_like(velocity)
        self._precondition(residual, rest_density, dt, scaled)
        direction = scaled.copy()
        energy = first = self._dot(residual, scaled)
        used = 0
        while used < iterations and energy > tolerance * tolerance * first and energy > 0.0:
            image = rest_density * direction - dt * self.force(
                direction, None if bodies is None else bodies.response_to(direction)
            )
            curvature = self._dot(direction, image)
            if not curvature > 0.0:  # too small for single precision
                energy = 0.0
                break
            step = np.float32(energy / curvature)
            velocity += step * direction
            residual -= step * image
            self._precondition(residual, rest_density, dt, scaled)
            before, energy = energy, self._dot(residual, scaled)
            direction *= np.float32(energy / before)
            direction += scaled
            used += 1
        return used, math.sqrt(max(energy, 0.0) / first) if first > 0.0 else 0.0

    def _precondition(self, residual: Real, rest_density: Real, time_step: np.float32, result: Real) -> None:
        arguments = (self.stiffness.block, rest_density, time_step, residual, result)
        self._team.run(precondition, self._liquid.active.size, self._liquid.active, *arguments)

    def _dot(self, left: Real, right: Real) -> float:
        left, right = left.reshape(-1), right.reshape(-1)
        sums = np.zeros(block_count(left.size))
        self._team.run(dot, left.size, left, right, sums)
        return total(sums)


def implicit_share(number: float) -> float:
    """Return the theta of the split scheme at a viscous number nu dt / d^2 [1]."""
    return max(0.5, 1.0 - 2.0 / (FINEST * number))


def is_mild(number: float) -> bool:
    """Return whether one explicit step is as good as the implicit one at a viscous number nu dt / d^2 [1]."""
    return math.isfinite(number) and number < EXPLICIT_BELOW

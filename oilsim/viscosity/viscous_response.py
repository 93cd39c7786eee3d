"""Moving no-slip bodies inside the viscous solve, which keeps the lightest raft in the thickest oil stable (as `rigid_response` does).

A body has the twist V and the inverse mass M^-1, and its wall points move at J_b V. Over a step dt it takes from the liquid the impulse
(see `viscous_system`)

    P = dt P* + theta dt (E dv - D dV),    P* = V_i sum_ib J_b^T K_ib (v_i - J_b V),    E dv = V_i sum_ib J_b^T K_ib dv_i,
    D = V_i sum_ib J_b^T K_ib J_b,         dV = M^-1 P,

V_i being a particle's volume. Its change of twist is

    dV = S (dt P* + theta dt E dv),        S = (1 + theta dt M^-1 D)^-1 M^-1,

and the liquid feels theta dt sum_b K_ib J_b dV besides. S is symmetric and positive, and so is the liquid's system with it. Bodies tied by
joints share one M^-1. A drag that acts a step late would make a body swing ever wider once dt M^-1 D exceeds 2; for a body one spacing
thick and of density rho_b, dt M^-1 D is 4 (mu / rho_b) dt / d^2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array, Real
from oilsim.backend.jit import FAST
from oilsim.boundaries.contacts import BodyPairs, add_wrench
from oilsim.boundaries.walls import Walls


@njit(**FAST)
def viscous_reaction(pairs, velocity, wall_velocity, wall_gradient, wall_stiffness, volume, force):
    """Add to `force` (bodies, 6) the drag of the liquid on moving no-slip bodies, V_i K_ib (v_i - v_b) [N, N m].

    pairs           the step's `BodyPairs`
    velocity        (3, N) of the particles [m/s]
    wall_velocity   (3, M) of all wall particles [m/s], None for bodies at rest
    wall_gradient   (3, Q) a_ib, pair vectors of wall neighbours [1/m]
    wall_stiffness  (Q,) k_ib of `viscous_system`, K_ib = k_ib a_ib a_ib^T [kg/(m s)], 0 where the liquid slips
    volume          V_i [m3]
    """
    for n in range(pairs.particle.size):
        i, k, b = pairs.particle[n], pairs.pair[n], pairs.point[n]
        u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
        if wall_velocity is not None:
            u, v, w = u - wall_velocity[0, b], v - wall_velocity[1, b], w - wall_velocity[2, b]
        ax, ay, az = wall_gradient[0, k], wall_gradient[1, k], wall_gradient[2, k]
        s = volume * wall_stiffness[k] * (ax * u + ay * v + az * w)
        add_wrench(force, pairs.body[n], pairs.arm, n, s * ax, s * ay, s * az)


@njit(**FAST)
def viscous_compliance(pairs, wall_gradient, wall_stiffness, volume, along, drag):
    """Add D of the module's docstring to `drag` (bodies, 6, 6) [kg/s, kg m/s, kg m2/s].

    pairs           the step's `BodyPairs`
    wall_gradient   (3, Q) pair vectors a of wall neighbours [1/m]
    wall_stiffness  (Q,) k of wall neighbours, as for `viscous_reaction`
    volume          V_i of a particle [m3]
    along           (1, 6) room for J_b^T a of one pair [1/m, 1]
    """
    for n in range(pairs.particle.size):
        k = pairs.pair[n]
        if wall_stiffness[k] == 0.0:
            continue
        along[:] = 0.0
        add_wrench(along, 0, pairs.arm, n, wall_gradient[0, k], wall_gradient[1, k], wall_gradient[2, k])
        s = volume * wall_stiffness[k]
        for row in range(6):
            for column in range(6):
                drag[pairs.body[n], row, column] += s * along[0, row] * along[0, column]


class Motion(NamedTuple):
    """Velocities (3, N) [m/s] of the liquid and twists (bodies, 6) [m/s, rad/s] of the moving bodies at one instant."""

    velocity: Real
    twists: Array

    def towards(self, end: Motion, share: float) -> Motion:
        """Return the mean of this motion and of another that counts by `share` [1]."""
        part = np.float32(share)
        return Motion(
            part * end.velocity + (np.float32(1.0) - part) * self.velocity,
            share * end.twists + (1.0 - share) * self.twists,
        )


class ViscousResponse:
    """The moving bodies' part of one step of viscosity, of which the share `theta` is implicit."""

    def __init__(
        self, walls: Walls, pairs: BodyPairs, wall_gradient: Real, wall_stiffness: Real, volume: np.float32, time_step: float,
        theta: float,
    ) -> None:  # fmt: skip
        """Compute how bodies respond; the arrays as for `viscous_reaction`, volume of a particle [m3], time_step [s], theta [1]."""
        self._walls, self._pairs, self._volume = walls, pairs, volume
        self._wall_pairs, self._time_step, self._span = (wall_gradient, wall_stiffness), time_step, theta * time_step
        count = len(walls.moving)
        blocks = np.zeros((count, 6, 6))
        viscous_compliance(pairs, wall_gradient, wall_stiffness, volume, np.zeros((1, 6), np.float32), blocks)
        spread = np.zeros((count, 6, count, 6))
        spread[np.arange(count), :, np.arange(count), :] = blocks
        self._drag = spread.reshape(6 * count, 6 * count)
        inverse_mass = walls.inverse_mass()
        self._compliance = np.linalg.solve(np.eye(6 * count) + self._span * inverse_mass @ self._drag, inverse_mass)

    def lead(self, velocity: Real, middle: Motion | None = None) -> Real:
        """Return the velocities (3, M) [m/s] of all wall points that liquid at `velocity` (3, N) [m/s] sees.

        They are the bodies' own, and theta J_b S dt P*. P* is that at the motion `middle`, or at the present one.
        """
        at = Motion(velocity, self._walls.twists()) if middle is None else middle
        self._start, own = velocity.copy(), self._walls.point_velocities(at.twists)
        self._impulse = self._time_step * self._reaction(at.velocity, own)
        change = self._compliance @ self._impulse
        return own + self._walls.point_velocities(self._span / self._time_step * change.reshape(-1, 6))

    def response_to(self, change: Real) -> Real:
        """Return the velocities (3, M) [m/s], J_b S theta dt E dv, of wall points by a `change` dv (3, N) [m/s] of the liquid."""
        change_of_twist = self._compliance @ (self._span * self._reaction(change, None))
        return self._walls.point_velocities(change_of_twist.reshape(-1, 6))

    def hand_over(self, velocity: Real, explicit: bool) -> None:
        """Give the bodies the impulse of the liquid, whose velocity is now `velocity` (3, N) [m/s].

        In an `explicit` step the force is that at the velocity before.
        """
        impulse = self._impulse
        if not explicit:
            impulse = impulse + self._span * self._reaction(velocity - self._start, None)
        change_of_twist = self._compliance @ impulse
        self._walls.receive((impulse - self._span * self._drag @ change_of_twist).reshape(-1, 6))

    def _reaction(self, velocity: Real, wall_velocity: Real | None) -> Array:
        """Return the drag (6 bodies,) [N, N m] of liquid at `velocity` (3, N) on the bodies; wall_velocity (3, M) [m/s], None for 0."""
        force = self._walls.zero_forces()
        viscous_reaction(self._pairs, velocity, wall_velocity, *self._wall_pairs, self._volume, force)
        return force.ravel()

"""Moving no-slip bodies inside the viscous solve: stable for the lightest raft in the thickest oil, as `rigid_response` is for pressure.

A body of twist V and inverse mass M^-1 whose wall points move at J_b V takes from the liquid (see `viscosity`), over a step dt,

    P = dt P* + theta dt (E dv - D dV),    P* = V_i sum_ib J_b^T K_ib (v_i - J_b V),    E dv = V_i sum_ib J_b^T K_ib dv_i,
    D = V_i sum_ib J_b^T K_ib J_b,         dV = M^-1 P,

V_i being a particle's volume. Solved for its change of twist,

    dV = S (dt P* + theta dt E dv),        S = (1 + theta dt M^-1 D)^-1 M^-1,

and the liquid feels theta dt sum_b K_ib J_b dV besides. S is symmetric and positive, so is the liquid's system with it, and bodies tied by
joints share one M^-1. A drag that acts a step late makes a body swing, ever wider, once dt M^-1 D exceeds 2; for a body a spacing thick
and of density rho_b that is 4 (mu / rho_b) dt / d^2.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST
from oilsim.boundaries.walls import Walls, add_wrench
from oilsim.neighborhood.neighbor_search import Pairs

Real = NDArray[np.float32]
Double = NDArray[np.float64]


@njit(**FAST)
def viscous_reaction(
    particles, velocity, wall_velocity, walls, wall_gradient, wall_stiffness, volume, resting, owner, arm, force
):
    """Add to `force` (bodies, 6) what `particles` that touch moving no-slip bodies drag on them, V_i K_ib (v_i - v_b) [N, N m].

    velocity (3, N) and wall_velocity (3, M) [m/s], None for bodies at rest; volume V_i [m3].
    """
    for i in particles:
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            if b < resting:
                continue
            u, v, w = velocity[0, i], velocity[1, i], velocity[2, i]
            if wall_velocity is not None:
                u, v, w = u - wall_velocity[0, b], v - wall_velocity[1, b], w - wall_velocity[2, b]
            ax, ay, az = wall_gradient[0, k], wall_gradient[1, k], wall_gradient[2, k]
            s = volume * wall_stiffness[k] * (ax * u + ay * v + az * w)
            add_wrench(force, owner[b - resting], arm, b - resting, s * ax, s * ay, s * az)


@njit(**FAST)
def viscous_compliance(particles, walls, wall_gradient, wall_stiffness, volume, resting, owner, arm, along, drag):
    """Add D of the module's docstring to `drag` (bodies, 6, 6) [kg/s, kg m/s, kg m2/s]; along (1, 6): room for a pair's J_b^T a."""
    for i in particles:
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            b = walls.neighbor[k]
            if b < resting or wall_stiffness[k] == 0.0:
                continue
            along[:] = 0.0
            add_wrench(along, 0, arm, b - resting, wall_gradient[0, k], wall_gradient[1, k], wall_gradient[2, k])
            s = volume * wall_stiffness[k]
            for row in range(6):
                for column in range(6):
                    drag[owner[b - resting], row, column] += s * along[0, row] * along[0, column]


class ViscousResponse:
    """The moving bodies' part of one step of viscosity, of which the share `theta` is implicit."""

    def __init__(
        self,
        walls: Walls,
        touching: NDArray[np.uint32],
        pairs: Pairs,
        wall_gradient: Real,
        wall_stiffness: Real,
        volume: np.float32,
        time_step: float,
        theta: float,
    ) -> None:
        """touching: particles with a moving wall point within reach; wall_stiffness: k of every pair with a wall, 0 where it slips.

        volume of a particle [m3], time_step [s].
        """
        self._walls, self._touching, self._volume = walls, touching, volume
        self._pairs, self._time_step, self._span = (pairs, wall_gradient, wall_stiffness), time_step, theta * time_step
        count = len(walls.moving)
        blocks = np.zeros((count, 6, 6))
        viscous_compliance(
            touching, *self._pairs, volume, walls.resting, walls.owner, walls.arm, np.zeros((1, 6), np.float32), blocks
        )
        spread = np.zeros((count, 6, count, 6))
        spread[np.arange(count), :, np.arange(count), :] = blocks
        self._drag = spread.reshape(6 * count, 6 * count)
        inverse_mass = walls.inverse_mass()
        self._compliance = np.linalg.solve(np.eye(6 * count) + self._span * inverse_mass @ self._drag, inverse_mass)

    def lead(self, velocity: Real) -> Real:
        """Velocities (3, M) [m/s] of all wall points that liquid at `velocity` (3, N) is to see: the bodies' own and theta J_b S dt P*."""
        twists = self._walls.twists()
        self._start, own = velocity.copy(), self._walls.point_velocities(twists)
        self._impulse = self._time_step * self._reaction(velocity, own)
        change = self._compliance @ self._impulse
        return own + self._walls.point_velocities(self._span / self._time_step * change.reshape(-1, 6))

    def follow(self, change: Real) -> Real:
        """Velocities (3, M) [m/s] J_b S theta dt E dv by which wall points follow a `change` (3, N) of the liquid's."""
        answer = self._compliance @ (self._span * self._reaction(change, None))
        return self._walls.point_velocities(answer.reshape(-1, 6))

    def hand_over(self, velocity: Real, explicit: bool) -> None:
        """Hand the bodies what the liquid, now at `velocity` (3, N), has given; an `explicit` liquid took the force at its old one."""
        impulse = self._impulse
        if not explicit:
            impulse = impulse + self._span * self._reaction(velocity - self._start, None)
        answer = self._compliance @ impulse
        self._walls.receive((impulse - self._span * self._drag @ answer).reshape(-1, 6))

    def _reaction(self, velocity: Real, wall_velocity: Real | None) -> Double:
        """What the liquid at `velocity` drags on the bodies (6 bodies,) [N, N m]."""
        walls, force = self._walls, self._walls.zero_forces()
        viscous_reaction(
            self._touching,
            velocity,
            wall_velocity,
            *self._pairs,
            self._volume,
            walls.resting,
            walls.owner,
            walls.arm,
            force,
        )
        return force.ravel()

"""Project velocities onto those that keep the momentum, linear and angular, of liquid that touches no wall at rest.

Relaxation moves particles and keeps the sum of their momenta, and the forces of smoothing, viscosity and pressure between two particles
do not act along their line of centres. So the liquid, with the bodies that it touches, loses the angular momentum dL. Velocities are
rounded at every kick, which takes the linear momentum dP, some 1e-9 of the particles' own a step. Among all changes of velocity that
restore both, a rigid motion takes the least kinetic energy:

    v_i += dP / M + w x (x_i - X),    I w = dL,    I = sum m (r^2 1 - r r^T),   r = x_i - X,  X the liquid's centre of mass.

Most of these changes are smaller than the least change of a velocity in single precision. So momentum that rounding takes from one particle
goes to the next one, like the error that a printer spreads over neighbouring dots (Floyd and Steinberg 1976).

Real torques, of gravity and of forcings, act outside the watched blocks and stay. Drops that are apart share the rigid motion. About an
axis on which all particles lie nothing is given. In a periodic domain angular momentum has no meaning, and dL counts as 0. Nothing is
projected while any liquid touches a wall at rest, which exchanges momentum with the liquid all the time, or sleeps, which holds the rest
like a wall.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array
from oilsim.backend.jit import EXACT, FAST
from oilsim.core.state import FluidState
from oilsim.step.arrays import Neighbors
from oilsim.step.context import StepClock, StepContext

# [m d^2] moment of inertia up to which nothing is turned about its axis; numerical; particles nearly in a row are not spun about it
ROW = 1e-3


@njit(**FAST)
def sum_momenta(position, velocity, phase, mass, origin, sums):
    """Add m, m r, m v, m r cross v and m r r^T (xx, yy, zz, xy, xz, yz), r = x - origin, of all particles to `sums` (16,), in float64.

    position, velocity (3, N) [m, m/s]; phase (N,) uint8; mass (phases,) of a particle [kg]; origin (3,) [m].
    """
    for i in range(phase.size):
        m = mass[phase[i]]
        x, y, z = position[0, i] - origin[0], position[1, i] - origin[1], position[2, i] - origin[2]
        u, v, w = np.float64(velocity[0, i]), np.float64(velocity[1, i]), np.float64(velocity[2, i])
        sums[0] += m
        sums[1] += m * x
        sums[2] += m * y
        sums[3] += m * z
        sums[4] += m * u
        sums[5] += m * v
        sums[6] += m * w
        sums[7] += m * (y * w - z * v)
        sums[8] += m * (z * u - x * w)
        sums[9] += m * (x * v - y * u)
        sums[10] += m * x * x
        sums[11] += m * y * y
        sums[12] += m * z * z
        sums[13] += m * x * y
        sums[14] += m * x * z
        sums[15] += m * y * z


@njit(**EXACT)
def add_rigid_motion(position, phase, mass, center, speed, rate, velocity):
    """Add u + w cross (x - X) to each particle's velocity (3, N) [m/s]; what rounding leaves over goes to the next one.

    position (3, N) [m]; phase (N,) uint8; mass (phases,) of a particle [kg]; center X [m], speed u [m/s], rate w [1/s], all (3,) float64.
    """
    left_u = left_v = left_w = 0.0  # [N s]
    for i in range(phase.size):
        m = mass[phase[i]]
        x, y, z = position[0, i] - center[0], position[1, i] - center[1], position[2, i] - center[2]
        u = velocity[0, i] + (speed[0] + rate[1] * z - rate[2] * y + left_u / m)
        v = velocity[1, i] + (speed[1] + rate[2] * x - rate[0] * z + left_v / m)
        w = velocity[2, i] + (speed[2] + rate[0] * y - rate[1] * x + left_w / m)
        velocity[0, i], velocity[1, i], velocity[2, i] = np.float32(u), np.float32(v), np.float32(w)
        left_u, left_v, left_w = m * (u - velocity[0, i]), m * (v - velocity[1, i]), m * (w - velocity[2, i])


class MomentumProjection:
    """Projection of one step's velocities: `watch` the blocks that may lose momentum, then `project`."""

    def __init__(self, context: StepContext, clock: StepClock, neighbors: Neighbors, state: FluidState) -> None:
        self._context, self._clock, self._state = context, clock, state
        held = context.walls.rest_is_touched(neighbors.neighborhood.walls, neighbors.by_body, neighbors.touching)
        self._acts = not (held or state.asleep or state.count == 0)
        if self._acts:
            self._mass = context.config.rest_volume * context.constants.densities
            self._origin = state.position.mean(axis=1, dtype=np.float64)
            self._lost = np.zeros(6)

    @contextmanager
    def watch(self) -> Iterator[None]:
        """Count as lost the momentum that a block takes from the liquid and does not give to bodies."""
        if not self._acts:
            yield
            return
        before = self._present()
        yield
        self._lost += before - self._present()

    def project(self) -> None:
        """Give the liquid the momentum back that it has lost, as a rigid motion; nothing where values are not finite, which ends a run."""
        if not (self._acts and np.isfinite(self._sums).all()):
            return
        with self._clock.stage("rotation"):
            mass, shift = self._sums[0], self._sums[1:4] / self._sums[0]
            rate = np.zeros(3)
            if not any(self._context.config.periodic):
                turn = self._lost[3:] - np.cross(shift, self._lost[:3])
                values, axes = np.linalg.eigh(_inertia(self._sums, shift))
                firm = values > ROW * self._context.config.particle_spacing**2 * mass
                rate = axes[:, firm] @ (axes[:, firm].T @ turn / values[firm])
                if self._context.constants.plane:
                    rate[[0, 2]] = 0.0  # but for rounding
            state, center, speed = self._state, self._origin + shift, self._lost[:3] / mass
            add_rigid_motion(state.position, state.phase, self._mass, center, speed, rate, state.velocity)

    def _present(self) -> Array:
        """Return the momentum (6,) of the liquid and the impulses that bodies have received, about the origin [N s, N m s]."""
        state, sums = self._state, np.zeros(16)
        with self._clock.stage("rotation"):
            sum_momenta(state.position, state.velocity, state.phase, self._mass, self._origin, sums)
            momentum = sums[4:10].copy()
            for body in self._context.walls.moving.values():
                momentum += body.impulse
                momentum[3:] += np.cross(body.position - self._origin, body.impulse[:3])
            self._sums = sums
        return momentum


def _inertia(sums: Array, shift: Array) -> Array:
    """Return the inertia (3, 3) [kg m2] about the centre of mass, `shift` (3,) [m] from the origin of the `sums` (16,)."""
    mass, (xx, yy, zz, xy, xz, yz) = sums[0], sums[10:]
    second = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - mass * np.outer(shift, shift)
    return np.trace(second) * np.eye(3) - second

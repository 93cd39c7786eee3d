"""Give liquid that touches no wall at rest the momentum back, linear and angular, that the scheme takes from it.

Relaxation moves particles and keeps the sum of their momenta, and the forces of filter, viscosity and pressure between two particles do not
act along their line of centres. So a connected part of the liquid, with the bodies that it touches, loses the angular momentum dL.
Velocities are rounded at every kick, which takes the linear momentum dP, some 1e-9 of the particles' own a step. Among all changes of
velocity that restore both, a rigid motion takes the least kinetic energy:

    v_i += dP / M + w x (x_i - X),    I w = dL,    I = sum m (r^2 1 - r r^T),   r = x_i - X,  X the part's centre of mass.

Most of these changes are smaller than the least change of a velocity in single precision. So momentum that rounding takes from one particle
goes to the next one of its part, like the error that a printer spreads over neighbouring dots (Floyd and Steinberg 1976).

Parts that are not connected do not turn each other. Real torques, of gravity and of forcings, act outside the watched blocks and stay.
Where a part cannot turn (a single particle; a row of particles, about itself) nothing is given.

In a periodic domain angular momentum has no meaning, and dL counts as 0. There is no correction while any liquid touches a wall at rest,
which exchanges momentum with all liquid connected to it: finding the liquid that is not connected would cost one per cent of every step in
a tank. Sleeping liquid holds the rest like a wall.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST
from oilsim.state import FluidState
from oilsim.step.connected_components import connected_parts
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools

Double = NDArray[np.float64]

EXACT = FAST | {"fastmath": False}  # a compiler that may take (a - b) + b for a leaves no errors to share out
# [m d^2] added to moments of inertia; numerical; particles nearly in a row are hardly spun about it
ROW = 1e-3


@njit(**FAST)
def sum_momenta(part, position, velocity, phase, mass, sums):
    """Add m, m x, m v, m x cross v of every particle to its part's row of `sums` (parts, 10) [kg, kg m, N s, N m s], in float64.

    part (N,) int32; position, velocity (3, N) [m, m/s]; phase (N,) uint8; mass (phases,) of a particle [kg].
    """
    for i in range(part.size):
        c, m = part[i], mass[phase[i]]
        x, y, z = np.float64(position[0, i]), np.float64(position[1, i]), np.float64(position[2, i])
        u, v, w = np.float64(velocity[0, i]), np.float64(velocity[1, i]), np.float64(velocity[2, i])
        sums[c, 0] += m
        sums[c, 1] += m * x
        sums[c, 2] += m * y
        sums[c, 3] += m * z
        sums[c, 4] += m * u
        sums[c, 5] += m * v
        sums[c, 6] += m * w
        sums[c, 7] += m * (y * w - z * v)
        sums[c, 8] += m * (z * u - x * w)
        sums[c, 9] += m * (x * v - y * u)


@njit(**FAST)
def momenta(sums, owner, place, impulse, result):
    """Fill `result` (parts, 6) with the momentum of each part and the impulses that its bodies have received [N s, N m s].

    sums     (parts, 10) as from `sum_momenta`
    owner    (B,) int32, part to which a body belongs, or -1
    place    (B, 3) of the body's centre of mass [m]
    impulse  (B, 6) that the body has received [N s, N m s]

    Angular momentum is that about the origin. For liquid that touches no body it is that about the part's own centre: the scheme keeps the
    orbital rest but for the rounding of positions, for which small drops far from the origin would have to spin.
    """
    for c in range(sums.shape[0]):
        m, x, y, z = sums[c, 0], sums[c, 1], sums[c, 2], sums[c, 3]
        u, v, w = sums[c, 4], sums[c, 5], sums[c, 6]
        result[c, 0], result[c, 1], result[c, 2] = u, v, w
        result[c, 3] = sums[c, 7] - (y * w - z * v) / m
        result[c, 4] = sums[c, 8] - (z * u - x * w) / m
        result[c, 5] = sums[c, 9] - (x * v - y * u) / m
    for b in range(owner.size):
        for axis in range(3):
            if owner[b] >= 0:
                result[owner[b], 3 + axis] = sums[owner[b], 7 + axis]
    for b in range(owner.size):
        c = owner[b]
        if c >= 0:
            for axis in range(3):
                result[c, axis] += impulse[b, axis]
            result[c, 3] += place[b, 1] * impulse[b, 2] - place[b, 2] * impulse[b, 1] + impulse[b, 3]
            result[c, 4] += place[b, 2] * impulse[b, 0] - place[b, 0] * impulse[b, 2] + impulse[b, 4]
            result[c, 5] += place[b, 0] * impulse[b, 1] - place[b, 1] * impulse[b, 0] + impulse[b, 5]


@njit(**FAST)
def sum_inertia(part, position, phase, mass, center, inertia):
    """Add m (r^2 1 - r r^T) of every particle to its part's `inertia` (parts, 3, 3) [kg m2] about `center` (parts, 3) [m].

    part (N,) int32; position (3, N) [m]; phase (N,) uint8; mass (phases,) of a particle [kg].
    """
    for i in range(part.size):
        c, m = part[i], mass[phase[i]]
        x, y, z = position[0, i] - center[c, 0], position[1, i] - center[c, 1], position[2, i] - center[c, 2]
        inertia[c, 0, 0] += m * (y * y + z * z)
        inertia[c, 1, 1] += m * (x * x + z * z)
        inertia[c, 2, 2] += m * (x * x + y * y)
        inertia[c, 1, 0] -= m * x * y
        inertia[c, 2, 0] -= m * x * z
        inertia[c, 2, 1] -= m * y * z
    for c in range(center.shape[0]):
        inertia[c, 0, 1], inertia[c, 0, 2], inertia[c, 1, 2] = inertia[c, 1, 0], inertia[c, 2, 0], inertia[c, 2, 1]


class RigidMotion(NamedTuple):
    """Motion of each part of the liquid: center X [m], speed u [m/s] and rate w [1/s], all (parts, 3) float64."""

    center: Double
    speed: Double
    rate: Double


@njit(**EXACT)
def add_rigid_motion(part, position, phase, mass, motion, left, velocity):
    """Add u + w cross (x - X) of its part to each particle's velocity (3, N) [m/s].

    part      (N,) int32, part of each particle
    position  (3, N) [m]
    phase     (N,) uint8, index of each particle's liquid
    mass      (phases,) of a particle [kg]
    motion    the parts' `RigidMotion`
    left      (parts, 3) momentum that rounding leaves over [N s], 0 at first; it goes to the next particle of the part
    """
    center, speed, rate = motion.center, motion.speed, motion.rate
    for i in range(part.size):
        c, m = part[i], mass[phase[i]]
        x, y, z = position[0, i] - center[c, 0], position[1, i] - center[c, 1], position[2, i] - center[c, 2]
        u = velocity[0, i] + (speed[c, 0] + rate[c, 1] * z - rate[c, 2] * y + left[c, 0] / m)
        v = velocity[1, i] + (speed[c, 1] + rate[c, 2] * x - rate[c, 0] * z + left[c, 1] / m)
        w = velocity[2, i] + (speed[c, 2] + rate[c, 0] * y - rate[c, 1] * x + left[c, 2] / m)
        velocity[0, i], velocity[1, i], velocity[2, i] = np.float32(u), np.float32(v), np.float32(w)
        left[c, 0], left[c, 1], left[c, 2] = (
            m * (u - velocity[0, i]),
            m * (v - velocity[1, i]),
            m * (w - velocity[2, i]),
        )


class MomentumCorrection:
    """Correction of the momentum of the liquid's parts over one step: `watch` the blocks that may lose it, then `give_back`."""

    def __init__(self, tools: StepTools, arrays: StepArrays, state: FluidState) -> None:
        self._tools, self._state, self._count = tools, state, 0
        hood = arrays.neighborhood
        held = tools.walls.rest_is_touched(hood.walls, arrays.by_body, arrays.touching)
        if held or state.asleep or state.count == 0:
            return
        with tools.stage("rotation"):
            self._part, self._owner, self._count = connected_parts(
                hood.fluid, arrays.body_pairs, len(tools.walls.moving), state.count
            )
        self._mass = tools.config.rest_volume * tools.constants.densities
        self._lost = np.zeros((self._count, 6))

    @contextmanager
    def watch(self) -> Iterator[None]:
        """Count as lost the momentum that a block takes from the parts and does not give to their bodies."""
        if not self._count:
            yield
            return
        before = self._present()
        yield
        self._lost += before - self._present()

    def give_back(self) -> None:
        """Give every part the momentum back that it has lost, as a rigid motion."""
        if not self._count:
            return
        tools, state = self._tools, self._state
        with tools.stage("rotation"):
            mass, center = self._sums[:, :1], self._sums[:, 1:4] / self._sums[:, :1]
            speed, rate, turn = self._lost[:, :3] / mass, np.zeros((self._count, 3)), self._lost[:, 3:].copy()
            beside = np.unique(self._owner[self._owner >= 0])
            turn[beside] -= np.cross(center[beside], self._lost[beside, :3])  # theirs is about the origin
            if not any(tools.config.periodic):
                row = ROW * tools.config.particle_spacing**2 * mass
                inertia = row[:, :, None] * np.eye(3)
                sum_inertia(self._part, state.position, state.phase, self._mass, center, inertia)
                rate[:] = np.linalg.solve(inertia, turn[:, :, None])[:, :, 0]
                rate += np.linalg.solve(inertia, (row * rate)[:, :, None])[:, :, 0]  # what ROW has kept back
            left = np.zeros_like(speed)
            motion = RigidMotion(center, speed, rate)
            add_rigid_motion(self._part, state.position, state.phase, self._mass, motion, left, state.velocity)

    def _present(self) -> Double:
        """Return the present momenta (parts, 6) (see `momenta`)."""
        tools, state = self._tools, self._state
        with tools.stage("rotation"):
            self._sums = sums = np.zeros((self._count, 10))
            result = np.empty((self._count, 6))
            sum_momenta(self._part, state.position, state.velocity, state.phase, self._mass, sums)
            bodies = tools.walls.moving.values()
            place = np.array([body.position for body in bodies]).reshape(-1, 3)
            impulse = np.array([body.impulse for body in bodies]).reshape(-1, 6)
            momenta(sums, self._owner, place, impulse, result)
        return result

"""Liquid off all walls at rest gets back the momentum, linear and angular, that the scheme takes from it.

Relaxation moves particles and keeps the sum of their momenta, and pairs of the filter, of viscosity and of pressure do not act along their
line of centres: so a connected part of the liquid, with the bodies that it touches, loses dL. Velocities are rounded at every kick, which
takes dP, some 1e-9 of the momenta of its particles a step. Of all changes of its velocity that restore both, a rigid motion takes the
least kinetic energy:

    v_i += dP / M + w x (x_i - X),    I w = dL,    I = sum m (r^2 1 - r r^T),   r = x_i - X,  X the part's centre of mass.

Most of these changes are smaller than what a velocity in single precision can be changed by. What rounding takes from one particle is
therefore given to the next one of its part, like the error that a printer spreads over neighbouring dots (Floyd and Steinberg 1976).

Parts that do not hang together do not turn each other. Real torques, of gravity and of what drives the sea, act between what is
watched and stay. Where a part cannot turn (a single particle; a row of them, about itself) nothing is given.

Where space repeats angular momentum has no meaning, and dL is taken for 0. Nothing is computed while any liquid touches a wall at rest,
which exchanges momentum with all that hangs together with it: to tell what does not would cost one per cent of every step in a tank. What
sleeps holds the rest like a wall.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

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
ROW = 1e-3  # of m d^2, added to moments of inertia: what lies nearly in a row is hardly spun about itself


@njit(**FAST)
def sum_momenta(part, position, velocity, phase, mass, sums):
    """Add m, m x, m v, m x cross v of every particle to its part's row of `sums` (parts, 10); mass [kg] per phase."""
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
    """Fill `result` (parts, 6) with linear and angular momentum of parts and of what their bodies have received; `sums` as above.

    owner (B,) part of a body or -1; place (B, 3) [m] and impulse (B, 6) [N s, N m s] of its centre of mass. Of liquid that touches no body
    the angular one is that about its own centre: its orbital part is kept but for the rounding of positions, for which small drops far from
    the origin would have to spin.
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
    """Add m (r^2 1 - r r^T) of every particle to its part's `inertia` (parts, 3, 3) about `center` (parts, 3)."""
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


@njit(**EXACT)
def give(part, position, phase, mass, center, speed, rate, left, velocity):
    """velocity (3, N) += u + w cross (x - X) of the part; speed u [m/s], rate w [1/s], center X [m] (parts, 3); mass [kg] per phase.

    Momentum that rounding leaves over goes to the next particle of the part; `left` (parts, 3) [N s], 0 at first, is what the last leaves.
    """
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
    """That of the liquid's parts over one step, from the search on: `watch` what may lose it, then `give_back`."""

    def __init__(self, tools: StepTools, arrays: StepArrays, state: FluidState) -> None:
        self._tools, self._state, self._count = tools, state, 0
        hood = arrays.neighborhood
        held = tools.walls.rest_is_touched(hood.walls, arrays.by_body, arrays.touching)
        if held or state.asleep or state.count == 0:
            return
        with tools.stage("rotation"):
            self._part, self._owner, self._count = connected_parts(
                hood.fluid, hood.walls, tools.walls, arrays.touching, state.count
            )
        self._mass = tools.config.rest_volume * tools.constants.densities
        self._lost = np.zeros((self._count, 6))

    @contextmanager
    def watch(self) -> Iterator[None]:
        """What a block takes from the parts and does not give to their bodies is lost."""
        if not self._count:
            yield
            return
        before = self._present()
        yield
        self._lost += before - self._present()

    def give_back(self) -> None:
        """Move every part by what it has lost."""
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
            give(self._part, state.position, state.phase, self._mass, center, speed, rate, left, state.velocity)

    def _present(self) -> Double:
        """See `momenta`."""
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

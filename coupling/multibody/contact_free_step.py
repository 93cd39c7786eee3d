"""One sub-step of bodies that touch nothing, without the engine.

The same symplectic step as the engine's (`coupling.bullet.engine_step`), with the impulses of contacts left out. Over a sub-step h,
with F the force and tau the torque of all wrenches, those of joints included:

    v_1 = v_0 + h (F / m + g),   x_1 = x_0 + h v_1
    L_1 = L_0 + h tau,           R_1 = exp(h omega') R_0,   omega_1 = I_1^-1 L_1.

A body without joints turns with the velocity of the middle of the sub-step, omega' = I_m^-1 L_0 + h I_0^-1 tau with
R_m = exp(h omega_0 / 2) R_0. A jointed body turns with the velocity for which its joints were solved,
omega' = w - h I_0^-1 (w x I_0 w) with w = omega_0 + h I_0^-1 tau.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.backend.jit import njit
from oilsim.loads.body_axes import into_body, write_matrix


class FreeBodies(NamedTuple):
    """The bodies that move: row (F,) of each, is_jointed (F,); of all rows mass (B,) [kg], inertia and its inverse (B, 3, 3) [kg m2]."""

    row: Ints
    is_jointed: Flags
    mass: Array
    inertia: Array
    inverse_inertia: Array


@njit(nogil=True, cache=True, error_model="numpy")
def step_without_contacts(
    bodies: FreeBodies, pose: Array, twist: Array, wrench: Array, gravity: Array, sub_step: float
) -> None:
    """Move bodies, in place, by `wrench` (B, 6) [N, N m] and gravity (3,) [m/s2] over `sub_step` [s]; pose (B, 7), twist (B, 6)."""
    turn, momentum, turning, spin, room = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    middle = np.empty(4)
    for n in range(len(bodies.row)):
        b = bodies.row[n]
        inertia, inverse = bodies.inertia[b], bodies.inverse_inertia[b]
        orientation, rate = pose[b, 3:], twist[b, 3:]
        for axis in range(3):
            twist[b, axis] += sub_step * (wrench[b, axis] / bodies.mass[b] + gravity[axis])
            pose[b, axis] += sub_step * twist[b, axis]
        write_matrix(orientation, turn)
        _apply(turn, inertia, rate, momentum, room)
        _apply(turn, inverse, wrench[b, 3:], turning, room)
        if bodies.is_jointed[n]:
            for axis in range(3):
                spin[axis] = rate[axis] + sub_step * turning[axis]
            _gyrate(turn, inertia, inverse, spin, sub_step, turning, room)
        else:
            for axis in range(3):
                spin[axis] = 0.5 * rate[axis]
            middle[:] = orientation
            _turn(middle, spin, sub_step)
            write_matrix(middle, turn)
            _apply(turn, inverse, momentum, spin, room)
            for axis in range(3):
                spin[axis] += sub_step * turning[axis]
        _turn(orientation, spin, sub_step)
        write_matrix(orientation, turn)
        for axis in range(3):
            momentum[axis] += sub_step * wrench[b, 3 + axis]
        _apply(turn, inverse, momentum, rate, room)


@njit(nogil=True, cache=True, error_model="numpy")
def _gyrate(
    turn: Array, inertia: Array, inverse: Array, spin: Array, sub_step: float, result: Array, room: Array
) -> None:
    """Subtract h I^-1 (w x I w) from w, `spin` (3,) [rad/s], in place; `result` and `room` (3,) are room for it."""
    _apply(turn, inertia, spin, result, room)
    x = spin[1] * result[2] - spin[2] * result[1]
    y = spin[2] * result[0] - spin[0] * result[2]
    z = spin[0] * result[1] - spin[1] * result[0]
    result[0], result[1], result[2] = x, y, z
    _apply(turn, inverse, result, result, room)
    for axis in range(3):
        spin[axis] -= sub_step * result[axis]


@njit(nogil=True, cache=True, error_model="numpy")
def _apply(turn: Array, tensor: Array, vector: Array, result: Array, room: Array) -> None:
    """Write R T R^T v (3,) to `result`, which may be `vector`; turn R, tensor T (3, 3); `room` (3,)."""
    into_body(turn, vector, room)
    x = tensor[0, 0] * room[0] + tensor[0, 1] * room[1] + tensor[0, 2] * room[2]
    y = tensor[1, 0] * room[0] + tensor[1, 1] * room[1] + tensor[1, 2] * room[2]
    z = tensor[2, 0] * room[0] + tensor[2, 1] * room[1] + tensor[2, 2] * room[2]
    for axis in range(3):
        result[axis] = turn[axis, 0] * x + turn[axis, 1] * y + turn[axis, 2] * z


@njit(nogil=True, cache=True, error_model="numpy")
def _turn(orientation: Array, spin: Array, duration: float) -> None:
    """Turn a unit quaternion (4,) xyzw, in place, by `spin` (3,) [rad/s] over `duration` [s]."""
    rate = math.sqrt(spin[0] ** 2 + spin[1] ** 2 + spin[2] ** 2)
    half = 0.5 * rate * duration
    share = 0.5 * duration if half == 0.0 else math.sin(half) / rate
    a, b, c, d = share * spin[0], share * spin[1], share * spin[2], math.cos(half)
    x, y, z, w = orientation[0], orientation[1], orientation[2], orientation[3]
    x, y, z, w = (
        d * x + w * a + b * z - c * y,
        d * y + w * b + c * x - a * z,
        d * z + w * c + a * y - b * x,
        d * w - a * x - b * y - c * z,
    )
    size = math.sqrt(x * x + y * y + z * z + w * w)
    orientation[0], orientation[1], orientation[2], orientation[3] = x / size, y / size, z / size, w / size

"""Kinematics and pressure of linear (Airy) waves as compiled sums over components.

With theta = k . x - sigma t and the stretched height s (Wheeler 1970), s = h (h + z) / (h + eta) - h, each component adds

    eta  = a cos theta
    u    = a sigma cosh k(h + s) / sinh kh cos theta       along the component
    w    = a sigma sinh k(h + s) / sinh kh sin theta       upwards
    du/dt, dw/dt                                           as seen from water that the current carries
    p    = rho g a cosh k(h + s) / cosh kh cos theta       beyond the hydrostatic pressure

(Dean and Dalrymple 1991, ch. 3). Without stretching s = z. A point above the surface, or above the still level without stretching, takes
the value there; a point below the bottom takes that at the bottom.

Sine, cosine and exponential without branches or calls, so that a compiled loop over points uses vector instructions.

They are polynomials after a reduction of the argument. Their errors are below 1e-12, and below 1e-16 |theta| for angles of many turns.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import ALLOCATING, inlined
from oilsim.backend.thread_team import Team
from oilsim.sea.wave_components import StillWater, WaveComponents

# [rad] a turn; theory; 2 pi
TURN = 2.0 * math.pi
# [1] natural logarithm of 2; theory; ln 2
LOG_2 = math.log(2.0)
# [1] exponent below which the result counts as e^-700; numerical; 1e-304, and the exponent field of a double ends at -708
LOWEST = -700.0


@inlined
def sine_cosine(theta):
    """Compute (sin, cos) of an angle [rad] (scalar): Taylor series of a quarter of the reduced angle, then the angle doubled twice."""
    q = 0.25 * (theta - TURN * np.floor(theta * (1.0 / TURN) + 0.5))
    p = q * q
    s = q * (
        1 + p * (-1 / 6 + p * (1 / 120 + p * (-1 / 5040 + p * (1 / 362880 + p * (-1 / 39916800 + p / 6227020800)))))
    )
    c = -1 / 3628800 + p * (1 / 479001600 - p / 87178291200)
    c = 1 + p * (-1 / 2 + p * (1 / 24 + p * (-1 / 720 + p * (1 / 40320 + p * c))))
    s, c = 2.0 * s * c, c * c - s * s
    return 2.0 * s * c, c * c - s * s


@inlined
def exponential(y):
    """Compute exp(y) [-] (scalar): a power of 2, written into the exponent of a double, times a Taylor series; y up to 700."""
    y = max(y, LOWEST)
    n = np.floor(y * (1.0 / LOG_2) + 0.5)
    r = y - n * LOG_2
    e = 1 / 5040 + r * (1 / 40320 + r * (1 / 362880 + r * (1 / 3628800 + r * (1 / 39916800))))
    e = 1 + r * (1 + r * (1 / 2 + r * (1 / 6 + r * (1 / 24 + r * (1 / 120 + r * (1 / 720 + r * e))))))
    power = (np.int64(np.int32(n)) + np.int64(1023)) << np.int64(52)
    return e * np.int64(power).view(np.float64)


Double = NDArray[np.float64]

# [1] points that are summed together; numerical; their sums stay in the first cache
BLOCK = 256
# [1] numbers of a block for a point; layout; three of its place, eight of its values
ROWS = 11
# the first number of each row: place, stretched height, elevation, pressure, velocity, acceleration
X, Y, S, ETA, P, U, V, W, DU, DV, DW = (BLOCK * row for row in range(ROWS))
# [1] k h from which the bottom is out of reach; numerical; the terms left out are below e^-37 = 1e-16
DEEP = 37.0


class WaveField(NamedTuple):
    """Values of a wave field at N points.

    elevation (N,) [m] in the world; stretched (N,) [m], the height s; velocity (N, 3) [m/s]; acceleration (N, 3) [m/s2];
    pressure (N,) [Pa], with the hydrostatic pressure of the still level
    """

    elevation: Double
    stretched: Double
    pressure: Double
    velocity: Double
    acceleration: Double


def empty_field(count: int) -> WaveField:
    """Allocate a wave field for `count` points, with the shapes and units of `WaveField` ([m], [Pa], [m/s], (N,) and (N, 3))."""
    numbers = np.empty((9, count))  # in one piece: fresh memory costs more than a regular wave
    velocity, acceleration = numbers[3:6].reshape(count, 3), numbers[6:].reshape(count, 3)
    return WaveField(numbers[0], numbers[1], numbers[2], velocity, acceleration)


@njit(**ALLOCATING)
def sum_elevation(points, waves, phase, elevation):
    """Sum eta = a cos theta into `elevation` (N,) [m] at `points` (N, 2 or more) [m].

    waves: WaveComponents; phase (M,) [rad] from `WaveComponents.phase_at`.
    """
    count = points.shape[0]
    block = np.empty(ROWS * BLOCK)
    for start in range(0, count, BLOCK):
        size = min(BLOCK, count - start)
        for i in range(size):
            block[X + i], block[Y + i], block[ETA + i] = points[start + i, 0], points[start + i, 1], 0.0
        _add_elevation(block, size, waves, phase)
        for i in range(size):
            elevation[start + i] = block[ETA + i]


@njit(**ALLOCATING)
def sum_linear(begin, end, points, waves, phase, water, wheeler, field):
    """Sum the linear wave field at those from begin to end of `points` (N, 3) [m] into `field`, a WaveField.

    waves: WaveComponents; phase (M,) [rad]; water: StillWater; wheeler: whether heights are stretched.
    """
    h = water.depth
    block, angles = np.empty(ROWS * BLOCK), np.empty(2 * BLOCK * phase.shape[0])
    for start in range(begin, end, BLOCK):
        size = min(BLOCK, end - start)
        block[:] = 0.0
        for i in range(size):
            block[X + i], block[Y + i] = points[start + i, 0], points[start + i, 1]
        _add_angles(block, angles, size, waves, phase)
        for i in range(size):
            z, eta = points[start + i, 2] - water.level, block[ETA + i]
            stretched = min(max(h * (z - eta) / (h + eta), -h), 0.0)
            field.stretched[start + i] = stretched
            block[S + i] = stretched if wheeler else min(max(z, -h), 0.0)
        _add_kinematics(block, angles, size, waves, h)
        store(block, start, size, water, points, field)


@inlined
def store(block, start, size, water, points, field):
    """Write the rows of a block (ROWS * BLOCK,) [m, m2/s2, m/s, m/s2] to a WaveField, for `size` of its points (N, 3) [m] from `start`."""
    for i in range(size):
        n = start + i
        field.elevation[n] = block[ETA + i] + water.level
        field.pressure[n] = water.density * (block[P + i] - water.gravity * (points[n, 2] - water.level))
        field.velocity[n, 0], field.velocity[n, 1], field.velocity[n, 2] = block[U + i], block[V + i], block[W + i]
        field.acceleration[n, 0], field.acceleration[n, 1] = block[DU + i], block[DV + i]
        field.acceleration[n, 2] = block[DW + i]


@inlined
def _add_elevation(block, size, waves, phase):
    """Add a cos theta of all components to the row ETA of a block (ROWS * BLOCK,) [m]; phase (M,) [rad]."""
    for j in range(phase.shape[0]):
        a, k = waves.amplitude[j], waves.wave_number[j]
        k_x, k_y, shift = k * waves.toward_x[j], k * waves.toward_y[j], phase[j]
        for i in range(size):
            _, c = sine_cosine(k_x * block[X + i] + k_y * block[Y + i] - shift)
            block[ETA + i] += a * c


@inlined
def _add_angles(block, angles, size, waves, phase):
    """Add a cos theta of all components to the row ETA of a block (ROWS * BLOCK,) [m], and keep sin and cos of all in `angles`.

    angles (2 * BLOCK * M,) [-]: for each component a row of sines and one of cosines; phase (M,) [rad].
    """
    for j in range(phase.shape[0]):
        a, k = waves.amplitude[j], waves.wave_number[j]
        k_x, k_y, shift, row = k * waves.toward_x[j], k * waves.toward_y[j], phase[j], 2 * BLOCK * j
        for i in range(size):
            s, c = sine_cosine(k_x * block[X + i] + k_y * block[Y + i] - shift)
            angles[row + i], angles[row + BLOCK + i] = s, c
            block[ETA + i] += a * c


@inlined
def _add_kinematics(block, angles, size, waves, h):
    """Add p / rho, u and du/dt of all components to the rows of a block (ROWS * BLOCK,) [m2/s2, m/s, m/s2].

    angles: from `_add_angles`; h [m] depth. One array holds all rows, at fixed distances, so that the compiler sees that they do not
    overlap.
    """
    for j in range(waves.amplitude.shape[0]):
        k, sigma, row = waves.wave_number[j], waves.frequency[j], 2 * BLOCK * j
        to_x, to_y, celerity = waves.toward_x[j], waves.toward_y[j], sigma / k
        twice = np.exp(-2.0 * k * h)
        scale = waves.amplitude[j] * sigma / (1.0 - twice)
        if k * h > DEEP:
            for i in range(size):
                s, c = angles[row + i], angles[row + BLOCK + i]
                flat = scale * exponential(k * block[S + i])
                _add_terms(block, i, (flat * s, flat * c, flat * s, flat * c), (sigma, celerity, to_x, to_y))
        else:
            for i in range(size):
                s, c = angles[row + i], angles[row + BLOCK + i]
                fall = exponential(k * block[S + i])
                down, up = scale * fall, scale * twice / fall
                flat, steep = down + up, down - up
                _add_terms(block, i, (flat * s, flat * c, steep * s, steep * c), (sigma, celerity, to_x, to_y))


@inlined
def _add_terms(block, i, speeds, wave):
    """Add the terms of one component to the place i of a block.

    speeds [m/s]: horizontal times sin and cos theta, vertical times sin and cos theta; wave: sigma, celerity, direction.
    """
    flat_s, flat_c, steep_s, steep_c = speeds
    sigma, celerity, to_x, to_y = wave
    rate = sigma * flat_s
    block[P + i] += celerity * flat_c
    block[U + i] += to_x * flat_c
    block[V + i] += to_y * flat_c
    block[W + i] += steep_s
    block[DU + i] += to_x * rate
    block[DV + i] += to_y * rate
    block[DW + i] -= sigma * steep_c


def linear_field(
    points: Double, waves: WaveComponents, phase: Double, water: StillWater, *, wheeler: bool, team: Team | None = None
) -> WaveField:
    """Evaluate linear waves at `points` (N, 3) [m] with the phases (M,) [rad] of one moment, on the threads of a team if there is one."""
    field = empty_field(len(points))
    arguments = points, waves, phase, water, wheeler, field
    if team is None:
        sum_linear(0, len(points), *arguments)
    else:
        team.run(sum_linear, len(points), *arguments)
    return field

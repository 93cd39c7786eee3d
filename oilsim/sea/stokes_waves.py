"""Regular waves to the second order of steepness (Stokes 1847; Dean and Dalrymple 1991, sec. 11.2), without a mean current of their own.

With theta = k x - sigma t and the linear dispersion relation, which holds to this order:

    eta = a cos theta + k a^2 / 4 cosh kh (2 + cosh 2kh) / sinh^3 kh cos 2 theta
    u   = a sigma cosh k(h + z) / sinh kh cos theta + 3/4 a^2 sigma k cosh 2k(h + z) / sinh^4 kh cos 2 theta
    w   = a sigma sinh k(h + z) / sinh kh sin theta + 3/4 a^2 sigma k sinh 2k(h + z) / sinh^4 kh sin 2 theta
    p   = rho (c u - (u^2 + w^2) / 2 + a^2 sigma^2 / (4 sinh^2 kh)),  c = sigma / k,  beyond the hydrostatic pressure

The pressure is Bernoulli's of a wave of permanent form, and is 0 at the surface to the second order. Heights are not stretched. A point
above the surface takes the value at the surface, one below the bottom that at the bottom.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import ALLOCATING, FAST, inlined
from oilsim.sea.dispersion_relation import second_harmonic
from oilsim.sea.linear_waves import (
    BLOCK,
    DEEP,
    DU,
    DV,
    DW,
    ETA,
    ROWS,
    P,
    S,
    U,
    V,
    W,
    WaveField,
    X,
    empty_field,
    store,
)  # fmt: skip
from oilsim.sea.vector_math import exponential, sine_cosine
from oilsim.sea.wave_components import StillWater, WaveComponents

Double = NDArray[np.float64]


@njit(**FAST)
def add_harmonic(points, waves, phase, second, elevation):
    """Write eta to the second order into `elevation` (N,) [m] at `points` (N, 2 or more) [m].

    waves: WaveComponents with one component; phase (1,) [rad]; second [m]: amplitude of the second harmonic.
    """
    k, a = waves.wave_number[0], waves.amplitude[0]
    k_x, k_y = k * waves.toward_x[0], k * waves.toward_y[0]
    for i in range(points.shape[0]):
        _, c = sine_cosine(k_x * points[i, 0] + k_y * points[i, 1] - phase[0])
        elevation[i] = a * c + second * (2.0 * c * c - 1.0)


@njit(**ALLOCATING)
def evaluate_stokes(points, waves, phase, water, second, field):
    """Write the wave field at `points` (N, 3) [m] into `field`, a WaveField.

    waves: WaveComponents with one component; phase (1,) [rad]; water: StillWater; second [m]: amplitude of the second harmonic.
    """
    k, h = waves.wave_number[0], water.depth
    k_x, k_y = k * waves.toward_x[0], k * waves.toward_y[0]
    count = points.shape[0]
    block = np.empty(ROWS * BLOCK)
    for start in range(0, count, BLOCK):
        size = min(BLOCK, count - start)
        for i in range(size):
            block[X + i] = k_x * points[start + i, 0] + k_y * points[start + i, 1] - phase[0]
            block[S + i] = points[start + i, 2] - water.level
        _evaluate_block(block, size, waves, second, h)
        for i in range(size):
            eta = block[ETA + i]
            field.stretched[start + i] = min(max(h * (block[S + i] - eta) / (h + eta), -h), 0.0)
        store(block, start, size, water, points, field)


@inlined
def _evaluate_block(block, size, waves, second, h):
    """Write eta, p / rho, u and du/dt into the rows of a block (ROWS * BLOCK,) [m, m2/s2, m/s, m/s2] from its angles (row X) [rad]."""
    k, sigma, a = waves.wave_number[0], waves.frequency[0], waves.amplitude[0]
    to_x, to_y, celerity = waves.toward_x[0], waves.toward_y[0], sigma / k
    once, mirror = 1.0 - np.exp(-2.0 * k * h), 0.0 if k * h > DEEP else 1.0
    first = a * sigma / once
    # 3/4 a^2 sigma k cosh 2k(h + z) / sinh^4 kh is this times e^2kz + e^-2k(z + 2h)
    double = 6.0 * a * a * sigma * k * np.exp(-2.0 * k * h) / once**4
    constant = a * a * sigma * sigma * np.exp(-2.0 * k * h) / (once * once)
    for i in range(size):
        s, c = sine_cosine(block[X + i])
        s_2, c_2 = 2.0 * s * c, 2.0 * c * c - 1.0
        eta = a * c + second * c_2
        z = max(min(block[S + i], eta), -h)
        down, up = exponential(k * z), mirror * exponential(-k * (z + 2.0 * h))
        flat, steep = first * (down + up), first * (down - up)
        flat_2, steep_2 = double * (down * down + up * up), double * (down * down - up * up)
        u, w = flat * c + flat_2 * c_2, steep * s + steep_2 * s_2
        rate = sigma * (flat * s + 2.0 * flat_2 * s_2)
        block[ETA + i], block[P + i] = eta, celerity * u - 0.5 * (u * u + w * w) + constant
        block[U + i], block[V + i], block[W + i] = to_x * u, to_y * u, w
        block[DU + i], block[DV + i] = to_x * rate, to_y * rate
        block[DW + i] = -sigma * (steep * c + 2.0 * steep_2 * c_2)


def stokes_field(points: Double, waves: WaveComponents, phase: Double, water: StillWater) -> WaveField:
    """Evaluate one wave to the second order at `points` (N, 3) [m] with its phase (1,) [rad] at one moment."""
    field = empty_field(len(points))
    second = second_harmonic(float(waves.amplitude[0]), float(waves.wave_number[0]), water.depth)
    evaluate_stokes(points, waves, phase, water, second, field)
    return field

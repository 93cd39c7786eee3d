"""Measuring tools: fits of waves, decay and growth, fronts, arrival, order of convergence. Plain arrays in, plain numbers out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares, minimize_scalar

Double = NDArray[np.float64]


def mode_amplitude(velocity: ArrayLike, mode: ArrayLike, mass: ArrayLike = 1.0) -> float:
    """Amplitude of a velocity field (3, N) along `mode` (3, N), sum m v.phi / sum m phi.phi, with `mass` (N,) or 1."""
    v, phi, m = (np.asarray(each, np.float64) for each in (velocity, mode, mass))
    return float((m * v * phi).sum() / (m * phi * phi).sum())


def decay_rate(time: ArrayLike, amplitude: ArrayLike) -> float:
    """Rate [1/s] of a exp(-rate t), by least squares of ln |amplitude| (n,) over `time` (n,) [s]."""
    return -float(np.polyfit(np.asarray(time, np.float64), np.log(np.abs(np.asarray(amplitude, np.float64))), 1)[0])


def growth_rate(time: ArrayLike, amplitude: ArrayLike, guess: float) -> float:
    """Rate n [1/s] of the best p exp(n t) + q exp(-n t) through `amplitude` (n,) at `time` (n,) [s]."""
    t, y = np.asarray(time, np.float64), np.asarray(amplitude, np.float64)

    def misfit(parameters: Double) -> Double:
        basis = np.stack([np.exp(parameters[0] * t), np.exp(-parameters[0] * t)], axis=1)
        return basis @ np.linalg.lstsq(basis, y, rcond=None)[0] - y

    return abs(float(least_squares(misfit, (guess,)).x[0]))


def front_position(x: ArrayLike, spacing: float, gap: float = 2.0) -> float:
    """Furthest x [m] reached by particles without a gap wider than `gap` spacings behind it, plus half a spacing.

    x (N,) holds the particles of the layer that is watched; drops that have left the body of liquid are not its front.
    """
    ordered = np.sort(np.asarray(x, np.float64))
    torn = np.flatnonzero(np.diff(ordered) > gap * spacing)
    return float(ordered[torn[0] if torn.size else -1]) + 0.5 * spacing


def steady_value(signal: ArrayLike) -> float:
    """Mean of `signal` (n,) under a Hann window: what it swings about, whether or not whole periods are seen."""
    y = np.asarray(signal, np.float64)
    return float(np.average(y, weights=np.hanning(y.size + 2)[1:-1]))


def profile_value(z: ArrayLike, value: ArrayLike, at: float, reach: float, degree: int = 2) -> float:
    """Polynomial fit of `value` (N,) over height z (N,) [m] within `reach` of `at`, read at `at`."""
    heights, values = np.asarray(z, np.float64) - at, np.asarray(value, np.float64)
    near = np.abs(heights) < reach
    return float(np.polynomial.Polynomial.fit(heights[near], values[near], degree)(0.0))


@dataclass(frozen=True)
class Shifted:
    """A curve moved in time on to measured points: the shift [their time], and the rms difference over the points' rms."""

    shift: float
    rms: float


def best_time_shift(
    time: ArrayLike, value: ArrayLike, points_time: ArrayLike, points_value: ArrayLike, largest: float
) -> Shifted:
    """The shift s within +-`largest` for which value(t - s) is nearest to the points; rms relative to each point's value."""
    t, v = np.asarray(time, np.float64), np.asarray(value, np.float64)
    tp, vp = np.asarray(points_time, np.float64), np.asarray(points_value, np.float64)

    def misfit(shift: float) -> float:
        return float(np.sqrt(np.mean((np.interp(tp - shift, t, v) / vp - 1.0) ** 2)))

    start = min(np.linspace(-largest, largest, 81), key=misfit)
    step = largest / 40.0
    best = minimize_scalar(misfit, bounds=(start - step, start + step), method="bounded")
    return Shifted(float(best.x), float(best.fun))


def power_law(time: ArrayLike, value: ArrayLike) -> tuple[float, float]:
    """Exponent p and coefficient C of C t^p by least squares of logarithms."""
    exponent, logarithm = np.polyfit(np.log(np.asarray(time, np.float64)), np.log(np.asarray(value, np.float64)), 1)
    return float(exponent), float(np.exp(logarithm))


def crossing_time(time: ArrayLike, signal: ArrayLike, threshold: float) -> float:
    """First time [s] at which `signal` (n,) rises through `threshold`, interpolated; NaN if it never does."""
    t, y = np.asarray(time, np.float64), np.asarray(signal, np.float64)
    above = np.flatnonzero(y >= threshold)
    if above.size == 0:
        return math.nan
    first = int(above[0])
    if first == 0:
        return float(t[0])
    share = (threshold - y[first - 1]) / (y[first] - y[first - 1])
    return float(t[first - 1] + share * (t[first] - t[first - 1]))

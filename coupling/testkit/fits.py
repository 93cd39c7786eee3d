"""Fits to measured signals: plain arrays in, plain numbers out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

Double = NDArray[np.float64]

STARTS = (0.85, 0.92, 1.0, 1.08, 1.15)  # of the guessed period


@dataclass(frozen=True)
class DampedCosine:
    """The function c + a exp(-rate t) cos(omega t + phase): period [s], decay rate [1/s], share of the amplitude lost a period."""

    amplitude: float
    rate: float
    omega: float
    phase: float
    offset: float

    @property
    def period(self) -> float:
        """2 pi / omega [s]."""
        return 2.0 * math.pi / self.omega

    @property
    def loss(self) -> float:
        """1 - exp(-rate T)."""
        return 1.0 - math.exp(-self.rate * self.period)

    def at(self, time: ArrayLike) -> Double:
        """Return the fitted curve (n,), in the signal's unit [-], at `time` (n,) [s]."""
        t = np.asarray(time, np.float64)
        return self.offset + self.amplitude * np.exp(-self.rate * t) * np.cos(self.omega * t + self.phase)


def fit_damped_cosine(time: ArrayLike, signal: ArrayLike, period: float) -> DampedCosine:
    """Fit a damped cosine by least squares to `signal` (n,) at `time` (n,) [s], from a guessed `period` [s] on.

    Linear in a cos, a sin and c, so only rate and omega are iterated; starts about the guess find the best.
    """
    t, y = np.asarray(time, np.float64), np.asarray(signal, np.float64)

    def linear_part(parameters: Double) -> tuple[Double, Double]:
        rate, omega = parameters
        decay = np.exp(-rate * t)
        basis = np.stack([decay * np.cos(omega * t), decay * np.sin(omega * t), np.ones_like(t)], axis=1)
        weights = np.linalg.lstsq(basis, y, rcond=None)[0]
        return weights, basis @ weights - y

    guess = 2.0 * math.pi / period
    fits = [
        least_squares(lambda p: linear_part(p)[1], (0.05 / period, share * guess), x_scale=(1.0 / period, guess))
        for share in STARTS
    ]
    rate, omega = min(fits, key=lambda fit: fit.cost).x
    cosine, sine, offset = linear_part(np.array([rate, omega]))[0]
    return DampedCosine(
        float(np.hypot(cosine, sine)), float(rate), float(omega), float(np.arctan2(-sine, cosine)), float(offset)
    )


def order_of_convergence(spacing: ArrayLike, error: ArrayLike) -> float:
    """Return the slope [1] of ln error (n,) over ln spacing (n,) [m] by least squares.

    NaN for fewer than two errors or where one is 0 or unknown.
    """
    d, e = np.asarray(spacing, np.float64), np.asarray(error, np.float64)
    if e.size < 2 or not (np.isfinite(e).all() and (e > 0.0).all()):
        return math.nan
    return float(np.polyfit(np.log(d), np.log(e), 1)[0])

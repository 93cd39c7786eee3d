"""The cos-2s spreading of wave directions (Longuet-Higgins, Cartwright and Smith 1963).

D(theta) = Gamma(s + 1) / (2 sqrt(pi) Gamma(s + 1/2)) cos^2s(theta / 2) from -pi to pi, whose integral is 1. The mean of cos theta is
s / (s + 1).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Double = NDArray[np.float64]

# [1] points of the integral over directions; numerical; quantiles are exact to 1e-5 rad
POINTS = 20001


def spreading(theta: Double, spread: float) -> Double:
    """Compute D(theta) (N,) [1/rad] at angles (N,) [rad] from the mean direction; spread s [-]."""
    scale = math.exp(math.lgamma(spread + 1.0) - math.lgamma(spread + 0.5)) / (2.0 * math.sqrt(math.pi))
    return scale * np.abs(np.cos(0.5 * theta)) ** (2.0 * spread)


def direction_quantiles(fraction: Double, spread: float | None) -> Double:
    """Return the angles (N,) [rad] below which the given fractions (N,) [-] of the energy lie; zeros for a spread of None."""
    if spread is None:
        return np.zeros_like(fraction)
    theta = np.linspace(-math.pi, math.pi, POINTS)
    density = spreading(theta, spread)
    below = np.append(0.0, np.cumsum(0.5 * (density[1:] + density[:-1])))
    return np.interp(fraction, below / below[-1], theta)

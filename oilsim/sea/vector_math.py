"""Sine, cosine and exponential without branches or calls, so that a compiled loop over points uses vector instructions.

They are polynomials after a reduction of the argument. Their errors are below 1e-12, and below 1e-16 |theta| for angles of many turns.
"""

from __future__ import annotations

import math

import numpy as np

from oilsim.backend.jit import inlined

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

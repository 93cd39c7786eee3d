"""The quasi-static elastic catenary of a mooring leg of several parts, which may lie on flat ground.

A part of length L, weight in water w [N/m] and axial stiffness EA hangs under the horizontal pull H, the same everywhere along the leg.
V is the vertical pull at its upper end, V_b = V - w L that at its lower one. With T = sqrt(H^2 + V^2):

    hanging:     x = H / w (asinh(V / H) - asinh(V_b / H)) + H L / EA
                 z = (T - T_b) / w + (V^2 - V_b^2) / (2 w EA)
    touching down, V_b < 0: the length V / w hangs, the rest lies and is stretched by H
                 x = H / w asinh(V / H) + L - V / w + H L / EA
                 z = (T - H) / w + V^2 / (2 w EA)
    weightless:  x = L H / T + H L / EA,   z = L V / T + V L / EA

The ground carries what lies on it without friction, so the pull at the anchor is told a little too high. Sources: Irvine 1981, Cable
Structures, chapter 1; Jonkman 2007, NREL/TP-500-41958, section 2.6.2. Whatever flows past the leg is left out: its drag and inertia.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.backend.jit import njit

# [N] horizontal pull below which a leg counts as slack; numerical
SLACK = 1e-3
# [1] weight of a part over the pull, below which it is taken as weightless; numerical; the sag is then under 1e-7 of the length
LIGHT = 1e-6
# [1] error of a distance over the length of the leg; numerical
EXACT = 1e-11
# [1] steps of each of the two nested solutions; numerical; bisection alone needs 50
STEPS = 100


class Pull(NamedTuple):
    """The pull of a leg.

    horizontal: [N]; vertical: downwards at its upper end [N]; at_anchor: upwards there [N]; stiffness: d(horizontal) / d(distance) [N/m];
    stiffest: a bound on the stiffness [N/m] in any direction, the norm of d(horizontal, vertical) / d(distance, height).
    """

    horizontal: float
    vertical: float
    at_anchor: float
    stiffness: float
    stiffest: float


@njit(nogil=True, cache=True, error_model="numpy")
def span_of(parts: Array, horizontal: float, vertical: float) -> Array:
    """Return distance and height [m] that a leg spans, dx/dH, dx/dV, dz/dH, dz/dV [m/N], and the vertical pull at the anchor [N].

    parts (P, 3): length [m], weight in water [N/m] and axial stiffness [N], from the upper end down; horizontal and vertical pull [N] at
    the upper end, the first above 0 and the second 0 or more.
    """
    found = np.zeros(7)
    h, v = horizontal, vertical
    for k in range(len(parts)):
        length, weight, give = parts[k, 0], parts[k, 1], parts[k, 0] / parts[k, 2]
        top = np.sqrt(h * h + v * v)
        found[0] += h * give
        found[2] += give
        if weight * length <= LIGHT * top:
            found[0] += length * h / top
            found[1] += length * v / top + v * give
            found[2] += length * v * v / top**3
            found[3] -= length * h * v / top**3
            found[4] -= length * h * v / top**3
            found[5] += length * h * h / top**3 + give
            v = max(0.0, v - weight * length)
            continue
        low = max(0.0, v - weight * length)
        foot = np.sqrt(h * h + low * low)
        hanging = (v - low) / weight
        arc = (np.arcsinh(v / h) - np.arcsinh(low / h)) / weight
        found[0] += h * arc + length - hanging
        found[1] += (top - foot) / weight + (v * v - low * low) / (2.0 * weight * length) * give
        found[2] += arc - (v / top - low / foot) / weight
        found[4] += h * (1.0 / top - 1.0 / foot) / weight
        if v >= weight * length:  # it hangs as a whole, and its foot's pull grows with that of its top
            found[3] += h * (1.0 / top - 1.0 / foot) / weight
            found[5] += (v / top - low / foot) / weight + give
        else:
            found[3] += (h / top - 1.0) / weight
            found[5] += v / top / weight + v / (weight * length) * give
        v = low
    found[6] = v
    return found


@njit(nogil=True, cache=True, error_model="numpy")
def vertical_for(parts: Array, height: float, horizontal: float, guess: float) -> float:
    """Return the vertical pull [N] at the upper end with which a leg under `horizontal` [N] spans `height` [m], 0 or more.

    parts (P, 3): as of `span_of`.
    """
    low, high = 0.0, max(guess, 1.0)
    while span_of(parts, horizontal, high)[1] < height:
        low, high = high, 2.0 * high
    tolerance = EXACT * parts[:, 0].sum()
    v = min(max(guess, low), high)
    for _ in range(STEPS):
        found = span_of(parts, horizontal, v)
        error = found[1] - height
        if abs(error) <= tolerance:
            break
        if error > 0.0:
            high = v
        else:
            low = v
        step = v - error / found[5] if found[5] > 0.0 else low
        v = step if low < step < high else 0.5 * (low + high)
    return v


@njit(nogil=True, cache=True, error_model="numpy")
def pull_of(parts: Array, distance: float, height: float, guess: tuple[float, float]) -> Pull:
    """Return the pull of a leg whose upper end is `distance` and `height` [m] from its anchor, height 0 or more.

    parts (P, 3): as of `span_of`; guess: horizontal and vertical pull [N] near the solution; any two numbers above 0 do.
    A slack leg pulls only down, by what hangs.
    """
    h, v = max(guess[0], SLACK), guess[1]
    low, high = SLACK, max(2.0 * h, 1.0)
    v = vertical_for(parts, height, SLACK, v)
    found = span_of(parts, SLACK, v)
    if found[0] >= distance:
        return Pull(0.0, v, found[6], 0.0, 1.0 / found[5] if found[5] > 0.0 else 0.0)
    while span_of(parts, high, vertical_for(parts, height, high, v))[0] < distance:
        low, high = high, 2.0 * high
    h = min(max(h, low), high)
    tolerance = EXACT * parts[:, 0].sum()
    for _ in range(STEPS):
        v = vertical_for(parts, height, h, v)
        found = span_of(parts, h, v)
        slope = found[2] - found[3] * found[4] / found[5] if found[5] > 0.0 else found[2]
        error = found[0] - distance
        if abs(error) <= tolerance:
            break
        if error > 0.0:
            high = h
        else:
            low = h
        step = h - error / slope
        h = step if low < step < high else 0.5 * (low + high)
    area = found[2] * found[5] - found[3] * found[4]
    norm = np.sqrt(found[2] ** 2 + found[3] ** 2 + found[4] ** 2 + found[5] ** 2)
    return Pull(h, v, found[6], 1.0 / slope, norm / area if area > 0.0 else 1.0 / slope)


@njit(nogil=True, cache=True, error_model="numpy")
def distance_under(parts: Array, height: float, horizontal: float) -> tuple[float, float, float]:
    """Return the distance [m] that a leg spans under `horizontal` [N] at `height` [m], and the vertical pulls at its ends [N].

    parts (P, 3): as of `span_of`.
    """
    v = vertical_for(parts, height, max(horizontal, SLACK), 1.0)
    found = span_of(parts, max(horizontal, SLACK), v)
    return found[0], v, found[6]


@njit(nogil=True, cache=True, error_model="numpy")
def tensions(parts: Array, horizontal: float, vertical: float) -> Array:
    """Return the tension (P,) [N] at the upper end of each part, which is its largest."""
    found = np.zeros(len(parts))
    v = vertical
    for k in range(len(parts)):
        found[k] = np.sqrt(horizontal * horizontal + v * v)
        v = max(0.0, v - parts[k, 0] * parts[k, 1])
    return found

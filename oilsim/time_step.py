"""Adaptive time step (Qiu et al. 2021, Eq. 30-31)."""

from __future__ import annotations

import math


def cfl_time_step(spacing: float, largest_speed: float, cfl: float, minimum: float, maximum: float) -> float:
    """max(t_min, min(cfl d / v_max, t_max)) [s]; spacing d [m], largest_speed v_max [m/s], cfl the lambda of Eq. 30."""
    limit = math.inf if largest_speed == 0.0 else cfl * spacing / largest_speed
    return max(minimum, min(limit, maximum))


def equal_steps(remaining: float, time_step: float) -> float:
    """The longest step, at most `time_step`, of which a whole number fills `remaining` [s]."""
    return remaining / max(1, math.ceil(remaining / time_step * (1.0 - 1e-9)))

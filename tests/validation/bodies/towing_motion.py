"""Motion of a body that is towed from rest to a steady speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from coupling.multibody.prescribed_motion import UPRIGHT, Motion, Quaternion, Vector


@dataclass(frozen=True, kw_only=True)
class TowingMotion:
    """A motion from rest to a steady velocity [m/s] and, at `end` [s], to rest at once.

    v(t) = V r(t), r = (1 - cos(pi tau / t_r)) / 2 until tau = t - t_0 = t_r, then 1. While the velocity rises,
    x = x_0 + V (tau / 2 - t_r sin(pi tau / t_r) / (2 pi)), then x = x_0 + V (tau - t_r / 2).
    """

    position: Vector
    velocity: Vector
    orientation: Quaternion = UPRIGHT
    start: float = 0.0
    rise_time: float = 0.0
    end: float = math.inf

    def at(self, time: float) -> Motion:
        """Return the motion at `time` [s]; see `PrescribedMotion.at`."""
        elapsed = min(time, self.end) - self.start
        seconds, share = _risen(elapsed, self.rise_time)
        velocity = np.array(self.velocity)
        moving = 0.0 if time >= self.end else share
        return Motion(np.array(self.position) + seconds * velocity, np.array(self.orientation), moving * velocity)


def _risen(elapsed: float, rise_time: float) -> tuple[float, float]:
    """Compute distance / V [s] and speed / V after `elapsed` [s] under way, with the smooth rise of `TowingMotion`."""
    if elapsed <= 0.0:
        return 0.0, 0.0
    if elapsed >= rise_time:
        return elapsed - 0.5 * rise_time, 1.0
    angle = math.pi * elapsed / rise_time
    return 0.5 * elapsed - 0.5 * rise_time * math.sin(angle) / math.pi, 0.5 * (1.0 - math.cos(angle))

"""Prescribed motions: a piston, a towed plate, a wave maker.

A prescribed motion is a function of time that gives pose and twist of the centre of mass; the twist is the exact derivative of the pose.
Frames and units as in `coupling.master.participant`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from oilsim.backend.arrays import Array

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Twist = Sequence[float] | Array  # (6,) linear [m/s] and angular velocity [rad/s]

STILL: Vector = (0.0, 0.0, 0.0)
AT_REST: Twist = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
UPRIGHT: Quaternion = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Motion:
    """Pose and twist at one instant: position (3,) [m], orientation (4,) xyzw, velocities (3,) [m/s], [rad/s]."""

    position: Array
    orientation: Array
    linear_velocity: Array = field(default_factory=lambda: np.zeros(3))
    angular_velocity: Array = field(default_factory=lambda: np.zeros(3))


class PrescribedMotion(Protocol):
    """A body's position at any time, which the fluid does not change."""

    def at(self, time: float) -> Motion:
        """Return pose and twist at `time` [s]."""


@dataclass(frozen=True, kw_only=True)
class OscillatingMotion:
    """A sinusoidal stroke along `direction` whose amplitude [m] grows smoothly over `ramp_time` [s]: a piston wave maker.

    s(t) = a r(t) sin(2 pi t / T),  r = (1 - cos(pi t / t_r)) / 2 until t_r, then 1;  x = x_0 + s e, at rest before 0. Raises ValueError for
    a period that is not above 0, a negative ramp_time, and a direction without length.
    """

    position: Vector
    direction: Vector
    amplitude: float
    period: float
    orientation: Quaternion = UPRIGHT
    ramp_time: float = 0.0

    def __post_init__(self) -> None:
        if not self.period > 0.0:
            raise ValueError(f"oscillating motion: period is {self.period} s, allowed: above 0")
        if not self.ramp_time >= 0.0:
            raise ValueError(f"oscillating motion: ramp_time is {self.ramp_time} s, allowed: 0 or more")
        if not np.linalg.norm(self.direction) > 0.0:
            raise ValueError(f"oscillating motion: direction is {self.direction}, allowed: longer than 0")

    def at(self, time: float) -> Motion:
        """Return pose and twist at `time` [s]; see `PrescribedMotion.at`."""
        axis = np.array(self.direction) / np.linalg.norm(self.direction)
        rate = 2.0 * math.pi / self.period
        ramp, ramp_rate = self._ramp(time)
        stroke = self.amplitude * ramp * math.sin(rate * time)
        speed = self.amplitude * (ramp_rate * math.sin(rate * time) + ramp * rate * math.cos(rate * time))
        return Motion(np.array(self.position) + stroke * axis, np.array(self.orientation), speed * axis)

    def _ramp(self, time: float) -> tuple[float, float]:
        """Return r and dr/dt [1/s]."""
        if time < 0.0:
            return 0.0, 0.0
        if time >= self.ramp_time:
            return 1.0, 0.0
        angle = math.pi * time / self.ramp_time
        return 0.5 * (1.0 - math.cos(angle)), 0.5 * math.sin(angle) * math.pi / self.ramp_time

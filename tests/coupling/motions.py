"""Prescribed motions of the tests: steady, and along straight legs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.multibody.prescribed_motion import STILL, UPRIGHT, Motion, Quaternion, Vector


@dataclass(frozen=True, kw_only=True)
class UniformMotion:
    """Constant velocity [m/s] and constant rate of turn [rad/s] from `start_time` [s] on; at rest before.

    x = x_0 + v (t - t_0), R = exp((t - t_0) omega) R_0
    """

    position: Vector
    orientation: Quaternion = UPRIGHT
    linear_velocity: Vector = STILL
    angular_velocity: Vector = STILL
    start_time: float = 0.0

    def at(self, time: float) -> Motion:
        """Return pose and twist at `time` [s]; see `PrescribedMotion.at`."""
        elapsed = time - self.start_time
        if elapsed < 0.0:
            return Motion(np.array(self.position), np.array(self.orientation))
        velocity, rate = np.array(self.linear_velocity), np.array(self.angular_velocity)
        turn = Rotation.from_rotvec(rate * elapsed) * Rotation.from_quat(self.orientation)
        return Motion(np.array(self.position) + velocity * elapsed, turn.as_quat(), velocity, rate)


@dataclass(frozen=True, kw_only=True)
class WaypointMotion:
    """Straight legs between `positions` [m] at `times` [s], at constant speed on each; at rest outside."""

    times: tuple[float, ...]
    positions: tuple[Vector, ...]
    orientation: Quaternion = UPRIGHT

    def at(self, time: float) -> Motion:
        """Return pose and twist at `time` [s]; see `PrescribedMotion.at`."""
        leg = int(np.searchsorted(self.times, time, side="right")) - 1
        orientation = np.array(self.orientation)
        if leg < 0 or leg >= len(self.times) - 1:
            return Motion(np.array(self.positions[max(leg, 0)]), orientation)
        begin, end = np.array(self.positions[leg]), np.array(self.positions[leg + 1])
        velocity = (end - begin) / (self.times[leg + 1] - self.times[leg])
        return Motion(begin + velocity * (time - self.times[leg]), orientation, velocity)

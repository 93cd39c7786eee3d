"""Flows for the slick's tests."""

from __future__ import annotations

import numpy as np


class UniformFlow:
    """A flow that is the same everywhere and always; `velocity` (2,) [m/s]."""

    def __init__(self, velocity: tuple[float, float] = (0.0, 0.0)) -> None:
        self.velocity = np.asarray(velocity, np.float64)

    def surface_velocity(self, points_xy, time):
        return np.tile(self.velocity, (len(points_xy), 1))


class Rotation:
    """Water that turns about the origin with `rate` [rad/s]."""

    def __init__(self, rate: float) -> None:
        self.rate = rate

    def surface_velocity(self, points_xy, time):
        return self.rate * np.stack([-points_xy[:, 1], points_xy[:, 0]], axis=1)


class Swell:
    """Water that runs at `mean` in +x, and to and fro by `swing` about it [m/s] with a period of 3 s; the mean turns after `turn` [s]."""

    def __init__(self, mean: float, swing: float, turn: float) -> None:
        self.mean, self.swing, self.turn = mean, swing, turn

    def surface_velocity(self, points_xy, time):
        mean = self.mean if time < self.turn else -self.mean
        return np.tile([mean + self.swing * np.sin(2.0 * np.pi * time / 3.0), 0.0], (len(points_xy), 1))


class Tide:
    """A stream in +x that turns after `turn` [s]."""

    def __init__(self, speed: float, turn: float) -> None:
        self.speed, self.turn = speed, turn

    def surface_velocity(self, points_xy, time):
        return np.tile([self.speed if time < self.turn else -self.speed, 0.0], (len(points_xy), 1))

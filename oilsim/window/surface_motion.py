"""The motion at the surface of a window beyond the sea's: what bodies and oil add, by which oil too thin for particles is carried along."""

from __future__ import annotations

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.slick.slick import SurfaceFlow
from oilsim.window.window import Window

# [d] of depth from which the motion is taken; numerical; two layers, of which one alone is noisy
DEPTH = 2.0
# [d] across a cell; numerical; some eight particles of two layers
CELL = 2.0


class SurfaceMotion:
    """Mean horizontal velocity of the uppermost particles by cells, interpolated between their middles; 0 outside the window."""

    def __init__(self, window: Window) -> None:
        self._window = window
        size = np.array(window.rim.size)
        self._cells = np.maximum(1, np.floor(size / (CELL * window.settings.spacing))).astype(int)
        self._width = size / self._cells
        self._origin = np.zeros(2)
        self._velocity = np.zeros((*(self._cells + 2), 2))  # with a ring of cells at rest

    def measure(self, time: float) -> None:
        """Take the motion of the particles now, at `time` [s]."""
        window = self._window
        state, rim = window.fluid.state, window.rim
        level = window.motion.sea.description.level
        top = np.flatnonzero(state.position[2] > level - DEPTH * window.settings.spacing)
        place = rim.about_center(state.position[:, top].T)[:, :2]
        half = 0.5 * np.array(rim.size)
        self._origin = rim.center - half + window.motion.travel(time)[:2]
        cell = np.clip(((place - rim.center + half) / self._width).astype(int), 0, self._cells - 1)
        index = (cell[:, 0] + 1) * (self._cells[1] + 2) + cell[:, 1] + 1
        count = np.bincount(index, minlength=self._velocity[..., 0].size)
        for axis in (0, 1):
            total = np.bincount(index, state.velocity[axis, top].astype(np.float64), count.size)
            self._velocity[..., axis] = (total / np.maximum(count, 1)).reshape(self._velocity.shape[:2])

    def velocity(self, points: Array) -> Array:
        """Return the velocity (N, 2) [m/s] at points (N, 2) [m] in the world, waves aside."""
        at = np.clip((points - self._origin) / self._width + 0.5, 0.0, self._cells + 1.0 - 1e-9)
        low = np.floor(at).astype(int)
        share = at - low
        result = np.zeros((len(points), 2))
        for along in (0, 1):
            for across in (0, 1):
                weight = np.abs(1 - along - share[:, 0]) * np.abs(1 - across - share[:, 1])
                result += weight[:, None] * self._velocity[low[:, 0] + along, low[:, 1] + across]
        return result


class WindowFlow:
    """The motion of floating oil on a sea with a window: the sea's own, and what is added at the window's surface."""

    def __init__(self, sea: SurfaceFlow, motion: SurfaceMotion) -> None:
        self._sea, self._motion = sea, motion

    def surface_velocity(self, points_xy: Array, time: float) -> Array:
        """Return the velocity (N, 2) [m/s] at points (N, 2) [m] at `time` [s]."""
        return np.asarray(self._sea.surface_velocity(points_xy, time) + self._motion.velocity(points_xy))

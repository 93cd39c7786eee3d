"""The motion of a window's water beyond the sea's, by cells: what bodies and oil add.

At the surface it carries oil too thin for particles. Of an outer window it is the motion around the one inside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.backend.jit import njit
from oilsim.window.window import Window

if TYPE_CHECKING:
    from oilsim.slick.slick import SurfaceFlow

# [d] across a cell; numerical; some eight particles
CELL = 2.0


class WaterMotion:
    """Mean velocity of a window's particles by cells, interpolated between their middles; beside the window that of an outer one, or 0.

    By default it knows the uppermost cells alone, whose motion counts at the surface; `whole`: those of all depths.
    """

    def __init__(self, window: Window, *, whole: bool = False) -> None:
        self._window = window
        cell = CELL * window.settings.spacing
        size = np.array([*window.rim.size, window.depth if whole else cell])
        self._cells = np.maximum(1, np.floor(size / cell)).astype(int)
        self._width = size / self._cells
        self._origin, self._travel = np.zeros(3), np.zeros(2)
        self._velocity = np.zeros((*(self._cells[:2] + 2), self._cells[2], 3))  # with a ring of cells beside the window

    def measure(self, time: float) -> None:
        """Take the motion of the particles now, at `time` [s]."""
        window, cells = self._window, self._cells
        state, rim = window.fluid.state, window.rim
        bottom = window.motion.sea.description.level - self._width[2] * cells[2]
        chosen = np.flatnonzero(state.position[2] > bottom)
        place = rim.about_center(state.position[:, chosen].T)
        self._origin = np.append(rim.center - 0.5 * np.array(rim.size), bottom)
        self._travel = window.motion.travel(time)[:2]
        cell = np.clip(((place - self._origin) / self._width).astype(int), 0, cells - 1)
        index = ((cell[:, 0] + 1) * (cells[1] + 2) + cell[:, 1] + 1) * cells[2] + cell[:, 2]
        count = np.bincount(index, minlength=self._velocity[..., 0].size)
        for axis in range(3):
            total = np.bincount(index, state.velocity[axis, chosen].astype(np.float64), count.size)
            self._velocity[..., axis] = (total / np.maximum(count, 1)).reshape(self._velocity.shape[:3])
        if window.around is not None:
            ring = np.ones(self._velocity.shape[:3], bool)
            ring[1:-1, 1:-1] = False
            middles = self._origin + (np.argwhere(ring) - (0.5, 0.5, -0.5)) * self._width
            self._velocity[ring] = window.around.at_rest(middles)

    def at_rest(self, places: Array) -> Array:
        """Return the velocity (N, 3) [m/s] at places at rest (N, 3) [m]."""
        found = np.zeros((len(places), 3))
        _interpolate(np.ascontiguousarray(places, np.float64), self._origin, self._width, self._velocity, found)
        if self._window.around is not None:
            low, high = self._origin, self._origin + self._width * self._cells
            beside = ((places < low) | (places > high))[:, :2].any(1)
            found[beside] = self._window.around.at_rest(places[beside])
        return found

    def at_surface(self, points: Array) -> Array:
        """Return the velocity (N, 2) [m/s] at points (N, 2) [m] in the world, waves aside."""
        level = self._window.motion.sea.description.level
        return self.at_rest(np.column_stack([points - self._travel, np.full(len(points), level)]))[:, :2]


@njit(nogil=True, cache=True, error_model="numpy")
def _interpolate(places: Array, origin: Array, width: Array, velocity: Array, found: Array) -> None:
    """Add to found (N, 3) the velocity of the cells around places (N, 3) [m], by their distances along each axis."""
    along, across, down = velocity.shape[:3]
    for i in range(len(places)):
        x = min(max((places[i, 0] - origin[0]) / width[0] + 0.5, 0.0), along - 1.0 - 1e-9)
        y = min(max((places[i, 1] - origin[1]) / width[1] + 0.5, 0.0), across - 1.0 - 1e-9)
        z = min(max((places[i, 2] - origin[2]) / width[2] - 0.5, 0.0), down - 1.0)
        j, k, m = int(x), int(y), min(int(z), max(down - 2, 0))
        for a in range(2):
            for b in range(2):
                for c in range(min(down, 2)):
                    weight = abs(1 - a - (x - j)) * abs(1 - b - (y - k)) * abs(1 - c - (z - m))
                    for axis in range(3):
                        found[i, axis] += weight * velocity[j + a, k + b, m + c, axis]


class WindowFlow:
    """The motion of floating oil on a sea with a window: the sea's own, and what is added at the window's surface."""

    def __init__(self, sea: SurfaceFlow, motion: WaterMotion) -> None:
        self._sea, self._motion = sea, motion

    def surface_velocity(self, points_xy: Array, time: float) -> Array:
        """Return the velocity (N, 2) [m/s] at points (N, 2) [m] at `time` [s]."""
        return np.asarray(self._sea.surface_velocity(points_xy, time) + self._motion.at_surface(points_xy))

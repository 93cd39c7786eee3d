"""Regions of still water fall asleep: what lies there keeps its place and its pressure, and costs nothing.

The domain is cut into regions two supports wide. A region is loud while the particles that are awake in it move at more than the
sleep speed, root mean square, while a moving body is in it, or right after liquid was added. It falls asleep once it and all
regions around it have been quiet for SETTLED units of time, and wakes when one of those around it is loud: between what sleeps and what
moves there is at least one region of water that is awake and still, and whose motion would tell of a wave before it arrives.

Particles that are asleep lie behind the others in the state. To the water beside them they are water at rest under the pressure that
they had: density, gradients and the pressure solve count them, and none of them moves. So a motion slower than the sleep
speed may be stopped, and a wave that makes no faster one is taken up where the sleeping water begins; nothing else is changed. With gravity
alone: forcings, and pipes while they run, keep all the liquid awake.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST
from oilsim.backend.thread_team import Team
from oilsim.boundaries.walls import Walls
from oilsim.config import FluidConfig
from oilsim.neighborhood.cell_grid import count_sort
from oilsim.state import FluidState

Flags = NDArray[np.bool_]

WIDTH = 2.0  # supports across a region: wider than any step and any neighbourhood
SETTLED = 10.0  # units of time for which a region and those around it must be quiet before it falls asleep


@njit(**FAST)
def assign_regions(begin, end, position, lower, inverse_width, cells, region):
    """Fill `region` (N,) with the index of the region in which each of `position` (3, N) lies; those outside count as at the border."""
    for i in range(begin, end):
        place = np.int64(0)
        for axis in range(3):
            along = np.int64(math.floor((position[axis, i] - lower[axis]) * inverse_width[axis]))
            place = place * cells[axis] + min(max(along, 0), cells[axis] - 1)
        region[i] = place


@njit(**FAST)
def sum_squares(region, velocity, number, square):
    """Add to `number` and `square` [m2/s2] (regions,) the particles of each region and their v^2, those of `region` (n,)."""
    for i in range(region.size):
        u, v, w = np.float64(velocity[0, i]), np.float64(velocity[1, i]), np.float64(velocity[2, i])
        number[region[i]] += 1
        square[region[i]] += u * u + v * v + w * w


def with_surroundings(marked: Flags, periodic: tuple[bool, bool, bool]) -> Flags:
    """The marked regions (nx, ny, nz) and all that share a face, an edge or a corner with one."""
    for axis, repeats in enumerate(periodic):
        lower, upper = np.roll(marked, 1, axis), np.roll(marked, -1, axis)
        if not repeats:
            np.moveaxis(lower, axis, 0)[0] = np.moveaxis(upper, axis, 0)[-1] = False
        marked = marked | lower | upper
    return marked


class Parting(NamedTuple):
    """An order (N,) of the particles, of which the last `asleep` sleep and the first `bordering` of those lie beside what is awake."""

    order: NDArray[np.uint32]
    asleep: int
    bordering: int


class SleepingRegions:
    """Which regions sleep, and how long each has been quiet."""

    def __init__(self, config: FluidConfig, team: Team) -> None:
        self._team, self._periodic = team, config.periodic
        extent = np.subtract(config.upper, config.lower)
        cells = np.maximum(1, extent // (WIDTH * config.support_radius)).astype(np.int64)
        if config.dimension == 2:
            cells[1] = 1
        self._cells = (int(cells[0]), int(cells[1]), int(cells[2]))
        self._lower = tuple(np.float32(low) for low in config.lower)
        self._inverse_width = tuple(np.float32(share) for share in cells / extent)
        self._square = config.sleep_speed**2
        self._layout: object = None
        self._quiet = np.zeros(self._cells)
        self._asleep = self._parted = np.zeros(self._cells, bool)  # the second: as particles lie in the state

    def regions(self, position: NDArray[np.float32], count: int | None = None) -> NDArray[np.uint32]:
        """Region (n,) of each of the positions (3, N) [m], or of the first n = `count`."""
        region = np.empty(position.shape[1] if count is None else count, np.uint32)
        self._team.run(assign_regions, region.size, position, self._lower, self._inverse_width, self._cells, region)
        return region

    def wake(self, position: NDArray[np.float32]) -> None:
        """Wake the regions of the positions (3, N) [m] and those around them."""
        self._wake_around(self._flagged(self.regions(position)))

    def update(self, state: FluidState, walls: Walls, elapsed: float, driven: bool) -> Parting | None:
        """Let regions fall asleep or wake, and stop the particles that sleep; how the state is to be sorted, None if as it is.

        elapsed: the time since the last update in units of `time_unit`; driven: something else than gravity moves the liquid.
        """
        region = self.regions(state.position, state.awake)
        number, square = np.zeros((2, self._asleep.size))
        sum_squares(region, state.velocity, number, square)
        loud = (square > self._square * number).reshape(self._cells)
        if driven or walls.layout != self._layout:
            self._layout, loud = walls.layout, np.ones_like(loud)
        if walls.moving:
            walls.place()
            loud |= self._flagged(self.regions(walls.moving_position))
        self._quiet += elapsed
        self._wake_around(loud)
        calm = ~with_surroundings(self._quiet < SETTLED, self._periodic)
        strayed = (number > 0).reshape(self._cells)
        self._asleep = (self._asleep & ~strayed) | calm
        if np.array_equal(self._parted, self._asleep) and not (self._asleep & strayed).any():
            return None
        return self._part(state)

    def _wake_around(self, loud: Flags) -> None:
        """Loud regions wake, and those around them."""
        self._quiet[loud] = 0.0
        self._asleep = self._asleep & ~with_surroundings(loud, self._periodic)

    def _flagged(self, region: NDArray[np.uint32]) -> Flags:
        flags = np.zeros(self._asleep.size, bool)
        flags[region] = True
        return flags.reshape(self._cells)

    def _part(self, state: FluidState) -> Parting:
        """Part the particles into those awake, those asleep beside regions that are awake, and the others; what sleeps stops."""
        bordering = self._asleep & with_surroundings(~self._asleep, self._periodic)
        rank = (2 * self._asleep - bordering).astype(np.uint32).ravel()
        self._parted = self._asleep
        order, start = np.empty(state.count, np.uint32), np.empty(4, np.uint32)
        count_sort(rank[self.regions(state.position)], start, order)
        awake, listed = int(start[1]), int(start[2])
        state.velocity[:, order[awake:]] = 0.0
        state.shift[:, order[awake:]] = 0.0
        return Parting(order, state.count - awake, listed - awake)

    def save(self) -> dict[str, Any]:
        """How long each region has been quiet, and which sleep, beside what walls."""
        return {
            "quiet": self._quiet.copy(), "asleep": self._asleep.copy(), "parted": self._parted.copy(), "layout": self._layout,
        }  # fmt: skip

    def restore(self, saved: dict[str, Any]) -> None:
        """Back to what `save` returned; ValueError for what other regions have been saved of."""
        for name, own in (("quiet", self._quiet), ("asleep", self._asleep), ("parted", self._parted)):
            if saved[name].shape != own.shape or saved[name].dtype != own.dtype:
                raise ValueError(f"saved state has {name} regions of shape {saved[name].shape}, allowed: {own.shape}")
        self._quiet, self._layout = saved["quiet"].copy(), saved["layout"]
        self._asleep, self._parted = saved["asleep"].copy(), saved["parted"].copy()

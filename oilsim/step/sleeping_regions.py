"""Regions of still water fall asleep: their particles keep place and pressure, and cost nothing.

The domain is cut into regions `sleep_margin` wide, two supports by default. A region is loud while the particles awake in it move at more
than the sleep speed (root mean square), while a moving body is in it, or right after liquid was added. It falls asleep once it and all
regions around it have been quiet for SETTLED units of time, and wakes when a region around it is loud. So at least one region of water that
is awake and still lies between sleeping and moving water, and its motion announces a wave before it arrives.

Sleeping particles lie behind the others in the state. Water beside them sees water at rest under the pressure that they had: density,
gradients and the pressure solve count them, and none of them moves. So a motion slower than the sleep speed may be stopped, and a wave that
makes no faster motion is absorbed where the sleeping water begins; nothing else changes. Forcings, and pipes while they run, keep all the
liquid awake.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.arrays import Flags, Index, Real
from oilsim.backend.jit import FAST
from oilsim.backend.thread_team import Team
from oilsim.boundaries.walls import Walls
from oilsim.core.config import FluidConfig
from oilsim.core.state import FluidState
from oilsim.neighborhood.cell_grid import count_sort

# [supports] of the region beyond awake water whose particles are listed; theory; those beside it then see all their neighbours
LISTED = 2.0
# [t_u] for which a region and those around it must be quiet before it sleeps; numerical; not on record
SETTLED = 10.0


@njit(**FAST)
def assign_regions(begin, end, position, lower, inverse_width, cells, region):
    """Fill `region` (N,) uint32 with the index of the region in which each of `position` (3, N) [m] lies.

    lower (3,) corner of the domain [m]; inverse_width (3,) of a region [1/m]; cells (3,) regions along each axis. Particles outside
    count as in a border region.
    """
    for i in range(begin, end):
        place = np.int64(0)
        for axis in range(3):
            along = np.int64(math.floor((position[axis, i] - lower[axis]) * inverse_width[axis]))
            place = place * cells[axis] + min(max(along, 0), cells[axis] - 1)
        region[i] = place


@njit(**FAST)
def sum_squares(region, velocity, number, square):
    """Add the particles of each region to `number` (regions,) and their v^2 to `square` (regions,) [m2/s2], in float64.

    region (n,) uint32 of the first n particles; velocity (3, N) [m/s].
    """
    for i in range(region.size):
        u, v, w = np.float64(velocity[0, i]), np.float64(velocity[1, i]), np.float64(velocity[2, i])
        number[region[i]] += 1
        square[region[i]] += u * u + v * v + w * w


def with_surroundings(marked: Flags, periodic: tuple[bool, bool, bool]) -> Flags:
    """Return the marked regions (nx, ny, nz) and all that share a face, an edge or a corner with one."""
    for axis, repeats in enumerate(periodic):
        lower, upper = np.roll(marked, 1, axis), np.roll(marked, -1, axis)
        if not repeats:
            np.moveaxis(lower, axis, 0)[0] = np.moveaxis(upper, axis, 0)[-1] = False
        marked = marked | lower | upper
    return marked


class Parting(NamedTuple):
    """An order (N,) uint32 of the particles: the last `asleep` sleep, and the first `bordering` of these lie beside awake ones."""

    order: Index
    asleep: int
    bordering: int


class SleepingRegions:
    """Knows which regions sleep, and how long each has been quiet."""

    def __init__(self, config: FluidConfig, team: Team) -> None:
        self._team, self._periodic = team, config.periodic
        extent = np.subtract(config.upper, config.lower)
        cells = np.maximum(1, extent // (config.sleep_margin * config.support_radius)).astype(np.int64)
        if config.dimension == 2:
            cells[1] = 1
        self._cells = (int(cells[0]), int(cells[1]), int(cells[2]))
        self._lower = tuple(np.float32(low) for low in config.lower)
        self._inverse_width = tuple(np.float32(share) for share in cells / extent)
        self._square, self._rings = config.sleep_speed**2, math.ceil(LISTED / config.sleep_margin)
        self._layout: object = None
        self._quiet = np.zeros(self._cells)
        self._asleep = self._parted = np.zeros(self._cells, bool)  # the second: as particles lie in the state

    def regions(self, position: Real, count: int | None = None) -> Index:
        """Return the region (n,) uint32 of each of the positions (3, N) [m], or of the first n = `count`."""
        region = np.empty(position.shape[1] if count is None else count, np.uint32)
        self._team.run(assign_regions, region.size, position, self._lower, self._inverse_width, self._cells, region)
        return region

    def wake(self, position: Real) -> None:
        """Wake the regions of the positions (3, N) [m] and those around them."""
        self._wake_around(self._flagged(self.regions(position)))

    def update(self, state: FluidState, walls: Walls, elapsed: float, driven: bool) -> Parting | None:
        """Let regions fall asleep or wake, stop sleeping particles, and return how to sort the state, None if it is sorted.

        elapsed: the time since the last update [t_u, see `relaxation_time`]; driven: something else than gravity moves the liquid.
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
        """Wake the `loud` regions (nx, ny, nz) and those around them."""
        self._quiet[loud] = 0.0
        self._asleep = self._asleep & ~with_surroundings(loud, self._periodic)

    def _flagged(self, region: Index) -> Flags:
        flags = np.zeros(self._asleep.size, bool)
        flags[region] = True
        return flags.reshape(self._cells)

    def _part(self, state: FluidState) -> Parting:
        """Divide the particles into awake ones, sleeping ones beside awake regions, and the others, and stop those that sleep."""
        near = ~self._asleep
        for _ in range(self._rings):
            near = with_surroundings(near, self._periodic)
        bordering = self._asleep & near
        rank = (2 * self._asleep - bordering).astype(np.uint32).ravel()
        self._parted = self._asleep
        order, start = np.empty(state.count, np.uint32), np.empty(4, np.uint32)
        count_sort(rank[self.regions(state.position)], start, order)
        awake, listed = int(start[1]), int(start[2])
        state.velocity[:, order[awake:]] = 0.0
        state.shift[:, order[awake:]] = 0.0
        return Parting(order, state.count - awake, listed - awake)

    def save(self) -> dict[str, Any]:
        """Return how long each region has been quiet, which regions sleep, and the layout of the walls."""
        return {
            "quiet": self._quiet.copy(), "asleep": self._asleep.copy(), "parted": self._parted.copy(), "layout": self._layout,
        }  # fmt: skip

    def restore(self, saved: dict[str, Any]) -> None:
        """Go back to what `save` returned; ValueError for what other regions have been saved of."""
        for name, own in (("quiet", self._quiet), ("asleep", self._asleep), ("parted", self._parted)):
            if saved[name].shape != own.shape or saved[name].dtype != own.dtype:
                raise ValueError(f"saved state has {name} regions of shape {saved[name].shape}, allowed: {own.shape}")
        self._quiet, self._layout = saved["quiet"].copy(), saved["layout"]
        self._asleep, self._parted = saved["asleep"].copy(), saved["parted"].copy()

"""A window: a fluid of particles that lives in the places at rest of a sea (`sea_motion`), around a middle that follows a target.

Its water begins at rest, and stays so where nothing disturbs it, whatever current and waves the sea has: it may sleep. The box has no
sides, since it repeats. Its floor is a slip wall at a place at rest, which moves with the water of that depth, so that the sea's own waves
do not feel it; what bodies add feels it as the bottom of a basin, from waves of twice its depth on. Bodies are brought from the sea into
the places at rest, and their loads back, by `LocalMotion` (`local_motion`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.boundaries.boundary_particles import tank_walls
from oilsim.config import FluidConfig
from oilsim.initial_conditions import block
from oilsim.phases import Phase
from oilsim.quantity import quantity, require
from oilsim.sea import Sea
from oilsim.solver import Fluid
from oilsim.window.rim import Rim
from oilsim.window.sea_motion import SeaMotion

Double = NDArray[np.float64]

# [1] share of the size that the rim takes on each side; numerical; half of the box is left in the middle
RIM_SHARE = 0.25
# [d] of air above the level at least; numerical; splashes that go higher leave the run and are counted
HEADROOM = 8.0
# [d] behind the floor that still belong to the domain; numerical; pressed particles may stand a little inside it
MARGIN = 1.0


@dataclass(frozen=True, kw_only=True)
class WindowSettings:
    """Size and resolution of a window.

    size       (2,) [m] along x and y, rounded to whole spacings
    depth      [m] of its water
    spacing    [m] between particles
    rim        [m] width of the zone along each side in which disturbances end; None: RIM_SHARE of the smaller size
    sleep_speed  [m/s] below which water sleeps; 0: it never does
    dimension  3, or 2 for a plane case in x and z
    Raises ValueError for values that are not allowed.
    """

    size: tuple[float, float]
    depth: float = quantity("m", above=0.0)
    spacing: float = quantity("m", above=0.0)
    rim: float | None = quantity("m", default=None, above=0.0)
    sleep_speed: float = quantity("m/s", default=0.0, at_least=0.0)
    dimension: int = quantity("", default=3, at_least=2, at_most=3, whole=True)

    def __post_init__(self) -> None:
        require("window", WindowSettings, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        if not (np.shape(self.size) == (2,) and all(math.isfinite(side) and side > 0.0 for side in self.size)):
            yield f"size is {self.size} m, allowed: two finite numbers above 0"
            return
        if self.depth < 4.0 * self.spacing:
            yield f"depth is {self.depth:g} m, allowed: 4 spacings of {self.spacing:g} m or more"
        if not 2.0 * self.width < min(self.sides):
            yield f"rim is {self.width:g} m on each side, allowed: less than half of the size, {0.5 * min(self.sides):g} m"

    @property
    def sides(self) -> tuple[float, ...]:
        """Size along the axes that there are [m]."""
        return self.size if self.dimension == 3 else self.size[:1]

    @property
    def whole_size(self) -> tuple[float, float]:
        """Size [m] in whole spacings."""
        x, y = (self.spacing * max(1, round(side / self.spacing)) for side in self.size)
        return x, y

    @property
    def width(self) -> float:
        """Width of the rim [m]."""
        return RIM_SHARE * min(self.sides) if self.rim is None else self.rim


class Window:
    """A fluid in the places at rest of a sea, and the rim around its middle. `fluid` takes bodies, oil and forcings as any other."""

    def __init__(
        self, settings: WindowSettings, sea: Sea, phases: tuple[Phase, ...], threads: int | None = None
    ) -> None:
        """Fill the window with the first phase, at rest."""
        self.settings, self.motion = settings, SeaMotion(sea)
        spacing, dimension = settings.spacing, settings.dimension
        level, gravity = sea.description.level, sea.description.gravity
        along = (0, 1) if dimension == 3 else (0,)
        half = [0.5 * side for side in settings.whole_size]
        layers = max(1, round(settings.depth / spacing))
        self.depth = min(layers * spacing, sea.description.depth)
        bottom = level - self.depth
        top = level + max(HEADROOM * spacing, self.depth)
        lower, upper = (-half[0], -half[1], bottom), (half[0], half[1], top)
        config = FluidConfig(
            particle_spacing=spacing,
            phases=phases,
            lower=(lower[0], lower[1], bottom - MARGIN * spacing),
            upper=upper,
            periodic=(True, dimension == 3, False),
            gravity=(0.0, 0.0, -gravity),
            dimension=dimension,
            sleep_speed=settings.sleep_speed,
        )
        self.fluid = Fluid(config, threads)
        walls = tank_walls(lower, upper, spacing, sides=("-z",), periodic=config.periodic, dimension=dimension)
        self.fluid.add_boundary(walls)
        self.rim = Rim(settings.whole_size, settings.width, gravity, along)
        self.fluid.add_forcing(self.rim, calms=True)
        water = block(lower, (half[0], half[1], level), spacing, dimension)
        self.fluid.add_particles(water, phase=phases[0].name)

    def follow(self, target: Double, time: float) -> None:
        """Put the middle where the water at `target` (2,) [m] in the world is at rest, at `time` [s]."""
        level = self.motion.sea.description.level
        place = np.array([[target[0], target[1], level]])
        self.rim.center = (place - self.motion.travel(time))[0, :2]

    def places(self, time: float) -> Double:
        """Return where all particles are in the sea now, (N, 3) [m], in the order of `fluid.particles`."""
        return self.motion.in_sea(self.rim.about_center(self.fluid.particles.position.T), time)

    def velocities(self, time: float) -> Double:
        """Return the velocities of all particles in the sea now, (N, 3) [m/s]: the sea's and their own."""
        particles = self.fluid.particles
        rest = self.rim.about_center(particles.position.T)
        return np.asarray(self.motion.velocity(rest, time) + particles.velocity.T)

    def save_state(self) -> dict[str, Any]:
        """Return what `restore_state` needs to continue bit for bit."""
        return self.fluid.save_state()

    def restore_state(self, saved: dict[str, Any]) -> None:
        """Go back to a state that `save_state` returned."""
        self.fluid.restore_state(saved)

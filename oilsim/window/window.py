"""A window: a fluid of particles that lives in the places at rest of a sea (`sea_motion`), around a middle that follows a target.

Its water begins at rest, and stays so where nothing disturbs it, whatever current and waves the sea has: it may sleep. The box has no
sides, since it repeats. Its floor is a slip wall at a place at rest, which moves with the water of that depth, so that the sea's own waves
do not feel it; what bodies add feels it as the bottom of a basin, from waves of twice its depth on. Bodies are brought from the sea into
the places at rest, and their loads back, by `LocalMotion` (`local_motion`).
"""

from __future__ import annotations

import numpy as np

from oilsim.backend.arrays import Array, Real
from oilsim.boundaries.boundary_particles import tank_walls
from oilsim.core.config import FluidConfig
from oilsim.core.initial_conditions import block
from oilsim.core.phases import Phase
from oilsim.fluid.fluid import Fluid
from oilsim.sea import Sea
from oilsim.window.rim import Rim
from oilsim.window.sea_motion import SeaMotion
from oilsim.window.settings import WindowSettings

# [d] of air above the level at least; numerical; splashes that go higher leave the run and are counted
HEADROOM = 8.0
# [d] behind the floor that still belong to the domain; numerical; pressed particles may stand a little inside it
MARGIN = 1.0
# [supports] of still water that stay awake around what moves; measured; half of the usual: motion that ends there would end in the rim
SLEEP_MARGIN = 1.0


class Window:
    """A fluid in the places at rest of a sea, and the rim around its middle. `fluid` takes bodies, oil and forcings as any other."""

    def __init__(
        self, settings: WindowSettings, sea: Sea, phases: tuple[Phase, ...], threads: int | None = None
    ) -> None:
        """Fill the window with the first phase, at rest."""
        self.settings = settings
        spacing, dimension = settings.spacing, settings.dimension
        level, gravity = sea.description.level, sea.description.gravity
        along = (0, 1) if dimension == 3 else (0,)
        half = [0.5 * side for side in settings.whole_size]
        self.depth = min(settings.layers * spacing, sea.description.depth)
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
            sleep_margin=SLEEP_MARGIN,
            well_balanced=True,
            **(dict(settings.solver) | {"maximum_time_step": settings.longest_time_step(gravity)}),
        )
        self.fluid = Fluid(config, threads)
        self.motion = SeaMotion(sea, self.fluid.context.team)
        walls = tank_walls(lower, upper, spacing, sides=("-z",), periodic=config.periodic, dimension=dimension)
        self.fluid.add_boundary(walls)
        self.rim = Rim(settings.whole_size, settings.width, gravity, along)
        self.fluid.add_forcing(self.rim, calms=True)
        water = block(lower, (half[0], half[1], level), spacing, dimension)
        self.fluid.add_particles(water, phase=phases[0].name)

    def follow(self, target: Array, time: float) -> None:
        """Put the middle where the water at `target` (2,) [m] in the world is at rest, at `time` [s]."""
        level = self.motion.sea.description.level
        place = np.array([[target[0], target[1], level]])
        self.rim.center = (place - self.motion.travel(time))[0, :2]

    def middle(self, time: float) -> Array:
        """Return where the water of the middle is at `time` [s], (2,) [m], waves aside."""
        return np.asarray(self.rim.center + self.motion.travel(time)[:2])

    def places(self, time: float) -> Array:
        """Return where all particles are in the sea now, (N, 3) [m], in the order of `fluid.particles`."""
        return self.motion.in_sea(self.rim.about_center(self.fluid.particles.position.T), time)

    def phase_places(self, phase: str, time: float) -> Real:
        """Return where the particles of a phase are in the sea now, (N, 3) [m], in the order of `fluid.phase_ids`."""
        rest = self.rim.about_center(self.fluid.phase_positions(phase))
        return self.motion.in_sea(rest, time).astype(np.float32)

    def velocities(self, time: float) -> Array:
        """Return the velocities of all particles in the sea now, (N, 3) [m/s]: the sea's and their own."""
        particles = self.fluid.particles
        rest = self.rim.about_center(particles.position.T)
        return np.asarray(self.motion.velocity(rest, time) + particles.velocity.T)

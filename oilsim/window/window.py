"""A window: a fluid of particles that lives in the places at rest of a sea (`sea_motion`), around a middle that follows a target.

Its water begins at rest, and stays so where nothing disturbs it, whatever current and waves the sea has: it may sleep. The box has no
sides, since it repeats. Its floor is a slip wall at a place at rest, which moves with the water of that depth, so that the sea's own waves
do not feel it; what bodies add feels it as the bottom of a basin, from waves of twice its depth on. Bodies are brought from the sea into
the places at rest, and their loads back, by `LocalMotion`.

A body small against the waves moves with a frame of its own: the mean displacement D and velocity U of the undisturbed sea over the body,
and the turn R from the vertical to the normal of the mean surface. Seen from it, the body has

    place q = x - X - D,    orientation R^-1,    twist R^-1 (V - U),    free acceleration R^-1 (A - dU/dt) + M^-1 f,

and the load F that the particles find acts on it in the sea as R (F + f). R makes the weight of displaced water, rho V g upwards at rest,
point along the normal of the moving surface: this is the horizontal part of the wave's force on displaced water (Froude and Krylov). The
vertical part is

    f = (a / g) F,    a the vertical acceleration of the sea, of the vertical force and of the torques about horizontal axes,

with F of the step before. A body that floats and follows the surface is thereby one at rest in still water. *Modelled*: the strain of the
water over a body's depth is left out, R turning all of it with the surface, and so are products of slopes.

Means are taken at four points, a standard deviation of its shape from a body's middle along its horizontal axes either way: two points of
Gauss along each. So waves much shorter than a body do not move it.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

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


class Around(Protocol):
    """The motion of the water around a window beyond the sea's, as `oilsim.window.water_motion` takes it from an outer window."""

    def measure(self, time: float) -> None:
        """Take the motion at `time` [s]."""

    def at_rest(self, places: Array) -> Array:
        """Return the velocity (N, 3) [m/s] at places at rest (N, 3) [m], as last measured."""


class Window:
    """A fluid in the places at rest of a sea, and the rim around its middle. `fluid` takes bodies, oil and forcings as any other.

    around: the motion of the water of an outer window, in which this one lies; None without one.
    """

    def __init__(
        self,
        settings: WindowSettings,
        sea: Sea,
        phases: tuple[Phase, ...],
        threads: int | None = None,
        around: Around | None = None,
    ) -> None:
        """Fill the window with the first phase, at rest."""
        self.settings = settings
        self.around = around
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
        self.rim = Rim(settings.whole_size, settings.width, gravity, along, None if around is None else around.at_rest)
        self.fluid.add_forcing(self.rim, calms=around is None)
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


# [m] least way from a body's middle to the points; numerical; slopes are differences over twice of it
LEAST = 1e-2


class LocalMotion(NamedTuple):
    """The sea over n bodies: rest (n, 3) [m], twist (n, 6) [m/s, rad/s], turn R (n, 3, 3), and the points at rest (n, 4, 3) [m]."""

    rest: Array
    twist: Array
    turn: Array
    points: Array


def gauss_points(shape: Array) -> Array:
    """Return the four points (4, 3) [m], in the body's axes, over which means are taken; shape (M, 3) [m] of its surface, upright."""
    flat = shape[:, :2] - shape[:, :2].mean(0)
    squares, axes = np.linalg.eigh(flat.T @ flat / len(flat))
    ways = np.maximum(np.sqrt(np.maximum(squares, 0.0)), LEAST)
    points = np.zeros((4, 3))
    for axis in (0, 1):
        points[2 * axis, :2] = ways[axis] * axes[:, axis]
        points[2 * axis + 1] = -points[2 * axis]
    return points


def local_motion(motion: SeaMotion, position: Array, offsets: Array, time: float) -> LocalMotion:
    """Evaluate the sea over bodies at `position` (n, 3) [m] whose points lie at `offsets` (n, 4, 3) [m] from there, in the world."""
    count = len(position)
    there = (position[:, None] + offsets).reshape(-1, 3)
    points = motion.at_rest(there, time)
    moved = (there - motion.travel(time) - points).reshape(count, 4, 3)
    velocity = motion.velocity(points, time).reshape(count, 4, 3)
    slope, rate = _slope(moved[:, :, 2], offsets), _slope(velocity[:, :, 2], offsets)
    twist = np.concatenate([velocity.mean(1), np.stack([rate[:, 1], -rate[:, 0], np.zeros(count)], -1)], axis=1)
    rest = position - motion.travel(time) - moved.mean(1)
    return LocalMotion(rest, twist, _turn(slope), points.reshape(count, 4, 3))


def _slope(height: Array, offsets: Array) -> Array:
    """Return the slopes (n, 2) of heights (n, 4) at points (n, 4, 3), by differences along two axes at right angles."""
    slope = np.zeros((len(height), 2))
    for plus, minus in ((0, 1), (2, 3)):
        way = offsets[:, plus, :2] - offsets[:, minus, :2]
        square = np.maximum((way**2).sum(1), LEAST**2)  # of a body on its side an axis may be upright
        slope += ((height[:, plus] - height[:, minus]) / square)[:, None] * way
    return slope


def _turn(slope: Array) -> Array:
    """Return the rotations (n, 3, 3) that take the vertical to the normals of surfaces with these slopes (n, 2), without a twist."""
    normal = np.concatenate([-slope, np.ones((len(slope), 1))], axis=1)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    x, y, z = normal.T
    share = 1.0 / (1.0 + z)
    turn = np.empty((len(slope), 3, 3))
    turn[:, 0] = np.stack([1.0 - share * x * x, -share * x * y, x], -1)
    turn[:, 1] = np.stack([-share * x * y, 1.0 - share * y * y, y], -1)
    turn[:, 2] = np.stack([-x, -y, z], -1)
    return turn

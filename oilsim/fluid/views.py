"""Readings of a fluid from outside: particles, boundaries, sums and probes.

No reader changes the fluid. Arrays of `Particles` and of a boundary are the solver's own and cannot be written through; all others are
copies. Probes take the kernel mean of nearby particles (Shepard), f(x) = sum_j V f_j W(x - x_j) / sum_j V W(x - x_j), pressure with its
mean gradient carried along below.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim.accounts import diagnostics
from oilsim.backend.arrays import Array, Index, Ints, Real
from oilsim.boundaries.boundary_particles import BoundaryParticles
from oilsim.boundaries.walls import MovingBody
from oilsim.core.config import FluidConfig
from oilsim.core.state import FluidState
from oilsim.fluid import checks
from oilsim.fluid.emitter import PipeEmitter
from oilsim.neighborhood.smoothing_kernels import kernel
from oilsim.pressure.rest_pressure import whole_impulse
from oilsim.step.arrays import StepArrays
from oilsim.step.context import StepContext


class Particles(NamedTuple):
    """The liquid at one instant, N particles in the solver's order; the next advance may put them in another one.

    position (3, N) [m], velocity (3, N) [m/s], pressure_impulse (N,) p dt / rho_ref [m2/s] of the last step, phase (N,) index into the
    phases of the configuration, id (N,) never reused. The last `asleep` of them do not move.
    """

    position: Real
    velocity: Real
    pressure_impulse: Real
    phase: NDArray[np.uint8]
    id: Index
    asleep: int


class BoundaryMotion(NamedTuple):
    """A moving boundary now: position (3,) [m] of its centre of mass, orientation (4,) xyzw, twist (6,) [m/s, rad/s], world frame."""

    position: Array
    orientation: Array
    twist: Array


class FluidView:
    """The readings of a fluid, at any time between advances."""

    config: FluidConfig
    state: FluidState
    context: StepContext
    arrays: StepArrays
    time: float  # [s]
    emitters: list[PipeEmitter]
    _duration: float  # [s] of the last advance
    _stirred: bool  # by a forcing

    @property
    def _is_void(self) -> bool:
        """True if there is no liquid, and never will be."""
        return len(self.state.id) == 0 and not self.emitters

    @property
    def _driven(self) -> bool:
        """True if anything but gravity moves the liquid now."""
        return self._stirred or any(emitter.is_running(self.time) for emitter in self.emitters)

    def _largest_speed(self) -> float:
        """Return the speed [m/s] of the fastest particle or body."""
        bodies = self.context.walls.largest_speed(self.config.lower, self.config.upper, self.config.longest_time_step)
        return max(diagnostics.largest_speed(self.state), bodies)

    # particles

    @property
    def particle_count(self) -> int:
        """Number of fluid particles."""
        return self.state.count

    @property
    def particles(self) -> Particles:
        """All fluid particles, as arrays that cannot be written to."""
        state = self.state
        return Particles(
            position=_read_only(state.position),
            velocity=_read_only(state.velocity),
            pressure_impulse=_read_only(whole_impulse(state, self.config.gravity)),
            phase=_read_only(state.phase),
            id=_read_only(state.id),
            asleep=state.asleep,
        )

    def phase_positions(self, phase: str) -> Real:
        """Return a copy of a phase's positions (n, 3) [m], ordered by particle id; ValueError for a phase that does not exist."""
        return np.ascontiguousarray(self.state.position[:, self._ordered(phase)].T)

    def phase_velocities(self, phase: str) -> Real:
        """Return a copy of a phase's velocities (n, 3) [m/s], ordered by particle id; ValueError for a phase that does not exist."""
        return np.ascontiguousarray(self.state.velocity[:, self._ordered(phase)].T)

    def phase_ids(self, phase: str) -> Index:
        """Return the particle ids of a phase (n,), ascending; ValueError for a phase that does not exist."""
        return self.state.id[self._ordered(phase)]

    def _ordered(self, phase: str) -> Ints:
        members = np.flatnonzero(self.state.phase == self.config.phase_index(phase))
        return members[np.argsort(self.state.id[members], kind="stable")]

    # boundaries

    @property
    def boundary_count(self) -> int:
        """Number of wall particles."""
        return self.context.walls.count

    @property
    def boundaries(self) -> MappingProxyType[int, BoundaryParticles]:
        """Every solid surface by its handle, as it was given to `add_boundary`; not to be written to."""
        return MappingProxyType(self.context.walls.boundaries)

    @property
    def moving_boundaries(self) -> tuple[int, ...]:
        """Handles of the boundaries that `set_boundary_motion` moves, in the order in which they began to."""
        return tuple(self.context.walls.moving)

    def boundary_positions(self, handle: int) -> Real:
        """Return the world positions (M, 3) [m] of a boundary's particles; ValueError for a handle that does not exist."""
        return self.context.walls.positions(handle)

    def boundary_motion(self, handle: int) -> BoundaryMotion:
        """Return the present pose and twist of a moving boundary; ValueError for one that does not move."""
        body = self._moving(handle)
        return BoundaryMotion(body.position.copy(), body.orientation.copy(), body.twist.copy())

    def boundary_wrench(self, handle: int) -> Array:
        """Return the liquid's force [N] and torque about the centre of mass [N m] on a body (6,), world frame, mean of the last advance.

        ValueError for a boundary that does not move.
        """
        return self._moving(handle).impulse / self._duration if self._duration else np.zeros(6)

    def boundary_twist(self, handle: int) -> Array:
        """Return the linear and angular velocity (6,) [m/s, rad/s] of a body after its responses inside the last advance.

        ValueError for a boundary that does not move.
        """
        return self._moving(handle).twist.copy()

    def _moving(self, handle: int) -> MovingBody:
        body = self.context.walls.moving.get(handle)
        if body is None:
            raise ValueError(f"boundary {handle} does not move, allowed: a boundary given to set_boundary_motion")
        return body

    # sums and probes

    def energy(self) -> diagnostics.Energy:
        """Return the kinetic and potential energy of the liquid [J]."""
        return diagnostics.energy(self.state, self.config)

    def momentum(self) -> Array:
        """Return the linear momentum of the liquid (3,) [kg m/s]."""
        return diagnostics.momentum(self.state, self.config)

    def angular_momentum(self) -> Array:
        """Return the angular momentum of the liquid about the origin (3,) [kg m2/s]."""
        return diagnostics.angular_momentum(self.state, self.config)

    def pressure_at(self, points: ArrayLike) -> Array:
        """Return the pressure (K,) [Pa] at points (K, 3) [m], 0 without liquid.

        ValueError for points not of this shape or not finite.
        """
        return pressure_at(self.state, self.context, checks.finite("points", points, None, 3))

    def velocity_at(self, points: ArrayLike) -> Array:
        """Return the velocity (K, 3) [m/s] at points (K, 3) [m], 0 without liquid.

        ValueError for points not of this shape or not finite.
        """
        return velocity_at(self.state, self.context, checks.finite("points", points, None, 3))

    def surface_height_at(self, points: ArrayLike) -> Array:
        """Return the height z (K,) [m] of the free surface above points (K, 2) x, y [m]; the domain's bottom where there is no liquid.

        ValueError for points not of this shape or not finite.
        """
        return surface_height_at(self.state, self.context, checks.finite("points", points, None, 2))


def _read_only(values: NDArray) -> NDArray:
    """Return a view of the same numbers that refuses to be written to."""
    view = values.view()
    view.flags.writeable = False
    return view


# [1] share of the kernel that liquid must fill for a reading; tuned; not on record
PRESENT = 0.05
# [1] share of a full layer of particles across the support that belongs to the surface at least; tuned; fewer are spray
FEWEST = 0.15


def _offsets(state: FluidState, context: StepContext, point: Array) -> Array:
    """Return the ways (axes, N) [m] from a point, along as many axes as it has, to the nearest image of every particle."""
    offset = state.position[: point.size].astype(np.float64) - point[:, None]
    for axis, length in enumerate((context.constants.period or ())[: point.size]):
        if length > 0.0:
            offset[axis] -= length * np.round(offset[axis] / length)
    return offset


def _weights(state: FluidState, context: StepContext, point: Array) -> tuple[Ints, Array, Array]:
    """Return the particles within the support of a point, the ways to them (3, n) [m], and their shares V W [1]."""
    offset = _offsets(state, context, point)
    distance = np.sqrt((offset**2).sum(axis=0))
    near = np.flatnonzero(distance < context.constants.support)
    shares = kernel(distance[near] / float(context.constants.support), float(context.constants.sigma))
    return near, offset[:, near], float(context.constants.volume) * shares


def pressure_at(state: FluidState, context: StepContext, points: Array) -> Array:
    """Return the pressure (K,) [Pa] at points (K, 3) [m]: a first-order fit p_0 + b . (x_j - x) weighted by the kernel, 0 in air."""
    result = np.zeros(len(points))
    per_impulse = context.constants.reference_density / state.time_step if state.time_step > 0.0 else 0.0
    impulse = whole_impulse(state, context.config.gravity)
    for n, point in enumerate(points):
        near, offset, share = _weights(state, context, point)
        if share.sum() < PRESENT:
            continue
        values = per_impulse * impulse[near].astype(np.float64)
        basis = np.vstack([np.ones(len(near)), offset / float(context.constants.support)])
        normal = (basis * share) @ basis.T + 1e-6 * share.sum() * np.diag([0.0, 1.0, 1.0, 1.0])
        result[n] = np.linalg.solve(normal, (basis * share) @ values)[0]
    return result


def velocity_at(state: FluidState, context: StepContext, points: Array) -> Array:
    """Return the velocity (K, 3) [m/s] at points (K, 3) [m], the kernel mean of the particles near; 0 in air."""
    result = np.zeros((len(points), 3))
    for n, point in enumerate(points):
        near, _, share = _weights(state, context, point)
        if share.sum() >= PRESENT:
            result[n] = state.velocity[:, near].astype(np.float64) @ share / share.sum()
    return result


def surface_height_at(state: FluidState, context: StepContext, points: Array) -> Array:
    """Measure the height (K,) [m] of the free surface over points (K, 2) [m], by the particles within a support radius across.

    It lies half a spacing above the mean of the highest ones, those within three quarters of a spacing of the highest that hangs
    together with the liquid below, like a gauge wire. Spray does not count: neither drops in the air nor single particles on the surface
    (`FEWEST` of a layer). Where there is no liquid, the reading is the domain's lower side.
    """
    config = context.config
    spacing, radius = config.particle_spacing, config.support_radius
    layer = (
        2.0 * radius / spacing if context.constants.plane else np.pi * (radius / spacing) ** 2
    )  # particles of a full one
    fewest = max(2, int(np.ceil(FEWEST * layer)))
    result = np.full(len(points), config.lower[2])
    for n, point in enumerate(points):
        offset = _offsets(state, context, point[:1] if context.constants.plane else point)
        heights = np.sort(state.position[2, (offset**2).sum(axis=0) < radius**2].astype(np.float64))
        parts = np.split(heights, np.flatnonzero(np.diff(heights) > 1.5 * spacing) + 1)
        liquid = next((part for part in parts if len(part) >= fewest), None)
        if liquid is not None:
            result[n] = _top(liquid, 0.75 * spacing, fewest) + 0.5 * spacing
    return result


def _top(heights: Array, thickness: float, fewest: int) -> float:
    """Return the mean height [m] of the uppermost particles (n,), sorted, within `thickness` [m], without single ones above them."""
    while True:
        upper = heights > heights[-1] - thickness
        if upper.all() or int(upper.sum()) >= fewest:
            return float(heights[upper].mean())
        heights = heights[~upper]

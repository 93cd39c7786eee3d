"""Readings of a fluid from outside: particles, boundaries, sums and probes.

No reader changes the fluid. Arrays of `Particles` and of a boundary are the solver's own and cannot be written through; all others are
copies.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim import checks, probes
from oilsim.accounts import diagnostics
from oilsim.boundaries.boundary_particles import BoundaryParticles
from oilsim.boundaries.walls import MovingBody
from oilsim.config import FluidConfig
from oilsim.state import FluidState
from oilsim.step.step_arrays import StepArrays
from oilsim.step.step_tools import StepTools

Real = NDArray[np.float32]
Double = NDArray[np.float64]


class Particles(NamedTuple):
    """The liquid at one instant, N particles in the solver's order; the next advance may put them in another one.

    position (3, N) [m], velocity (3, N) [m/s], pressure_impulse (N,) p dt / rho_ref [m2/s] of the last step, phase (N,) index into the
    phases of the configuration, id (N,) never reused. The last `asleep` of them do not move.
    """

    position: Real
    velocity: Real
    pressure_impulse: Real
    phase: NDArray[np.uint8]
    id: NDArray[np.uint32]
    asleep: int


class BoundaryMotion(NamedTuple):
    """A moving boundary now: position (3,) [m] of its centre of mass, orientation (4,) xyzw, twist (6,) [m/s, rad/s], world frame."""

    position: Double
    orientation: Double
    twist: Double


class FluidView:
    """The readings of a fluid, at any time between advances."""

    config: FluidConfig
    state: FluidState
    tools: StepTools
    arrays: StepArrays
    _duration: float  # [s] of the last advance

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
            pressure_impulse=_read_only(state.pressure_impulse),
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

    def phase_ids(self, phase: str) -> NDArray[np.uint32]:
        """Return the particle ids of a phase (n,), ascending; ValueError for a phase that does not exist."""
        return self.state.id[self._ordered(phase)]

    def _ordered(self, phase: str) -> NDArray[np.int64]:
        members = np.flatnonzero(self.state.phase == self.config.phase_index(phase))
        return members[np.argsort(self.state.id[members], kind="stable")]

    # boundaries

    @property
    def boundary_count(self) -> int:
        """Number of wall particles."""
        return self.tools.walls.count

    @property
    def boundaries(self) -> MappingProxyType[int, BoundaryParticles]:
        """Every solid surface by its handle, as it was given to `add_boundary`; not to be written to."""
        return MappingProxyType(self.tools.walls.boundaries)

    @property
    def moving_boundaries(self) -> tuple[int, ...]:
        """Handles of the boundaries that `set_boundary_motion` moves, in the order in which they began to."""
        return tuple(self.tools.walls.moving)

    def boundary_positions(self, handle: int) -> Real:
        """Return the world positions (M, 3) [m] of a boundary's particles; ValueError for a handle that does not exist."""
        return self.tools.walls.positions(handle)

    def boundary_motion(self, handle: int) -> BoundaryMotion:
        """Return the present pose and twist of a moving boundary; ValueError for one that does not move."""
        body = self._moving(handle)
        return BoundaryMotion(body.position.copy(), body.orientation.copy(), body.twist.copy())

    def boundary_wrench(self, handle: int) -> Double:
        """Return the liquid's force [N] and torque about the centre of mass [N m] on a body (6,), world frame, mean of the last advance.

        ValueError for a boundary that does not move.
        """
        return self._moving(handle).impulse / self._duration if self._duration else np.zeros(6)

    def boundary_twist(self, handle: int) -> Double:
        """Return the linear and angular velocity (6,) [m/s, rad/s] of a body after its answers inside the last advance.

        ValueError for a boundary that does not move.
        """
        return self._moving(handle).twist.copy()

    def _moving(self, handle: int) -> MovingBody:
        body = self.tools.walls.moving.get(handle)
        if body is None:
            raise ValueError(f"boundary {handle} does not move, allowed: a boundary given to set_boundary_motion")
        return body

    # sums and probes

    def energy(self) -> diagnostics.Energy:
        """Return the kinetic and potential energy of the liquid [J]."""
        return diagnostics.energy(self.state, self.config)

    def momentum(self) -> Double:
        """Return the linear momentum of the liquid (3,) [kg m/s]."""
        return diagnostics.momentum(self.state, self.config)

    def angular_momentum(self) -> Double:
        """Return the angular momentum of the liquid about the origin (3,) [kg m2/s]."""
        return diagnostics.angular_momentum(self.state, self.config)

    def pressure_at(self, points: ArrayLike) -> Double:
        """Return the pressure (K,) [Pa] at points (K, 3) [m], 0 without liquid.

        ValueError for points not of this shape or not finite.
        """
        return probes.pressure_at(self.state, self.tools, checks.finite("points", points, None, 3))

    def velocity_at(self, points: ArrayLike) -> Double:
        """Return the velocity (K, 3) [m/s] at points (K, 3) [m], 0 without liquid.

        ValueError for points not of this shape or not finite.
        """
        return probes.velocity_at(self.state, self.tools, checks.finite("points", points, None, 3))

    def surface_height_at(self, points: ArrayLike) -> Double:
        """Return the height z (K,) [m] of the free surface above points (K, 2) x, y [m]; the domain's bottom where there is no liquid.

        ValueError for points not of this shape or not finite.
        """
        return probes.surface_height_at(self.state, self.tools, checks.finite("points", points, None, 2))


def _read_only(values: NDArray) -> NDArray:
    """Return a view of the same numbers that refuses to be written to."""
    view = values.view()
    view.flags.writeable = False
    return view

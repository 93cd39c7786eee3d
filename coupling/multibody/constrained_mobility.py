"""The answer of a world's bodies to impulses and known forces, at the present instant, with their joints and a sea that loads them.

Forces of a sea that needs no particles, answered by the bodies within the step.

An environment gives, at a body's present pose and twist, the wrench F_0 that acts on it, the added mass A that it carries along, and the
change D of its drag with the twist, all about the centre of mass in the world frame. Over a sub-step h the body moves by

    (M + A + h D) a = F_0 + F + m g - omega x I omega + J^T f,

with M its own mass matrix, F all other wrenches and f the forces of joints. A is implicit because a boom's segment carries twenty times
its own mass of water: an added mass that lags a step behind would throw it. D is implicit because the drag of a light body is stiff.
The engine, which knows M only, gets the wrench F_0 - (A + h D) a; this is the sea's wrench on the body. The terms of A that turn
with the body (A's own Coriolis terms) are left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from coupling.multibody.joint_constraints import Articulation, Joints, PointJoint
from coupling.multibody.rigid_state import RigidBodyState
from coupling.multibody.rotations import applied
from oilsim.backend.arrays import Array

if TYPE_CHECKING:
    from oilsim.loads.morison import BodyLoads


class Environment(Protocol):
    """A sea that loads bodies."""

    def loads(self, time: float, pose: Array, twist: Array) -> BodyLoads:
        """Return the loads on bodies, in the order in which they are met.

        time [s]; pose (B, 7) [m, 1]; twist (B, 6) [m/s, rad/s].
        """


class MetEnvironment:
    """An environment and the rows of the bodies that it loads, in its order; it keeps `state` up to date. Without rows it does nothing."""

    def __init__(self, environment: Environment | None, rows: list[int], state: RigidBodyState) -> None:
        self.environment, self.rows, self._state = environment, rows, state
        self._loads: BodyLoads | None = None
        self._sub_step = 0.0
        self._impulse = np.zeros((0, 6))

    @property
    def is_met(self) -> bool:
        """True if the loads at the present instant are known, as those on no body are."""
        return self._loads is not None or not self.rows

    def forget(self) -> None:
        """Forget the loads, because bodies moved: the environment is asked again when it is met next."""
        self._loads = None

    def begin(self) -> None:
        """Begin to sum the environment's impulses on the bodies."""
        self._impulse = np.zeros(self._state.twist.shape)

    def end(self, duration: float) -> None:
        """Note the mean wrench over `duration` [s] since `begin`."""
        self._state.sea_wrench = self._impulse / duration

    def meet(self, time: float, sub_step: float) -> bool:
        """Note the loads at `time` [s] and how the bodies resist over `sub_step` [s]; return whether either is new."""
        state, rows = self._state, self.rows
        if self.environment is None or not rows or (self._loads is not None and sub_step == self._sub_step):
            return False
        if self._loads is None:
            self._loads = self.environment.loads(time, state.pose[rows], state.twist[rows])
        self._sub_step = sub_step
        state.sea_load[rows] = self._loads.wrench
        state.resist(rows, self._loads.added_mass + sub_step * self._loads.damping)
        return True

    def resisted(self, wrench: Array, gravity: Array, sub_step: float) -> Array:
        """Return (A + h D) a (B, 6) [N, N m] of the accelerations a under `wrench` (B, 6), and add the environment's impulse to the sum."""
        state = self._state
        if state.resistance is None:
            return np.zeros(wrench.shape)
        resisted = applied(state.resistance, state.accelerations_under(wrench, gravity))
        self._impulse += sub_step * (state.sea_load - resisted)
        return resisted


CLOSING = 0.2  # of a joint's gap, in a step of the engine: as much as pybullet would


class ConstrainedMobility:
    """The answer of the bodies in `state`; it is kept until `forget` or `moved` says that something changed.

    sub_step [s]: the length of step for which a sea's damping counts where nothing else is said. joints: in the order of their forces.
    sea: the environment that loads bodies.
    """

    def __init__(self, state: RigidBodyState, gravity: Array, sub_step: float) -> None:
        self._state, self._gravity, self._sub_step = state, gravity, sub_step
        self.joints: list[PointJoint] = []
        self.sea = MetEnvironment(None, [], state)
        self._layout: Joints | None = None
        self._articulation: Articulation | None = None
        self._accelerations: Array | None = None

    @property
    def is_needed(self) -> bool:
        """True if there are joints, and bodies that they can move."""
        return bool(self.joints) and bool(self._state.is_free.any())

    def forget(self) -> None:
        """Forget everything, because bodies or joints were added or taken away."""
        self._layout = None
        self.moved()

    def moved(self) -> None:
        """Forget what depends on where the bodies are."""
        self._articulation = self._accelerations = None
        self.sea.forget()

    def placed(self) -> None:
        """Forget the joints' answer, because a body was put into another place; the sea loads the others as before."""
        self._articulation = self._accelerations = None

    def pushed(self) -> None:
        """Forget the accelerations, because other forces are known."""
        self._accelerations = None

    def meet_sea(self, time: float, sub_step: float | None = None) -> None:
        """Note the loads of the sea at `time` [s], for a sub-step [s]; without one, only if they are not known."""
        if sub_step is None and self.sea.is_met:
            return
        if self.sea.meet(time, sub_step or self._sub_step):
            self._articulation = self._accelerations = None

    def articulated(self, time: float) -> Articulation:
        """Return the joints at the present instant, `time` [s]."""
        if self._articulation is None:
            self.meet_sea(time)
        if self._layout is None:
            self._layout = Joints(self.joints, len(self._state.pose))
        if self._articulation is None:
            state = self._state
            self._articulation = Articulation(self._layout, state.pose, state.twist, state.inverse_masses())
        return self._articulation

    def accelerations(self, time: float, duration: float) -> Array:
        """Return accelerations (B, 6) [m/s2, rad/s2] by all known forces; joints answer them and close within `duration` [s]."""
        articulation = self.articulated(time)
        if self._accelerations is None:
            self._accelerations = articulation.acceleration(self._state.known_accelerations(self._gravity), duration)
        return self._accelerations

    def forces(self, time: float, wrench: Array, sub_step: float) -> tuple[Array, Array]:
        """Return forces (J, 3) [N] with which joints answer a `wrench` (B, 6) over a sub-step [s], and their own wrench (B, 6) [N, N m]."""
        if not self.is_needed:
            return np.zeros((len(self.joints), 3)), np.zeros(wrench.shape)
        free = self._state.accelerations_under(wrench, self._gravity)
        return self.articulated(time).forces(free, sub_step, CLOSING)

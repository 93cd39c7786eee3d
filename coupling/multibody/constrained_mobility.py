"""The answer of a world's bodies to impulses and known forces, at the present instant, with their joints and a sea that loads them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from coupling.multibody.joint_constraints import Articulation, Joints, PointJoint
from coupling.multibody.rigid_state import RigidBodyState

if TYPE_CHECKING:
    from coupling.multibody.environment import MetEnvironment

Array = npt.NDArray[np.float64]

CLOSING = 0.2  # of a joint's gap, in a step of the engine: as much as pybullet would


class ConstrainedMobility:
    """The answer of the bodies in `state`; it is kept until `forget` or `moved` says that something changed.

    sub_step [s]: the length of step for which a sea's damping counts where nothing else is said. joints: in the order of their forces.
    sea: the environment that loads bodies, None without one.
    """

    def __init__(self, state: RigidBodyState, gravity: Array, sub_step: float) -> None:
        self._state, self._gravity, self._sub_step = state, gravity, sub_step
        self.joints: list[PointJoint] = []
        self.sea: MetEnvironment | None = None
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
        if self.sea is not None:
            self.sea.forget()

    def placed(self) -> None:
        """Forget the joints' answer, because a body was put into another place; the sea loads the others as before."""
        self._articulation = self._accelerations = None

    def pushed(self) -> None:
        """Forget the accelerations, because other forces are known."""
        self._accelerations = None

    def meet_sea(self, time: float, sub_step: float | None = None) -> None:
        """Note the loads of the sea at `time` [s], for a sub-step [s]; without one, only if they are not known."""
        if self.sea is None or (sub_step is None and self.sea.is_met):
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

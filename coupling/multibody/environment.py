"""Forces of a sea that needs no particles, answered by the bodies within the step.

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
import numpy.typing as npt

from coupling.multibody.rigid_state import RigidBodyState
from coupling.multibody.rotations import applied

if TYPE_CHECKING:
    from oilsim.loads.morison import BodyLoads

Array = npt.NDArray[np.float64]


class Environment(Protocol):
    """A sea that loads bodies."""

    def loads(self, time: float, pose: Array, twist: Array) -> BodyLoads:
        """Return the loads on bodies, in the order in which they are met.

        time [s]; pose (B, 7) [m, 1]; twist (B, 6) [m/s, rad/s].
        """


class MetEnvironment:
    """An environment and the rows of the bodies that it loads, in its order; it keeps `state` up to date."""

    def __init__(self, environment: Environment, rows: list[int], state: RigidBodyState) -> None:
        self.environment, self.rows, self._state = environment, rows, state
        self._loads: BodyLoads | None = None
        self._sub_step = 0.0
        self._impulse = np.zeros((0, 6))

    @property
    def is_met(self) -> bool:
        """True if the loads at the present instant are known."""
        return self._loads is not None

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
        if self._loads is not None and sub_step == self._sub_step:
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

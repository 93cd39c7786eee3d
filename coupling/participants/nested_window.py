"""A window inside an outer one, whose coarser particles are the water around it.

Both have all bodies. With s the share of the window and S that which the outer one would have alone, the load on a body is

    s times that of the window + (1 - s) S times that of the outer window + (1 - s) (1 - S) times that of the formulas.

The outer window steps first, with the last load that the window found, and the window then comes in its rim to the motion that the
outer water has at the end of the step. What one window finds acts in the solve of the other as a free acceleration, M^-1 times the load.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from coupling.master.participant import Status, StepResult
from coupling.participants.window import Target, WindowBody, WindowParticipant
from oilsim.backend.arrays import Array
from oilsim.window.window import Window


class NestedWindowParticipant(WindowParticipant):
    """Steps a window together with the participant of its outer one, which nothing else is connected with."""

    STATE = (*WindowParticipant.STATE, "outer", "_found")

    def __init__(
        self, name: str, window: Window, bodies: Mapping[str, WindowBody], target: Target, outer: WindowParticipant
    ) -> None:
        super().__init__(name, window, bodies, target)
        self.outer = outer
        self._found = np.zeros((len(bodies), 6))  # loads on the bodies in the last step, by this window alone
        self.all_shares = (self.shares, outer.shares)

    def enter_initialization_mode(self, start_time: float) -> None:
        """Start the clocks of both fluids."""
        super().enter_initialization_mode(start_time)
        self.outer.enter_initialization_mode(start_time)

    def set(self, name: str, value: Array) -> None:
        """Set a body's motion for both windows."""
        super().set(name, value)
        self.outer.set(name, value)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Advance the outer window, then this one, to `time + step_size` [s]."""
        free = self._all("free_acceleration", 6)
        self.outer.free(free + self._answer(self._found))
        result = self.outer.do_step(time, step_size)
        if result.status is not Status.OK:
            return result
        around = np.array([self.outer.get(f"{name}.wrench") for name in self._bodies]).reshape(-1, 6)
        assert self.window.around is not None
        self.window.around.measure(time + step_size)
        self.free(free + self._answer(around))
        result = super().do_step(time, step_size)
        self.free(free)
        self._add(around)
        rest = 1.0 - self.shares.later
        self.outer.shares.announce(rest * self.outer.shares.later, time + step_size)
        return result

    def _answer(self, load: Array) -> Array:
        """Return the accelerations (B, 6) with which all bodies answer loads (B, 6) [N, N m]."""
        if not load.any():
            return np.zeros(load.shape)
        assert self._joint_inverse_mass is not None  # it is connected wherever there are bodies
        return np.asarray((self._joint_inverse_mass @ load.ravel()).reshape(load.shape))

    def _add(self, around: Array) -> None:
        """Add the loads of the outer window (B, 6) [N, N m]; what each window expects of a body counts by its share."""
        own, beyond = self.shares.values, self.outer.shares.values
        for n, name in enumerate(self._bodies):
            self._found[n] = self._outputs[f"{name}.wrench"]
            self._outputs[f"{name}.wrench"] = self._found[n] + around[n]
            if beyond[n] > 0.0:
                expected = [one.expected_twist(name) for one in (self, self.outer)]
                self._outputs[f"{name}.predicted_twist"] = np.average(expected, 0, (own[n], beyond[n]))

    def restore_state(self, state: Any) -> None:
        """Go back to a state that `save_state` returned; TypeError for anything else."""
        super().restore_state(state)
        assert self.window.around is not None
        self.window.around.measure(self.outer.window.fluid.time)

    def terminate(self) -> None:
        """End the threads of both fluids."""
        super().terminate()
        self.outer.terminate()

"""A vessel without a helmsman: thrust and steering come from outside, as far as the machinery goes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

import numpy as np
from numpy.typing import NDArray

from coupling.participant import Status, StepResult, Variable, checked_value, variable_table
from vessels.control import control_variables
from vessels.vessel import Vessel, planar_motion, planar_wrench

Array = NDArray[np.float64]

MACHINERY_ORDERS = {"thrust_order": "N", "side_thrust_order": "N", "yaw_moment_order": "N m"}


class ManualControl:
    """Pushes `vessel` as ordered; keeps the contract of `coupling.participant.Participant`.

    Inputs: <vessel>.pose, <vessel>.twist; <vessel>.wind (3,) [m/s]; and the orders <vessel>.thrust_order and
    <vessel>.side_thrust_order [N], ahead and to port, and <vessel>.yaw_moment_order [N m], counter-clockwise, 0 until they
    are set. Outputs: <vessel>.applied_wrench, and what the machinery gives of the orders, the nearest it can:
    <vessel>.thrust, <vessel>.side_thrust [N], <vessel>.yaw_moment [N m]; <vessel>.speed [m/s], <vessel>.heading [rad].
    """

    def __init__(self, vessel: Vessel) -> None:
        self.name = f"{vessel.name}-control"
        self.vessel = vessel
        self._variables = variable_table(control_variables(vessel.name, MACHINERY_ORDERS))
        self._values = {name: np.zeros(variable.shape) for name, variable in self._variables.items()}
        self._values[f"{vessel.name}.pose"][6] = 1.0

    @property
    def variables(self) -> Mapping[str, Variable]:
        """Every variable by its name."""
        return self._variables

    def enter_initialization_mode(self, start_time: float) -> None:
        """Nothing is to be prepared."""

    def exit_initialization_mode(self) -> None:
        """Nothing is left to do."""

    def get(self, name: str) -> Array:
        """Value of the variable `name`."""
        return self._values[name].copy()

    def set(self, name: str, value: Array) -> None:
        """Give an input its value; an order holds until it is set again."""
        self._values[name] = checked_value(self.name, self._variables, name, value)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Choose the wrench that acts from `time` to `time + step_size` [s]."""
        propulsion, vessel = self.vessel.propulsion, self.vessel.name
        pose, twist, wind = (self._values[f"{vessel}.{what}"] for what in ("pose", "twist", "wind"))
        _, heading, surge, _, _ = planar_motion(pose, twist)
        thrust = min(max(self._order("thrust"), -propulsion.astern_pull), propulsion.bollard_pull)
        side = min(max(self._order("side_thrust"), -propulsion.side_thrust), propulsion.side_thrust)
        moment = min(max(self._order("yaw_moment"), -propulsion.yaw_moment), propulsion.yaw_moment)
        outputs = {"thrust": thrust, "side_thrust": side, "yaw_moment": moment, "speed": surge, "heading": heading}
        for name, value in outputs.items():
            self._values[f"{vessel}.{name}"] = np.array(value)
        wrench = planar_wrench(heading, thrust, side, moment)
        self._values[f"{vessel}.applied_wrench"] = wrench + self.vessel.wind_wrench(pose, twist, wind)
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        """Copies of every variable."""
        return {name: value.copy() for name, value in self._values.items()}

    def restore_state(self, state: object) -> None:
        """Go back to what `save_state` returned."""
        self._values = {name: value.copy() for name, value in cast(dict[str, Array], state).items()}

    def terminate(self) -> None:
        """Nothing is held."""

    def _order(self, what: str) -> float:
        return float(self._values[f"{self.vessel.name}.{what}_order"])

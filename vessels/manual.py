"""Manual control of a vessel: thrust and steering are ordered from outside, within the machinery's limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from coupling.master.participant import Participant, Status, StepResult
from oilsim.core.quantity import Quantity
from vessels.control import control_variables, no_current
from vessels.vessel import Vessel, moved_by, planar_motion

Array = NDArray[np.float64]

MACHINERY_ORDERS = {
    "thrust_order": Quantity(unit="N"),
    "side_thrust_order": Quantity(unit="N"),
    "yaw_moment_order": Quantity(unit="N m"),
}


class ManualControl(Participant):
    """Manual control of `vessel`: it pushes as ordered.

    Inputs: <vessel>.pose (7,) [m, 1], <vessel>.twist (6,) [m/s, rad/s], <vessel>.wind (3,) [m/s], and the orders <vessel>.thrust_order
    (ahead) and <vessel>.side_thrust_order (to port) [N] and <vessel>.yaw_moment_order [N m] (counter-clockwise), each 0 until it is set.
    Outputs: <vessel>.applied_wrench (6,) [N, N m], and the part of the orders that the machinery can give: <vessel>.thrust,
    <vessel>.side_thrust [N], <vessel>.yaw_moment [N m]; <vessel>.speed [m/s], <vessel>.heading [rad],
    <vessel>.rudder [rad]. `current` gives the water's velocity (2,) [m/s] at a time [s].
    """

    def __init__(self, vessel: Vessel) -> None:
        super().__init__(f"{vessel.name}-control", control_variables(vessel.name, MACHINERY_ORDERS))
        self.vessel = vessel
        self._values[f"{vessel.name}.pose"][6] = 1.0
        self.current: Callable[[float], Array] = no_current

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Choose the wrench that acts from `time` to `time + step_size` [s]."""
        propulsion, vessel = self.vessel.propulsion, self.vessel.name
        pose, twist, wind = (self._values[f"{vessel}.{what}"] for what in ("pose", "twist", "wind"))
        _, heading, surge, _, _ = planar_motion(pose, twist)
        thrust = min(max(self._order("thrust"), -propulsion.astern_pull), propulsion.bollard_pull)
        side = min(max(self._order("side_thrust"), -propulsion.side_thrust), propulsion.side_thrust)
        moment = min(max(self._order("yaw_moment"), -propulsion.yaw_moment), propulsion.yaw_moment)
        if not self.vessel.engine_runs:
            thrust, side, moment = 0.0, 0.0, 0.0
        motion, rudder = (pose, twist, self.current(time)), float(self._values[f"{vessel}.rudder"])
        wrench, given, angle = moved_by(self.vessel, motion, (thrust, side, moment), rudder, step_size)
        outputs = dict(zip(("thrust", "side_thrust", "yaw_moment"), given, strict=True))
        outputs |= {"speed": surge, "heading": heading, "rudder": angle}
        for name, value in outputs.items():
            self._values[f"{vessel}.{name}"] = np.array(value)
        self._values[f"{vessel}.applied_wrench"] = wrench + self.vessel.wind_wrench(pose, twist, wind)
        return StepResult(Status.OK, time + step_size)

    def _order(self, what: str) -> float:
        return float(self._values[f"{self.vessel.name}.{what}_order"])

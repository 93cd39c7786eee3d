"""An autopilot for heading and speed: it turns instrument readings into thrust and steering moment.

With m the vessel's mass and I its yaw inertia, added mass included, w the bandwidth of each loop, and e = order - actual:

    thrust = m (2 w_u e_u + w_u^2 int e_u dt)
    moment = I (w_h^2 e_h - 2 w_h r + w_h^3 / 10 int e_h dt),  e_h the heading error in (-pi, pi], r the rate of turn

Both are limited. An integral stops growing while it would push a saturated actuator further. `acceleration` and
`maximum_turn_rate` limit how fast the autopilot approaches an order.
"""

from __future__ import annotations

import math

from coupling.fmu.scalar_model import ScalarModel, given, parameter, taken


class Autopilot(ScalarModel):
    """An autopilot for heading and speed.

    Headings are counter-clockwise from +x. `engaged` at 0.5 or less switches the autopilot off: it then gives no order. The module has
    the control laws. Raises ValueError for a parameter that is not above 0.
    """

    heading = taken("rad")
    turn_rate = taken("rad/s")
    vessel_speed = taken("m/s")
    heading_order = taken("rad")
    speed_order = taken("m/s")
    engaged = taken("1", 1.0)
    mass = parameter("kg", 100.0)
    yaw_inertia = parameter("kg m2", 10.0)
    speed_bandwidth = parameter("rad/s", 1.0)
    heading_bandwidth = parameter("rad/s", 1.0)
    acceleration = parameter("m/s2", 0.1)
    maximum_turn_rate = parameter("rad/s", 0.5)
    maximum_thrust = parameter("N", 200.0)
    maximum_moment = parameter("N m", 40.0)
    thrust = given("N")
    yaw_moment = given("N m")

    def __init__(self, name: str = "") -> None:
        super().__init__(name)
        self.memory |= {
            "speed_integral": 0.0,
            "heading_integral": 0.0,
            "speed_now": 0.0,
            "heading_now": 0.0,
            "awake": 0.0,
        }

    def check(self) -> None:
        """Refuse a parameter that is not above 0 with ValueError."""
        for name, variable in self.variables.items():
            if variable.causality.value == "parameter" and not self.memory[name] > 0.0:
                raise ValueError(f"{name} is {self.memory[name]:g} {variable.unit}, allowed: above 0")

    def advance(self, time: float, step_size: float) -> None:
        """Compute thrust [N] and moment [N m] for the coming step."""
        if self.engaged <= 0.5:
            self.thrust = self.yaw_moment = 0.0
            self.memory["awake"] = 0.0
            return
        if self.memory["awake"] == 0.0:  # just engaged: start from the vessel's present speed and heading
            self.memory |= {"speed_integral": 0.0, "heading_integral": 0.0, "awake": 1.0}
            self.memory |= {"speed_now": self.vessel_speed, "heading_now": self.heading}
        self._approach_orders(step_size)
        self._push(step_size)
        self._steer(step_size)

    def _approach_orders(self, step_size: float) -> None:
        memory = self.memory
        change, turn = self.acceleration * step_size, self.maximum_turn_rate * step_size
        memory["speed_now"] += min(max(self.speed_order - memory["speed_now"], -change), change)
        memory["heading_now"] += min(max(_wrapped(self.heading_order - memory["heading_now"]), -turn), turn)

    def _push(self, step_size: float) -> None:
        error, w, limit = self.memory["speed_now"] - self.vessel_speed, self.speed_bandwidth, self.maximum_thrust
        wanted = self.mass * (2.0 * w * error + w**2 * self.memory["speed_integral"])
        self.thrust = min(max(wanted, -limit), limit)
        if (wanted - self.thrust) * error <= 0.0:
            self.memory["speed_integral"] += error * step_size

    def _steer(self, step_size: float) -> None:
        error, w, limit = (
            _wrapped(self.memory["heading_now"] - self.heading),
            self.heading_bandwidth,
            self.maximum_moment,
        )
        integral = self.memory["heading_integral"]
        wanted = self.yaw_inertia * (w**2 * error - 2.0 * w * self.turn_rate + 0.1 * w**3 * integral)
        self.yaw_moment = min(max(wanted, -limit), limit)
        if (wanted - self.yaw_moment) * error <= 0.0:
            self.memory["heading_integral"] += error * step_size


def _wrapped(angle: float) -> float:
    """Return the same angle [rad] in [-pi, pi]."""
    return math.remainder(angle, 2.0 * math.pi)

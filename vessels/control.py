"""The helmsman: speed, heading and lane control of one vessel, as a participant of the coupled run.

All forces are horizontal and act at the height of the centre of mass, so that orders never heave, heel or trim the hull; only the
wind on the superstructure heels it. The loops are proportional and integral, with rate damping for errors of position. An integral
stops growing where it would push a saturated actuator further (conditional integration).

Manual control of a vessel: thrust and steering are ordered from outside, within the machinery's limits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from coupling.master.participant import Causality, Participant, Status, StepResult, Variable
from oilsim.backend.arrays import Array
from oilsim.core.quantity import Quantity, quantities, quantity, quantity_of, require
from vessels.course import Course, CourseLeg, wrap_angle
from vessels.vessel import ControlGains, Vessel, moved_by, planar_motion
from vessels.windage import Wind

HELM_ORDERS = {"speed_order": quantities(CourseLeg)["speed"], "heading_order": quantities(CourseLeg)["heading"]}


@dataclass
class _ControlState:
    """Memory of the controller from step to step; a saved one is checked when it is made anew.

    line: a point (x, y) [m] through which the lines of all legs go; None: each goes through its own.
    """

    leg: int = quantity("", default=-1, at_least=-1.0, whole=True)
    speed_order: float = quantity_of(CourseLeg, "speed", default=0.0)
    heading_order: float = quantity_of(CourseLeg, "heading", default=0.0)
    ramped_speed: float = quantity("m/s", default=0.0)
    speed_integral: float = quantity("m", default=0.0)
    heading_integral: float = quantity("rad s", default=0.0)
    lane_integral: float = quantity("m s", default=0.0)
    line: tuple[float, float] | None = quantity("m", default=None)

    def __post_init__(self) -> None:
        require("helmsman", _ControlState, vars(self))


class _Controls(Participant):
    """What steers a vessel, and the wrench that machinery and wind make.

    current: the water's velocity (2,) [m/s] at a time [s]; wind: that of the air (3,) [m/s] at a place (2,) [m] and a time.
    """

    def __init__(self, vessel: Vessel, orders: Mapping[str, Quantity]) -> None:
        super().__init__(f"{vessel.name}-control", control_variables(vessel.name, orders))
        self.vessel = vessel
        self._values[f"{vessel.name}.pose"][6] = 1.0
        self.current: Callable[[Array, float], Array] = no_current
        self.wind: Wind = no_wind

    def _motion(self) -> tuple[Array, float, float, float, float]:
        """Return the vessel's motion as `planar_motion` does."""
        return planar_motion(self._values[f"{self.vessel.name}.pose"], self._values[f"{self.vessel.name}.twist"])

    def _push(
        self, time: float, wanted: tuple[float, float, float], step_size: float, heading: float, surge: float
    ) -> StepResult:
        """Give the wrench from `time` to `time + step_size` [s] by thrusts ahead and to port [N] and a yaw moment [N m] that are wanted."""
        name = self.vessel.name
        pose, twist, rudder = (self._values[f"{name}.{what}"] for what in ("pose", "twist", "rudder"))
        motion = (pose, twist, self.current(pose[:2], time))
        wrench, given, angle = moved_by(self.vessel, motion, wanted, float(rudder), step_size)
        outputs = dict(zip(("thrust", "side_thrust", "yaw_moment"), given, strict=True))
        outputs |= {"speed": surge, "heading": heading, "rudder": angle}
        for what, value in outputs.items():
            self._values[f"{name}.{what}"] = np.array(value)
        self._values[f"{name}.applied_wrench"] = wrench + self.vessel.wind_wrench(
            pose, twist, self.wind(pose[:2], time)
        )
        return StepResult(Status.OK, time + step_size)


class VesselControl(_Controls):
    """Speed and heading control of `vessel`.

    Inputs: <vessel>.pose (7,) [m, 1], <vessel>.twist (6,) [m/s, rad/s], and the orders <vessel>.speed_order
    [m/s] and <vessel>.heading_order [rad]. An order replaces that of the course until the next leg begins; an autopilot that sets orders
    at every step always rules. Outputs: <vessel>.applied_wrench (6,) [N, N m], and for the record <vessel>.thrust, <vessel>.side_thrust
    [N], <vessel>.yaw_moment [N m], <vessel>.speed [m/s], <vessel>.heading [rad], <vessel>.rudder [rad]. `current` gives the water's
    velocity (2,) [m/s] at a time [s].

    Control laws, with m the mass, I the yaw inertia, w the bandwidth of each loop, and errors order - actual:
    thrust   F = m (2 w e + w^2 int e dt), e the error of the speed along the heading;
    steering M = I (w^2 e - 2 w r + w^3 / 10 int e dt), e the heading error, r the rate of turn;
    lane, with side thrusters: G = m (w^2 e - 2 w v + w^3 / 10 int e dt), e the distance to the line, v the drift;
    lane, without them: the bow points towards the line, off the course by atan((e + U / (6 s) int e dt) / s), with s the lookahead
    and U the ordered speed. This is damped 1.2 times critically; cos^2 of the angle fades the integrand against wind-up
    (Borhaug, Pavlov and Pettersen 2008).

    Raises ValueError for a vessel without a course.
    """

    STATE = ("_values", "_state")

    def __init__(self, vessel: Vessel) -> None:
        """Take the vessel's course; ValueError for a vessel without one."""
        if vessel.course is None:
            raise ValueError(f"vessel {vessel.name!r} has no course, allowed: a course with at least one leg")
        self._course = vessel.course
        super().__init__(vessel, HELM_ORDERS)
        self._state = _ControlState()

    def enter_initialization_mode(self, start_time: float) -> None:
        """Take the orders of the first leg; the speed order rises from rest."""
        self._state = _ControlState()
        self._take_orders(start_time)

    def exit_initialization_mode(self) -> None:
        """Start the speed ramp from the vessel's present speed."""
        self._state.ramped_speed = float(self._motion()[2])

    def set(self, name: str, value: Array) -> None:
        """Set an input; an order holds until the next leg begins."""
        super().set(name, value)
        array = self._values[name]
        if name == f"{self.vessel.name}.speed_order":
            self._state.speed_order = float(array)
        elif name == f"{self.vessel.name}.heading_order":
            self._state.heading_order = float(array)

    @property
    def leg(self) -> CourseLeg:
        """The leg of the course that is in force."""
        return self._course.legs[max(self._state.leg, 0)]

    def change_course(self, course: Course) -> None:
        """Follow the legs of `course` from the next step on; the leg that holds then begins anew, unless only its speed is another."""
        now, before = self._state.leg, self._course.legs
        self.vessel, self._course = replace(self.vessel, course=course), course
        known = 0 <= now < min(len(course.legs), len(before))
        if known and replace(course.legs[now], speed=before[now].speed) == before[now]:
            self._take(course.legs[now])
        else:
            self._state.leg = -1

    def lay_line(self, point: tuple[float, float] | None) -> None:
        """Let the line of every leg that has one go through a point (x, y) [m] from now on; None: through the leg's own."""
        self._state.line = point

    def retune(self, gains: ControlGains) -> None:
        """Use other gains from now on; the thrust that the integral of the speed holds stays as it is."""
        share = self.vessel.gains.speed_bandwidth / gains.speed_bandwidth
        self._state.speed_integral *= share * share
        self.vessel = replace(self.vessel, gains=gains)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Choose the wrench that acts from `time` to `time + step_size` [s]."""
        position, heading, surge, sway, turn_rate = self._motion()
        self._take_orders(time, (float(position[0]), float(position[1])), surge)
        by_hand = self._course.legs[self._state.leg].by_hand
        if self.vessel.engine_runs and by_hand is None:
            offset = self._lane_offset(position)
            thrust = self._thrust(surge, step_size)
            side = self._side_thrust(offset, sway, step_size)
            moment = self._yaw_moment(heading, turn_rate, self._bow_correction(offset, step_size), step_size)
        else:  # its integrals wait, and it will get under way from the speed that it then has
            thrust, side, moment = self._levers(by_hand, surge) if by_hand and self.vessel.engine_runs else (0.0,) * 3
            self._state.ramped_speed = surge
        return self._push(time, (thrust, side, moment), step_size, heading, surge)

    def _take_orders(self, time: float, place: tuple[float, float] | None = None, surge: float = 0.0) -> None:
        """Take the orders of a leg when the leg begins; place (x, y) [m] and speed ahead [m/s], where they are known."""
        state, course = self._state, self._course
        leg = course.leg_index(time, state.leg, place, self._early(surge))
        if leg != state.leg:
            state.leg = leg
            state.lane_integral = 0.0
            self._take(course.legs[leg])

    def _take(self, leg: CourseLeg) -> None:
        """Take the speed and the heading of a leg."""
        self._state.speed_order, self._state.heading_order = leg.speed, leg.heading
        self._values[f"{self.vessel.name}.speed_order"] = np.array(leg.speed)
        self._values[f"{self.vessel.name}.heading_order"] = np.array(leg.heading)

    def _early(self, surge: float) -> float:
        """Return the distance [m] before the end of a leg at which to stop from a speed ahead [m/s], or to turn: a hull's length."""
        course, acceleration = self._course, self.vessel.gains.acceleration
        following = course.legs[min(max(self._state.leg, 0) + 1, len(course.legs) - 1)]
        if following.speed != 0.0:
            return self.vessel.hull.length
        return 0.0 if acceleration is None else 0.5 * surge * abs(surge) / acceleration

    def _lane_offset(self, position: Array) -> float:
        """Return the distance [m] to port that the vessel must move to reach its line; 0 without a line."""
        through = self._course.legs[self._state.leg].through
        if through is None:
            return 0.0
        through = self._state.line or through
        direction = self._state.heading_order
        return math.sin(direction) * (position[0] - through[0]) - math.cos(direction) * (position[1] - through[1])

    def _levers(self, by_hand: tuple[float, float], surge: float) -> tuple[float, float, float]:
        """Return thrust ahead [N], thrust to port [N] and steering moment [N m] at parts of the largest ahead and counter-clockwise."""
        astern, ahead = self.vessel.thrust_limits(surge)
        part, steering = by_hand
        return (part * ahead if part >= 0.0 else -part * astern), 0.0, steering * self.vessel.propulsion.yaw_moment

    def _thrust(self, surge: float, step_size: float) -> float:
        """Compute the thrust ahead [N] from the speed error."""
        state, gains, mass = self._state, self.vessel.gains, self.vessel.hull.mass_properties.mass
        change = math.inf if gains.acceleration is None else gains.acceleration * step_size
        state.ramped_speed += min(max(state.speed_order - state.ramped_speed, -change), change)
        error, w = state.ramped_speed - surge, gains.speed_bandwidth
        wanted = mass * (2.0 * w * error + w**2 * state.speed_integral)
        low, high = self.vessel.thrust_limits(surge)
        thrust = min(max(wanted, low), high)
        state.speed_integral += _integrand(error, wanted, thrust) * step_size
        return thrust

    def _yaw_moment(self, heading: float, turn_rate: float, correction: float, step_size: float) -> float:
        """Compute the steering moment [N m], positive counter-clockwise, from the heading error."""
        state, w, limit = self._state, self.vessel.gains.heading_bandwidth, self.vessel.propulsion.yaw_moment
        inertia = float(self.vessel.hull.mass_properties.inertia[2, 2])
        error = wrap_angle(state.heading_order + correction - heading)
        wanted = inertia * (w**2 * error - 2.0 * w * turn_rate + 0.1 * w**3 * state.heading_integral)
        moment = min(max(wanted, -limit), limit)
        if correction == 0.0:  # the lane's integral also balances a steady moment, and two integrals would oscillate
            state.heading_integral += _integrand(error, wanted, moment) * step_size
        return moment

    def _side_thrust(self, offset: float, sway: float, step_size: float) -> float:
        """Compute the thrust to port [N] that brings the vessel to its line; 0 without side thrusters or without a line."""
        state, w, limit = self._state, self.vessel.gains.lane_bandwidth, self.vessel.propulsion.side_thrust
        if limit == 0.0 or self._course.legs[state.leg].through is None:
            return 0.0
        mass = self.vessel.hull.mass_properties.mass
        wanted = mass * (w**2 * offset - 2.0 * w * sway + 0.1 * w**3 * state.lane_integral)
        thrust = min(max(wanted, -limit), limit)
        state.lane_integral += _integrand(offset, wanted, thrust) * step_size
        return thrust

    def _bow_correction(self, offset: float, step_size: float) -> float:
        """Compute the angle [rad], at most 60 degrees, between bow and course (integral line-of-sight guidance).

        A vessel that goes astern comes nearer to its line with the bow turned away from it.
        """
        if self.vessel.propulsion.side_thrust > 0.0 or offset == 0.0:
            return 0.0
        state, lookahead = self._state, self.vessel.gains.lookahead or 2.0 * self.vessel.hull.length
        rate = abs(state.ramped_speed) / (6.0 * lookahead)
        wanted = math.atan((offset + rate * state.lane_integral) / lookahead)
        correction = min(max(wanted, -math.pi / 3.0), math.pi / 3.0)
        state.lane_integral += _integrand(offset, wanted, correction) * math.cos(correction) ** 2 * step_size
        return math.copysign(1.0, state.ramped_speed) * correction


def _integrand(error: float, wanted: float, limited: float) -> float:
    """Return the error, or 0 where integrating it would push a saturated actuator further (conditional integration)."""
    return 0.0 if (wanted - limited) * error > 0.0 else error


def no_wind(place: Array, time: float) -> Array:
    """Return zeros (3,) [m/s]: still air."""
    return np.zeros(3)


def no_current(place: Array, time: float) -> Array:
    """Return the current (2,) [m/s] of still water."""
    return np.zeros(2)


def control_variables(vessel: str, orders: Mapping[str, Quantity]) -> list[Variable]:
    """List the variables of a controller that steers the vessel of that name; `orders` gives unit and limits of each order."""
    given, taken = Causality.INPUT, Causality.OUTPUT
    return [
        Variable(f"{vessel}.pose", "m, 1", (7,), given),
        Variable(f"{vessel}.twist", "m/s, rad/s", (6,), given),
        *(Variable(f"{vessel}.{order}", limits.unit, (), given, limits=limits) for order, limits in orders.items()),
        Variable(f"{vessel}.applied_wrench", "N, N m", (6,), taken),
        Variable(f"{vessel}.thrust", "N", (), taken),
        Variable(f"{vessel}.side_thrust", "N", (), taken),
        Variable(f"{vessel}.yaw_moment", "N m", (), taken),
        Variable(f"{vessel}.speed", "m/s", (), taken),
        Variable(f"{vessel}.heading", "rad", (), taken),
        Variable(f"{vessel}.rudder", "rad", (), taken),
    ]


MACHINERY_ORDERS = {
    "thrust_order": Quantity(unit="N"),
    "side_thrust_order": Quantity(unit="N"),
    "yaw_moment_order": Quantity(unit="N m"),
}


class ManualControl(_Controls):
    """Manual control of `vessel`: it pushes as ordered.

    Inputs: <vessel>.pose (7,) [m, 1], <vessel>.twist (6,) [m/s, rad/s], and the orders <vessel>.thrust_order
    (ahead) and <vessel>.side_thrust_order (to port) [N] and <vessel>.yaw_moment_order [N m] (counter-clockwise), each 0 until it is set.
    Outputs: <vessel>.applied_wrench (6,) [N, N m], and the part of the orders that the machinery can give: <vessel>.thrust,
    <vessel>.side_thrust [N], <vessel>.yaw_moment [N m]; <vessel>.speed [m/s], <vessel>.heading [rad],
    <vessel>.rudder [rad]. `current` gives the water's velocity (2,) [m/s] at a time [s].
    """

    def __init__(self, vessel: Vessel) -> None:
        super().__init__(vessel, MACHINERY_ORDERS)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Choose the wrench that acts from `time` to `time + step_size` [s]."""
        _, heading, surge, _, _ = self._motion()
        propulsion = self.vessel.propulsion
        thrust = min(max(self._order("thrust"), -propulsion.astern_pull), propulsion.bollard_pull)
        side = min(max(self._order("side_thrust"), -propulsion.side_thrust), propulsion.side_thrust)
        moment = min(max(self._order("yaw_moment"), -propulsion.yaw_moment), propulsion.yaw_moment)
        if not self.vessel.engine_runs:
            thrust, side, moment = 0.0, 0.0, 0.0
        return self._push(time, (thrust, side, moment), step_size, heading, surge)

    def _order(self, what: str) -> float:
        return float(self._values[f"{self.vessel.name}.{what}_order"])

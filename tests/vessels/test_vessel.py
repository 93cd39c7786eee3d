"""Vessel control on a planar body with quadratic drag, and the conventions of heading, thrust and wind."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vessels.control import ManualControl, VesselControl
from vessels.course import Course, CourseLeg, course_through, wrap_angle
from vessels.hull import float_hull, raked_barge
from vessels.vessel import ControlGains, Propulsion, Superstructure, Vessel, heading_of

HULL = float_hull(raked_barge(1.2, 0.4, 0.12, 0.24, rake=0.1), 0.12, water_density=1000.0)
MASS, YAW_INERTIA = HULL.mass_properties.mass, float(HULL.mass_properties.inertia[2, 2])
STEP = 0.02


def make_vessel(*legs, side_thrust=0.0, bollard_pull=40.0, **changes):
    options = {
        "name": "tug",
        "hull": HULL,
        "propulsion": Propulsion(bollard_pull=bollard_pull, astern_pull=20.0, yaw_moment=10.0, side_thrust=side_thrust),
        "course": Course(legs=legs) if legs else None,
        "position": (0.0, 0.0),
        "heading": 0.0,
        "tow_point": (-0.6, 0.0, 0.1),
    }
    return Vessel(**(options | changes))


class PlanarHull:
    """A point mass with yaw inertia: m dv/dt = F - k |u| u ahead, - k' |V| v across it; I dr/dt = M - c r."""

    def __init__(self, vessel, drag=30.0, side_drag=200.0, pull=(0.0, 0.0)):
        self.control = VesselControl(vessel)
        self.drag, self.side_drag, self.pull = drag, side_drag, np.array(pull)
        self.position, self.velocity = np.array(vessel.position, dtype=float), np.zeros(2)
        self.heading, self.turn_rate, self.time = vessel.heading, 0.0, 0.0
        self.control.enter_initialization_mode(0.0)
        self._give()
        self.control.exit_initialization_mode()

    def _give(self):
        half = 0.5 * self.heading
        self.control.set("tug.pose", np.array([*self.position, 0.0, 0.0, 0.0, math.sin(half), math.cos(half)]))
        self.control.set("tug.twist", np.array([*self.velocity, 0.0, 0.0, 0.0, self.turn_rate]))

    def run(self, until):
        for k in range(round(self.time / STEP), round(until / STEP)):
            self._give()
            assert self.control.do_step(k * STEP, STEP).last_successful_time == pytest.approx((k + 1) * STEP)
            wrench = self.control.get("tug.applied_wrench")
            forward = np.array([math.cos(self.heading), math.sin(self.heading)])
            port = np.array([-forward[1], forward[0]])
            surge, sway = self.velocity @ forward, self.velocity @ port
            drag = (
                -self.drag * abs(surge) * surge * forward
                - self.side_drag * float(np.linalg.norm(self.velocity)) * sway * port
            )
            self.velocity = self.velocity + STEP / MASS * (wrench[:2] + drag + self.pull)
            self.turn_rate += STEP / YAW_INERTIA * (wrench[5] - 0.5 * YAW_INERTIA * self.turn_rate)
            self.position = self.position + STEP * self.velocity
            self.heading += STEP * self.turn_rate
        self.time = until
        return self


@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_speed_step_converges_to_the_ordered_speed(speed):
    sim = PlanarHull(make_vessel(CourseLeg(start_time=0.0, speed=speed, heading=0.0))).run(30.0)
    assert sim.velocity == pytest.approx([speed, 0.0], rel=1e-3, abs=1e-6)
    # at rest in the moving frame the thrust balances the drag: F = k v^2
    assert float(sim.control.get("tug.thrust")) == pytest.approx(30.0 * speed**2, rel=5e-3)


def test_thrust_never_exceeds_the_bollard_pull_and_the_integral_does_not_wind_up():
    sim = PlanarHull(
        make_vessel(
            CourseLeg(start_time=0.0, speed=3.0, heading=0.0),
            CourseLeg(start_time=40.0, speed=0.5, heading=0.0),
        )
    ).run(39.9)
    assert float(sim.control.get("tug.thrust")) == 40.0
    assert sim.velocity[0] == pytest.approx(math.sqrt(40.0 / 30.0), rel=1e-3)  # the speed the pull can hold
    # the ordered speed drops: a wound-up integral would hold full thrust for tens of seconds
    sim.run(40.1)
    assert float(sim.control.get("tug.thrust")) < 0.0
    sim.run(70.0)
    assert sim.velocity[0] == pytest.approx(0.5, rel=5e-3)


def test_astern_thrust_has_its_own_limit():
    sim = PlanarHull(make_vessel(CourseLeg(start_time=0.0, speed=-5.0, heading=0.0))).run(1.0)
    assert float(sim.control.get("tug.thrust")) == -20.0


def test_acceleration_limit_ramps_the_ordered_speed():
    gains = ControlGains(acceleration=0.05, speed_bandwidth=4.0)
    sim = PlanarHull(make_vessel(CourseLeg(start_time=0.0, speed=1.0, heading=0.0), gains=gains)).run(10.0)
    assert sim.velocity[0] == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("heading_degrees", [0.0, 90.0, 179.0, -135.0])
def test_vessel_turns_to_its_heading_counter_clockwise_from_x(heading_degrees):
    heading = math.radians(heading_degrees)
    sim = PlanarHull(make_vessel(CourseLeg(start_time=0.0, speed=0.5, heading=heading))).run(120.0)
    assert wrap_angle(sim.heading - heading) == pytest.approx(0.0, abs=2e-3)
    assert sim.velocity == pytest.approx([0.5 * math.cos(heading), 0.5 * math.sin(heading)], abs=5e-3)


def test_vessel_turns_the_short_way_round():
    start, order = math.radians(170.0), math.radians(-170.0)
    vessel = make_vessel(CourseLeg(start_time=0.0, speed=0.0, heading=order), heading=start)
    sim = PlanarHull(vessel).run(0.2)
    assert sim.turn_rate > 0.0 and sim.heading > start


def test_wrench_is_planar():
    vessel = make_vessel(CourseLeg(start_time=0.0, speed=1.0, heading=1.0, through=(0.0, 1.0)), side_thrust=5.0)
    wrench = PlanarHull(vessel).run(1.0).control.get("tug.applied_wrench")
    assert np.all(wrench[[2, 3, 4]] == 0.0) and np.all(wrench[[0, 5]] != 0.0)


@pytest.mark.parametrize("side_thrust", [0.0, 20.0])
def test_vessel_keeps_its_lane_against_a_steady_side_pull(side_thrust):
    leg = CourseLeg(start_time=0.0, speed=0.8, heading=0.0, through=(0.0, 0.5))
    gains = ControlGains(lookahead=1.2)
    sim = PlanarHull(make_vessel(leg, side_thrust=side_thrust, gains=gains), pull=(-10.0, -3.0)).run(150.0)
    assert sim.position[1] == pytest.approx(0.5, abs=0.02)
    assert sim.velocity[0] == pytest.approx(0.8, abs=0.02)


def test_vessel_that_goes_astern_comes_back_to_its_lane():
    """By its bow, which it turns away from the lane for that; with its bow turned to it, it would run away from it."""
    leg = CourseLeg(start_time=0.0, speed=-0.5, heading=0.0, through=(0.0, 1.0))
    sim = PlanarHull(make_vessel(leg)).run(60.0)
    assert sim.position[0] < -20.0
    assert sim.position[1] == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_lane_offset_does_not_depend_on_the_course_direction():
    for heading in (0.0, 0.7, 2.5, -2.0):
        port = np.array([-math.sin(heading), math.cos(heading)])
        leg = CourseLeg(start_time=0.0, speed=0.5, heading=heading, through=tuple(0.6 * port))
        sim = PlanarHull(make_vessel(leg, heading=heading)).run(150.0)
        assert sim.position @ port == pytest.approx(0.6, abs=0.02)


def test_order_set_from_outside_holds_until_the_next_leg():
    vessel = make_vessel(
        CourseLeg(start_time=0.0, speed=0.5, heading=0.0), CourseLeg(start_time=60.0, speed=0.4, heading=0.0)
    )
    sim = PlanarHull(vessel).run(1.0)
    sim.control.set("tug.speed_order", np.array(0.9))
    sim.control.set("tug.heading_order", np.array(0.3))
    sim.run(40.0)
    assert np.linalg.norm(sim.velocity) == pytest.approx(0.9, rel=5e-3)
    assert sim.heading == pytest.approx(0.3, abs=2e-3)
    sim.run(100.0)
    assert sim.velocity == pytest.approx([0.4, 0.0], abs=5e-3)


def test_restored_controller_repeats_its_steps():
    sim = PlanarHull(make_vessel(CourseLeg(start_time=0.0, speed=0.5, heading=0.4))).run(2.0)
    saved = sim.control.save_state()
    sim.control.do_step(2.0, STEP)
    first = sim.control.get("tug.applied_wrench")
    sim.control.do_step(2.0 + STEP, STEP)
    sim.control.restore_state(saved)
    sim.control.do_step(2.0, STEP)
    assert np.array_equal(sim.control.get("tug.applied_wrench"), first)


def test_wind_force_and_its_heeling_moment():
    superstructure = Superstructure(area=0.3, drag_coefficient=1.1, center=(0.0, 0.0, 0.4))
    vessel = make_vessel(CourseLeg(start_time=0.0, speed=0.0, heading=0.0), superstructure=superstructure)
    control = VesselControl(vessel)
    control.enter_initialization_mode(0.0)
    control.set("tug.twist", np.array([0.0, 2.0, 0.0, 0.0, 0.0, 0.0]))
    control.wind = lambda place, time: np.array([0.0, 10.0, 0.0])
    control.do_step(0.0, STEP)
    force = 0.5 * 1.225 * 1.1 * 0.3 * 8.0**2  # 0.5 rho Cd A V^2 with the apparent wind of 8 m/s
    assert control.get("tug.applied_wrench") == pytest.approx([0.0, force, 0.0, -0.4 * force, 0.0, 0.0], abs=1e-9)


def test_timed_legs_follow_the_clock():
    legs = [CourseLeg(start_time=start, speed=1.0, heading=0.0) for start in (0.0, 10.0, 30.0)]
    assert [Course(legs=tuple(legs)).leg_index(t) for t in (-1.0, 0.0, 9.9, 10.0, 99.0)] == [0, 0, 0, 1, 2]


@pytest.mark.parametrize("pull", [(0.0, 0.0), (-12.0, 10.0)])
def test_a_vessel_passes_its_waypoints_whatever_pulls_at_it_and_stops_at_the_last(pull):
    """A boom, a current or the wind make it slow; the clock does not turn it early."""
    waypoints = [(12.0, 16.0), (12.0, 40.0), (-8.0, 40.0)]
    course = course_through([(0.0, 0.0), *waypoints], 1.0)
    assert [leg.heading for leg in course.legs[:3]] == pytest.approx([math.atan2(4.0, 3.0), 0.5 * math.pi, math.pi])
    vessel = make_vessel(CourseLeg(start_time=0.0, speed=0.0, heading=0.0), side_thrust=60.0)
    sim = PlanarHull(replace(vessel, course=course, gains=replace(vessel.gains, acceleration=0.05)), pull=pull)
    track = []
    for second in range(1, 131):
        track.append(sim.run(float(second)).position.copy())
    for place in waypoints[:-1]:
        assert np.linalg.norm(np.array(track) - place, axis=1).min() < 1.5 * vessel.hull.length
    assert sim.position == pytest.approx(waypoints[-1], abs=1.5)
    assert np.linalg.norm(sim.velocity) < 0.05


@pytest.mark.parametrize(("speed", "acceleration"), [(1.0, 0.05), (0.6, 0.04)])
def test_a_vessel_begins_to_stop_at_its_stopping_distance(speed, acceleration):
    """Half its speed squared over its acceleration before the last waypoint, which lies 30 m ahead."""
    vessel = make_vessel(CourseLeg(start_time=0.0, speed=0.0, heading=0.0))
    gains = replace(vessel.gains, acceleration=acceleration)
    sim = PlanarHull(replace(vessel, course=course_through([(0.0, 0.0), (30.0, 0.0)], speed), gains=gains))
    while float(sim.control.get("tug.speed_order")) != 0.0:
        sim.run(sim.time + STEP)
    assert sim.velocity[0] == pytest.approx(speed, rel=0.02)
    assert 30.0 - sim.position[0] == pytest.approx(0.5 * sim.velocity[0] ** 2 / acceleration, rel=0.01)


def test_impossible_orders_are_refused():
    with pytest.raises(ValueError, match="no legs"):
        Course(legs=())
    leg = CourseLeg(start_time=1.0, speed=0.0, heading=0.0)
    with pytest.raises(ValueError, match="times that increase"):
        Course(legs=(leg, leg))
    with pytest.raises(ValueError, match="two waypoints"):
        course_through([(0.0, 0.0)], 0.5)
    with pytest.raises(ValueError, match="bollard_pull"):
        Propulsion(bollard_pull=-1.0, astern_pull=1.0, yaw_moment=1.0)
    with pytest.raises(ValueError, match="speed_bandwidth"):
        ControlGains(speed_bandwidth=0.0)


def test_initial_pose_puts_midships_and_tow_point_where_they_belong():
    vessel = make_vessel(CourseLeg(start_time=0.0, speed=0.0, heading=0.0), position=(2.0, 3.0), heading=math.pi / 2)
    position, orientation = vessel.initial_pose(0.6)
    assert position[:2] == pytest.approx([2.0, 3.0])
    assert position[2] + HULL.mesh.bounds[0, 2] == pytest.approx(0.6 - 0.12)  # keel at the draft
    assert heading_of(orientation) == pytest.approx(math.pi / 2)
    assert vessel.initial_tow_point(0.6)[:2] == pytest.approx([2.0, 2.4])  # astern of a vessel that heads +y


def test_vessel_without_a_helmsman_pushes_as_ordered_and_as_its_machinery_can():
    vessel = make_vessel(side_thrust=5.0)
    with pytest.raises(ValueError, match="'tug' has no course"):
        VesselControl(vessel)
    control = ManualControl(vessel)
    control.enter_initialization_mode(0.0)
    control.set("tug.pose", np.array([0.0, 0.0, 0.0, 0.0, 0.0, math.sin(0.25 * math.pi), math.cos(0.25 * math.pi)]))
    control.exit_initialization_mode()
    control.do_step(0.0, STEP)
    assert control.get("tug.applied_wrench") == pytest.approx(np.zeros(6))  # no order, no push
    control.set("tug.thrust_order", np.array(10.0))
    control.set("tug.side_thrust_order", np.array(-2.0))
    control.set("tug.yaw_moment_order", np.array(3.0))
    control.do_step(STEP, STEP)
    # heading +y: ahead is +y, to port is -x
    assert control.get("tug.applied_wrench") == pytest.approx([2.0, 10.0, 0.0, 0.0, 0.0, 3.0])
    saved = control.save_state()
    control.set("tug.thrust_order", np.array(-100.0))
    control.set("tug.side_thrust_order", np.array(100.0))
    control.set("tug.yaw_moment_order", np.array(-100.0))
    control.do_step(2 * STEP, STEP)
    given = [float(control.get(f"tug.{what}")) for what in ("thrust", "side_thrust", "yaw_moment")]
    assert given == [-20.0, 5.0, -10.0]  # astern pull, side thrusters and steering moment at their limits
    control.restore_state(saved)
    control.do_step(2 * STEP, STEP)
    assert control.get("tug.applied_wrench") == pytest.approx([2.0, 10.0, 0.0, 0.0, 0.0, 3.0])


@pytest.mark.parametrize("side_thrust", [0.0, 10.0])
def test_without_its_engine_a_vessel_drifts_and_then_obeys_again(side_thrust):
    """No thrust and no steering; its integrals have not grown meanwhile, so that it comes back to its speed without overshoot."""
    hull = PlanarHull(
        make_vessel(CourseLeg(start_time=0.0, speed=0.5, heading=0.0, through=(0.0, 0.0)), side_thrust=side_thrust)
    ).run(20.0)
    hull.control.vessel = replace(hull.control.vessel, engine_runs=False)
    hull.run(40.0)
    assert hull.control.get("tug.applied_wrench").tolist() == [0.0] * 6
    assert hull.velocity[0] < 0.2
    hull.control.vessel = replace(hull.control.vessel, engine_runs=True)
    fastest = max(hull.run(40.0 + second).velocity[0] for second in range(1, 20))
    assert 0.49 < fastest < 0.55
    manual = ManualControl(make_vessel(engine_runs=False))
    manual.set("tug.thrust_order", np.array(5.0))
    manual.do_step(0.0, STEP)
    assert manual.get("tug.thrust") == 0.0


def test_by_hand_a_vessel_gets_parts_of_its_largest_thrust_and_steering():
    legs = (
        CourseLeg(start_time=0.0, speed=0.0, heading=0.0, by_hand=(0.25, 0.0)),
        CourseLeg(start_time=30.0, speed=0.0, heading=0.0, by_hand=(-0.5, -0.2)),
        CourseLeg(start_time=40.0, speed=0.5, heading=0.0),
    )
    sim = PlanarHull(make_vessel(*legs)).run(29.9)
    assert float(sim.control.get("tug.thrust")) == 10.0
    assert sim.velocity[0] == pytest.approx(math.sqrt(10.0 / 30.0), rel=1e-3)  # F = k v^2
    sim.run(39.9)
    assert float(sim.control.get("tug.thrust")) == -10.0  # half of the thrust astern
    assert float(sim.control.get("tug.yaw_moment")) == -2.0
    assert sim.turn_rate < 0.0
    sim.run(100.0)  # the helmsman takes over again, and comes back to course and speed
    assert sim.velocity == pytest.approx([0.5, 0.0], abs=5e-3)
    with pytest.raises(ValueError, match="by_hand"):
        CourseLeg(start_time=0.0, speed=0.0, heading=0.0, by_hand=(1.1, 0.0))

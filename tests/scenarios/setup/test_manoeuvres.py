"""Manoeuvres of a vessel without particles: turning circle, stop, zig-zag, loss of an engine, drift in wind, station keeping."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from scenarios.running.assembly import Assembly, build
from scenarios.setup.afloat.fleet import course_of
from scenarios.spec.load import scenario_from
from scenarios.text.problems import ScenarioError
from vessels.course import Course, CourseLeg
from vessels.drive import Drive
from vessels.vessel import planar_motion

LENGTH = 15.0
BASE = """
name = "manoeuvre"
fidelity = "none"
[run]
duration = 300.0
communication_step = 0.2
[fluid]
particle_spacing = 0.25
[phases.water]
density = 1027.0
dynamic_viscosity = 1.05e-3
[tank]
lower = [-500.0, -500.0, -30.0]
upper = [500.0, 500.0, 6.0]
open = ["-x", "+x", "-y", "+y", "+z"]
[sea]
depth = 30.0
[vessels.tug]
length = 15.0
beam = 5.0
draft = 1.6
depth = 3.0
position = [0.0, 0.0]
bollard_pull = 40000.0
skeg_area = 3.0
"""
MANUAL = 'control = "manual"\n'
SCREWS = "[vessels.tug.drive]\ndiameter = 1.1\nspacing = 2.4\nrudder_area = 1.2\n"


class Trial:
    """A vessel under manual orders of thrust, side thrust [N] and moment [N m], or its helmsman's; its motion at every step."""

    def __init__(self, text: str) -> None:
        self.assembly: Assembly = build(scenario_from(tomllib.loads(text)))
        self.simulation = self.assembly.co_simulation()
        self.simulation.initialize()
        (self.control,) = (one for one in self.assembly.participants if one.name == "tug-control")
        self.track: list[tuple[float, float, float, float, float]] = []

    def run(self, seconds: float, **orders: float) -> None:
        for name, value in orders.items():
            self.control.set(f"tug.{name}_order", np.array(value))
        for _ in range(round(seconds / 0.2)):
            self.simulation.step()
            world = self.assembly.world
            position, heading, surge, sway, _ = planar_motion(world.pose("vessels/tug"), world.twist("vessels/tug"))
            self.track.append((float(position[0]), float(position[1]), heading, surge, sway))

    @property
    def motion(self) -> np.ndarray:
        """x, y [m], heading [rad, unwrapped], speed ahead and to port [m/s], by step."""
        track = np.array(self.track)
        track[:, 2] = np.unwrap(track[:, 2])
        return track


@pytest.fixture(scope="module")
def under_way() -> Trial:
    """A vessel that has run ahead for a minute; its state is restored by each test that goes on from there."""
    trial = Trial(BASE + MANUAL + SCREWS)
    trial.run(50.0, thrust=9000.0)
    return trial


@pytest.fixture
def ahead(under_way: Trial) -> Trial:
    if not hasattr(under_way, "saved"):
        under_way.saved = under_way.simulation.save_state()
        under_way.begun = list(under_way.track)
    under_way.simulation.restore_state(under_way.saved)
    under_way.track = list(under_way.begun)
    return under_way


def test_turning_circle(ahead: Trial) -> None:
    # IMO MSC.137(76): tactical diameter at most 5 L, advance at most 4.5 L; workboats turn within 2.5 to 5 L
    begin = ahead.motion[-1]
    ahead.run(50.0, yaw_moment=1e6)
    turned = ahead.motion[len(ahead.begun) :]
    angle = turned[:, 2] - begin[2]
    half = turned[np.argmax(angle > math.pi)]
    quarter = turned[np.argmax(angle > 0.5 * math.pi)]
    assert angle.max() > math.pi
    assert 2.5 < (half[1] - begin[1]) / LENGTH < 5.0
    assert 1.5 < (quarter[0] - begin[0]) / LENGTH < 4.5
    assert turned[-1, 3] < 0.85 * begin[3]  # a turn takes speed
    assert turned[-1, 4] < 0.0  # and a vessel that turns to port drifts to starboard


def test_full_astern_stops_within_fifteen_lengths(ahead: Trial) -> None:
    begin = ahead.motion[-1]
    ahead.run(40.0, thrust=-40000.0, yaw_moment=0.0)
    stopped = ahead.motion[len(ahead.begun) :]
    at = stopped[np.argmax(stopped[:, 3] < 0.0)]
    assert (stopped[:, 3] < 0.0).any()
    assert 0.5 < (at[0] - begin[0]) / LENGTH < 15.0


def test_vessel_loses_way_and_turns_when_a_screw_stops(ahead: Trial) -> None:
    begin = ahead.motion[-1]
    vessel = ahead.control.vessel
    ahead.control.vessel = replace(vessel, screws=(True, False))
    ahead.run(15.0, thrust=9000.0, yaw_moment=0.0)
    ahead.control.vessel = vessel
    turned = ahead.motion[-1, 2] - begin[2]
    assert turned < -math.radians(3.0)  # the port screw pushes the bow to starboard


@pytest.mark.slow
def test_zig_zag_overshoots_within_the_criterion(ahead: Trial) -> None:
    # IMO MSC.137(76): first overshoot of the 10/10 zig-zag at most 10 degrees for L / V < 10 s
    ten = math.radians(10.0)
    begin = ahead.motion[-1, 2]
    side, swings = 1.0, 0
    extremes = []
    drive = ahead.control.vessel.drive
    ahead.control.vessel = replace(ahead.control.vessel, drive=drive.limited(ten))
    try:
        for _ in range(300):
            ahead.run(0.2, yaw_moment=side * 1e6)
            off = ahead.motion[-1, 2] - begin
            extremes.append(off)
            if side * off > ten:
                side, swings = -side, swings + 1
            if swings == 3:
                break
    finally:
        ahead.control.vessel = replace(ahead.control.vessel, drive=drive)
    assert swings == 3
    overshoot = math.degrees(max(extremes)) - 10.0
    assert 0.2 < overshoot < 10.0


@pytest.mark.slow
def test_vessel_without_power_drifts_beam_to_wind() -> None:
    # leeway of small vessels: some 2 to 6 % of the wind (Allen and Plourde 1999, sport and fishing boats)
    wind = '[sea.wind]\nkind = "steady"\nspeed = 12.0\ndirection_deg = 90.0\n'
    text = BASE + MANUAL + 'engine = "stopped"\nsuperstructure_area = 12.0\n' + SCREWS + wind
    trial = Trial(text)
    trial.run(80.0)
    speed = np.hypot(*(trial.motion[-1, :2] - trial.motion[-51, :2])) / 10.0
    assert 0.02 < speed / 12.0 < 0.07


@pytest.mark.slow
@pytest.mark.parametrize("drive", ["[vessels.tug.drive]\ndiameter = 1.1\nspacing = 2.4\n", SCREWS])
def test_station_is_kept_in_current_and_wind(drive: str) -> None:
    weather = '[sea.wind]\nkind = "steady"\nspeed = 10.0\ndirection_deg = 150.0\n'
    weather += '[sea.current]\nkind = "steady"\nspeed = 1.0\ndirection_deg = 180.0\n'
    legs = "legs = [{ speed = 0.0, heading_deg = 10.0, through = [0.0, 0.0] }]\nside_thrust = 15000.0\nsuperstructure_area = 12.0\n"
    trial = Trial(BASE.replace("[vessels.tug]", "[vessels.tug]\n" + legs) + drive + weather)
    trial.run(100.0)
    last = trial.motion[-100:]
    assert np.hypot(last[:, 0], last[:, 1]).max() < 2.0
    assert np.abs(np.degrees(last[:, 2]) - 10.0).max() < 5.0


def test_wrong_drives_are_told_at_once() -> None:
    text = BASE + MANUAL + 'engine = "port stopped"\nyaw_moment = 1.0\n[vessels.tug.drive]\ncount = 1\ndiameter = 1.0\n'
    with pytest.raises(ScenarioError) as caught:
        scenario_from(tomllib.loads(text))
    found = {problem.path: problem.text for problem in caught.value.problems}
    assert found["vessels.tug.yaw_moment"] == "is given beside drive, allowed: one of drive or yaw_moment"
    assert found["vessels.tug.engine"].endswith('allowed: "running" or "stopped" without a drive of two screws')
    with pytest.raises(ScenarioError) as caught:
        scenario_from(
            tomllib.loads(
                BASE + "legs = [{ speed = 1.0, heading = 0.0 }]\n[vessels.tug.drive]\ndiameter = 1.0\nspacing = 0.5\n"
            )
        )
    assert "vessels.tug.drive.spacing is 0.5 m, allowed: diameter = 1 m or more with 2 screws" in str(caught.value)
    with pytest.raises(ScenarioError, match="drive is missing, allowed: drive or yaw_moment"):
        scenario_from(tomllib.loads(BASE + "legs = [{ speed = 1.0, heading = 0.0 }]\n"))


HELMSMAN = (
    "yaw_moment = 200000.0\nside_thrust = 12000.0\nlegs = [{speed = 0.5, heading_deg = 0.0, through = [0.0, 0.0]}]\n"
)
WAVES = '[sea.waves]\nkind = "regular"\nheight = 0.4\nperiod = 4.0\ndirection_deg = 180.0\n'


def thrusts(trial: Trial, seconds: float) -> np.ndarray:
    """Go on for some `seconds` and return the thrust [N] at every step."""
    found = []
    for _ in range(round(seconds / 0.2)):
        trial.run(0.2)
        found.append(float(trial.control.get("tug.thrust")))
    return np.array(found)


def test_a_helmsman_in_waves_keeps_the_speed_and_does_not_work_against_each_wave() -> None:
    """Waves of 0.4 m and 4 s from ahead: 0.5 m/s in the mean of ten, and no thrust that the machinery lacks astern; the hull surges."""
    trial = Trial(BASE + HELMSMAN + WAVES)
    trial.run(60.0)
    thrust = thrusts(trial, 40.0)
    surge = trial.motion[-200:, 3]
    assert surge.mean() == pytest.approx(0.5, abs=0.01)
    assert np.ptp(surge) > 0.2
    assert np.abs(thrust).max() < 0.5 * 0.5 * 40000.0


def test_a_low_swell_leaves_the_helmsman_as_quick_as_calm_water_does() -> None:
    calm, swell = (
        Trial(BASE + HELMSMAN + waves) for waves in ("", WAVES.replace("0.4", "0.05").replace("4.0", "14.0"))
    )
    for trial in (calm, swell):
        trial.run(20.0)
    assert swell.motion[:, 3] == pytest.approx(calm.motion[:, 3], abs=0.02)


def test_waves_that_are_ordered_make_the_helmsman_patient_without_a_jerk() -> None:
    """The thrust that the loop holds stays; calm water again makes it as quick as before."""
    trial = Trial(BASE + HELMSMAN)
    trial.run(60.0)
    calm, held = trial.assembly.scenario, float(trial.control.get("tug.thrust"))
    rough = scenario_from(tomllib.loads(BASE + HELMSMAN + WAVES.replace("0.4", "0.8")))
    quick = trial.control.vessel.gains
    trial.assembly.controls.order(rough)
    assert trial.control.vessel.gains.speed_bandwidth < 0.1 * quick.speed_bandwidth
    assert abs(thrusts(trial, 0.2)[0] - held) < 0.02 * 40000.0
    assert np.abs(thrusts(trial, 40.0)).max() < 0.5 * 40000.0
    trial.assembly.controls.order(calm)
    assert trial.control.vessel.gains == quick


def test_a_tow_that_turns_goes_on_from_where_its_vessels_are() -> None:
    """At 60 m from its start a vessel turns by 20 degrees. The line through its start is 20 m off; slower, it keeps the new one."""
    tow = (
        BASE.replace("bollard_pull", "side_thrust = 4000.0\nbollard_pull")
        + SCREWS
        + "[tow]\nspeed = {}\nheading = {}\n"
    )
    trial = Trial(tow.format(2.0, 0.0))
    trial.run(40.0)
    begin, heading = trial.motion[-1], math.radians(20.0)
    assert begin[0] > 60.0
    trial.assembly.controls.order(scenario_from(tomllib.loads(tow.format(2.0, heading))))
    trial.run(20.0)
    trial.assembly.controls.order(scenario_from(tomllib.loads(tow.format(1.0, heading))))
    trial.run(60.0)
    off = trial.motion[-400:] - begin
    to_port = math.cos(heading) * off[:, 1] - math.sin(heading) * off[:, 0]
    assert np.abs(to_port).max() < LENGTH
    assert np.abs(to_port[-50:]).max() < 1.0


def test_a_drive_is_as_its_table_says() -> None:
    table = "[vessels.tug.drive]\ncount = 1\ndiameter = 1.3\nspacing = 0.0\npitch_ratio = 1.1\nrudder_area = 0.9\n"
    drive = Trial(BASE + MANUAL + table).control.vessel.drive.drive
    assert drive == Drive(count=1, diameter=1.3, spacing=0.0, pitch_ratio=1.1, rudder_area=0.9)


WAYPOINTS = "waypoints = [[200.0, 0.0], [200.0, 150.0]]\ntransit_kn = 2.0\n"
SPEED = 2.0 * 1852.0 / 3600.0  # m/s


def course(text: str, tow: str = "") -> Course | None:
    """Return the course of the vessel at (10, -5) with these lines more in its table, and a tow's."""
    base = BASE.replace("position = [0.0, 0.0]", "position = [10.0, -5.0]")
    scenario = scenario_from(tomllib.loads(base + text + SCREWS + tow))
    return course_of(scenario.vessels["tug"], scenario.tow)


@pytest.mark.parametrize("depart", [0.0, 30.0])
def test_a_vessel_goes_through_its_waypoints_from_its_departure_on(depart: float) -> None:
    """It waits with its bow to the first one; each leg ends at its waypoint, and the last is a stop there."""
    begin, first, second = (10.0, -5.0), (200.0, 0.0), (200.0, 150.0)
    there, then = math.atan2(5.0, 190.0), 0.5 * math.pi
    expected = [
        CourseLeg(start_time=depart, speed=SPEED, heading=there, through=begin, until=first),
        CourseLeg(start_time=depart, speed=SPEED, heading=then, through=first, until=second),
        CourseLeg(start_time=depart, speed=0.0, heading=then, through=second),
    ]
    if depart > 0.0:
        expected.insert(0, CourseLeg(start_time=0.0, speed=0.0, heading=there, through=begin))
    found = course(WAYPOINTS + (f"depart = {depart}\n" if depart else ""))
    assert found is not None and len(found.legs) == len(expected)
    for leg, wanted in zip(found.legs, expected, strict=True):
        assert (leg.start_time, leg.through, leg.until, leg.by_hand) == (
            wanted.start_time, wanted.through, wanted.until, None,
        )  # fmt: skip
        assert (leg.speed, leg.heading) == pytest.approx((wanted.speed, wanted.heading), abs=1e-12)


def test_a_vessel_without_a_course_of_its_own_takes_that_of_the_tow() -> None:
    """From the tow's start on, along the line through its place, where it waits until then; its own legs come first, a hand has none."""
    tow = "[tow]\nspeed = 0.8\nheading_deg = 90.0\nstart = {}\n"
    east, place = pytest.approx(0.5 * math.pi), (10.0, -5.0)
    for start, speeds in ((0.0, [(0.0, 0.8)]), (20.0, [(0.0, 0.0), (20.0, 0.8)])):
        found = course("", tow.format(start))
        assert found is not None
        assert [(leg.start_time, leg.speed) for leg in found.legs] == speeds
        assert all((leg.heading, leg.through) == (east, place) for leg in found.legs)
    own = course("legs = [{ start = 5.0, speed = 1.5, heading_deg = 90.0, through = [1.0, 2.0] }]\n", tow.format(20.0))
    assert own is not None
    assert [(leg.start_time, leg.speed, leg.heading, leg.through) for leg in own.legs] == [(5.0, 1.5, east, (1.0, 2.0))]
    assert course(MANUAL, tow.format(0.0)) is None

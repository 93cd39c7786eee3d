"""Checks on motions that are known exactly: each passes on them, and fails beside them with all its numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupling.solids.bodies import box
from coupling.testkit import (
    CheckFailed,
    Readings,
    assert_added_mass,
    assert_damping,
    assert_draft,
    assert_dry,
    assert_force,
    assert_heel,
    assert_joint_gap,
    assert_metacentric_height,
    assert_no_leak,
    assert_oil_contained,
    assert_period,
    assert_reflection,
    assert_tension,
    assert_terminal_speed,
    assert_trim,
    assert_volume,
    assert_wave_height,
)
from coupling.testkit.readings import BodyTrack, Track
from oilsim import block
from oilsim.sea.regular_waves import wave_number
from recordings.model.frame import MeshDescription, PhaseDescription, RunDescription

SIDE, SPACING, LEVEL = 0.2, 0.05, 0.5  # m
PERIOD, RATE, WAVE, DEPTH, APART = 0.8, 0.4, 1.0, 0.5, 0.3  # s, 1/s, s, m, m
TIME = np.arange(0.0, 4.005, 0.01)
HEAVE = 0.1 * np.exp(-RATE * TIME) * np.cos(2.0 * math.pi * TIME / PERIOD)
WAVE_RATE, NUMBER = 2.0 * math.pi / WAVE, wave_number(WAVE, DEPTH)


def track(
    place: tuple[float, float, float] = (0.0, 0.0, LEVEL), turn: tuple[float, ...] = (0.0, 0.0, 0.0)
) -> BodyTrack:
    """A body at rest, turned by yaw, pitch and roll [rad]; tests move and load it."""
    pose = np.tile([*place, *Rotation.from_euler("ZYX", turn).as_quat()], (len(TIME), 1))
    rows = np.zeros((2, len(TIME), 6))
    return BodyTrack(time=TIME, pose=pose, twist=rows[0], wrench=rows[1], tension=np.zeros(len(TIME)))


@cache
def known() -> Readings:
    """A raft at rest, one that heaves, a body that leans, one that sinks, one that is pushed, waves, water with a drop of oil."""
    bodies = {name: track() for name in ("raft", "heaver", "sinker", "pushed")}
    bodies["leaner"] = track((1.0, 0.0, LEVEL), (0.3, 0.1, 0.05))
    bodies["raft"].wrench[:, 2], bodies["raft"].wrench[:, 0] = 39.24, 5.0 * np.sin(TIME)
    bodies["heaver"].pose[:, 2] += HEAVE
    bodies["sinker"].twist[:, 2] = -0.3 * (1.0 - np.exp(-5.0 * TIME))
    bodies["pushed"].twist[1:, 0], bodies["pushed"].wrench[1:, 0] = 0.02, -10.0  # 2 m/s2, of 5 kg
    phase = WAVE_RATE * TIME
    gauges = {"open": 0.04 * np.cos(phase)}
    for name, x in (("near", 0.0), ("far", APART)):
        gauges[name] = 0.04 * np.cos(NUMBER * x - phase) + 0.01 * np.cos(NUMBER * x + phase + 0.4)
    series = {f"probes/{name}": Track(TIME, height) for name, height in gauges.items()}
    series |= {"tension/tow": Track(TIME, 40.0 + np.sin(2.0 * math.pi * TIME))}
    series |= {
        f"oil_{what}": Track(TIME, np.full(len(TIME), amount)) for what, amount in (("contained", 3.0), ("lost", 1.0))
    }
    mesh = box((SIDE, SIDE, SIDE))
    told = MeshDescription(vertices=mesh.vertices, faces=mesh.faces)
    water, oil = block((2.0, 0.0, 0.0), (2.2, 0.2, 0.2), SPACING), np.array([[2.1, 0.1, 0.3], [3.0, 0.1, 0.3]])
    water[0] = (0.08, 0.0, LEVEL)  # 0.02 m deep in a raft
    particles = {"water": water, "oil": oil}
    phases = (
        PhaseDescription(name="water", rest_density=1000.0),
        PhaseDescription(name="oil", rest_density=900.0, is_oil=True),
    )
    run = RunDescription(name="known", particle_spacing=SPACING, phases=phases, meshes=dict.fromkeys(bodies, told))
    return Readings(run=run, bodies=bodies, series=series, particles=particles.__getitem__, time=float(TIME[-1]))


Check = Callable[[Readings, float], None]  # of readings, and how much else than the truth is expected
GAUGES = ("near", "far")
GM = SIDE**2 / 12.0 / (0.5 * SIDE) - 0.25 * SIDE  # I / V - B G of a half-submerged cube
BOTTOM = LEVEL - (LEVEL + HEAVE[-1] - 0.5 * SIDE)

CASES: dict[str, tuple[Check, float, str]] = {
    "draft": (
        lambda r, off: assert_draft(r, "heaver", BOTTOM + off, within=0.01, level=LEVEL),
        0.02,
        "draft of 'heaver' is 0.07981 m, expected: 0.09981 m within 0.01 m at 4 s; the particles are 0.05 m apart, and 0.025 m would "
        "meet this tolerance if the error shrinks with the spacing",
    ),
    "heel": (
        lambda r, off: assert_heel(r, "leaner", 0.05 + off, within=1e-6),
        0.1,
        "heel of 'leaner' is 0.05 rad, expected: 0.15 rad within 1e-06 rad at 4 s",
    ),
    "trim": (
        lambda r, off: assert_trim(r, "leaner", 0.1 + off, within=1e-6),
        0.1,
        "trim of 'leaner' is 0.1 rad, expected: 0.2 rad within 1e-06 rad at 4 s",
    ),
    "metacentric height": (
        lambda r, off: assert_metacentric_height(r, "raft", GM + off, within=1e-4, level=LEVEL),
        0.01,
        "metacentric height of 'raft' is -0.016667 m, expected: -0.0066667 m within 0.0001 m at 4 s",
    ),
    "mean force": (
        lambda r, off: assert_force(r, "raft", 39.24 + off, along="z", within=1.0),
        4.0,
        "mean force along z on 'raft' is 39.24 N, expected: 43.24 N within 1 N at 4 s; the particles are 0.05 m apart, and 0.013 m",
    ),
    "force curve": (
        lambda r, off: assert_force(r, "raft", lambda t: (5.0 + off) * np.sin(t), along="x", within=0.1),
        1.0,
        "force along x on 'raft' is 5 N, expected: 6 N within 0.1 N at 1.57 s",
    ),
    "period": (
        lambda r, off: assert_period(r, "heaver", PERIOD + off, of="z", within=0.01),
        0.04,
        "period of 'heaver' in z is 0.8 s, expected: 0.84 s within 0.01 s at 4 s",
    ),
    "damping": (
        lambda r, off: assert_damping(r, "heaver", 1.0 - math.exp(-RATE * PERIOD) + off, of="z", period=0.85, within=0.01),
        0.1,
        "damping a period of 'heaver' in z is 0.27385, expected: 0.37385 within 0.01 at 4 s",
    ),
    "terminal speed": (
        lambda r, off: assert_terminal_speed(r, "sinker", -0.3 + off, along="z", within=0.001),
        0.01,
        "terminal velocity along z of 'sinker' is -0.3 m/s, expected: -0.29 m/s within 0.001 m/s at 4 s",
    ),
    "added mass": (
        lambda r, off: assert_added_mass(r, "pushed", 5.0 + off, along="x", within=0.5),
        2.0,
        "added mass of 'pushed' along x is 5 kg, expected: 7 kg within 0.5 kg at 4 s",
    ),
    "joint gap": (
        lambda r, off: assert_joint_gap(r, "raft", (0.0, 0.0, 0.1), None, (0.0, 0.0, 0.61 + off), within=0.011),
        0.02,
        "joint of 'raft' gapes by 0.03 m, expected: 0.011 m at most at 0 s",
    ),
    "tension": (
        lambda r, off: assert_tension(r, "tow", 40.0 + off, within=0.5, since=1.0),
        5.0,
        "mean tension of 'tow' is 40 N, expected: 45 N within 0.5 N at 4 s",
    ),
    "no leak": (
        lambda r, off: assert_no_leak(r, (0.0, -0.1, 0.0), (3.0 - 25.0 * off, 1.0, 1.0), phase="oil", at_most=1e-6),
        0.02,
        "volume of oil outside (0.0, -0.1, 0.0) to (2.5, 1.0, 1.0) m is 0.000125 m3, expected: 1e-06 m3 at most at 4 s",
    ),
    "volume": (
        lambda r, off: assert_volume(r, 0.008 + off, within=1e-9, phase="water"),
        0.001,
        "volume of water is 0.008 m3, expected: 0.009 m3 within 1e-09 m3 at 4 s",
    ),
    "dry": (
        lambda r, off: assert_dry(r, "raft", within=0.021 - off),
        0.011,
        "deepest particle in 'raft' lies in it by 0.02 m, expected: 0.01 m at most at 4 s",
    ),
    "oil in a box": (
        lambda r, off: assert_oil_contained(r, 0.5 + off, within=0.01, inside=((2.0, 0.0, 0.0), (2.5, 1.0, 1.0))),
        0.2,
        "share of oil contained is 0.5, expected: 0.7 within 0.01 at 4 s",
    ),
    "oil of a boom": (
        lambda r, off: assert_oil_contained(r, 0.75 + off, within=0.01, boom="main"),
        0.1,
        "share of oil contained is 0.75, expected: 0.85 within 0.01 at 4 s",
    ),
    "wave height": (
        lambda r, off: assert_wave_height(r, "open", 0.08 + off, period=WAVE, within=0.001),
        0.01,
        "wave height at gauge 'open' is 0.08 m, expected: 0.09 m within 0.001 m at 4 s",
    ),
    "reflection": (
        lambda r, off: assert_reflection(r, GAUGES, 0.25 + off, apart=APART, depth=DEPTH, period=WAVE, within=0.01),
        0.1,
        "reflected share of the wave at 'near' is 0.25, expected: 0.35 within 0.01 at 4 s",
    ),
}  # fmt: skip
OF_NO_SPACING = ("joint gap",)  # it does not come from the water


@pytest.mark.parametrize("name", CASES)
def test_check_passes_on_the_truth_and_fails_beside_it_with_all_its_numbers(name: str) -> None:
    check, off, words = CASES[name]
    check(known(), 0.0)
    with pytest.raises(CheckFailed, match=re.escape(words)) as caught:
        check(known(), off)
    failure = caught.value
    assert ("the particles are 0.05 m apart, and " in str(failure)) == (name not in OF_NO_SPACING)
    assert failure.time is not None
    assert abs(failure.measured - (failure.expected or 0.0)) > failure.tolerance


def test_velocity_that_still_changes_is_not_taken_for_a_terminal_one() -> None:
    with pytest.raises(
        CheckFailed, match=r"velocity along z of 'sinker' is not steady: its late change is 0\.0\d+ m/s, expected: "
    ):
        half = TIME < 0.5
        sinker = known().bodies["sinker"]
        early = BodyTrack(**{one: getattr(sinker, one)[half] for one in ("time", "pose", "twist", "wrench", "tension")})
        run = Readings(run=known().run, bodies={"sinker": early}, series={}, particles=known().particles, time=0.5)
        assert_terminal_speed(run, "sinker", -0.27, along="z", within=0.01)


def test_error_that_no_spacing_mends_says_so() -> None:
    with pytest.raises(CheckFailed, match="no affordable spacing would meet this tolerance: look for another cause"):
        assert_draft(known(), "heaver", 1.0, within=1e-3, level=LEVEL)


@pytest.mark.parametrize(
    ("check", "message"),
    [
        (lambda r: assert_trim(r, "boat", 0.1, within=0.1), "has no body 'boat', allowed: raft, heaver"),
        (lambda r: assert_draft(r, "raft", 0.1, within=0.1), r"has no tank, whose level .* allowed: to state level"),
        (lambda r: assert_draft(r, "raft", 0.1, within=-0.1, level=0.5), r"tolerance is -0\.1 m, allowed: 0 or more"),
        (lambda r: assert_tension(r, "mooring", 1.0, within=1.0), "no tension of 'mooring', allowed: tow, raft"),
        (lambda r: assert_force(r, "raft", 1.0, along="z", within=1.0, since=9.0), r"since is 9\.0 s, allowed: up to 4 s"),
        (lambda r: assert_added_mass(r, "sinker", 1.0, along="x", within=1.0), "acceleration along x is 0 m/s2"),
        (lambda r: assert_wave_height(r, "open", 1.0, period=9.0, within=1.0), "4 s were seen .* allowed: a period, 9 s"),
        (lambda r: assert_oil_contained(r, 1.0, within=1.0), "both or neither, allowed: one of them"),
    ],
)  # fmt: skip
def test_checks_of_what_is_not_there_are_refused(check: Callable[[Readings], None], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        check(known())

"""Every control by every way in gives the same run: at the start, by an order, by an inject, by a signal, by a page of the console."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

from recordings.files.checkpoint import state_hash
from scenarios.conduct.commands import Command, settings_of
from scenarios.controls.table import CONTROLS, KEYS, Control, driven_entries, matches
from scenarios.running.assembly import build
from scenarios.running.exercise_fmu import ExerciseParticipant
from scenarios.running.plan import Plan
from scenarios.running.run_loop import RunLoop
from scenarios.running.run_requests import RunRequests
from scenarios.schema.parsing.overrides import parse_override, with_override
from scenarios.spec.load import library_paths, scenario_from
from tests.scenarios.small_tow import small_tow

STEP, POINT, END = 0.1, 1, 4  # [s], communication points of the order and of the end
SEA = """
[sea.current]
speed = 0.2
direction = 0.0

[sea.wind]
speed = 6.0
gust_intensity = 0.1

[sea.waves]
kind = "regular"
height = 0.2
period = 3.0
"""
TOW = small_tow(duration=9.0, communication_step=STEP, frame_rate=5) + "line_stiffness = 2000.0" + SEA
ALONE = (
    """
name = "alone"
run = {duration = 9.0, communication_step = 0.1, threads = 1}
fluid = {particle_spacing = 0.25}
phases.water = {density = 1025.0, dynamic_viscosity = 1.0e-3}
phases.oil = {oil = "alaska-north-slope"}
sea.depth = 10.0

[vessels.legged]
length = 6.0
beam = 2.0
draft = 0.6
depth = 1.2
position = [0.0, 20.0]
bollard_pull = 4e3
yaw_moment = 2e4
legs = [{ speed = 0.4, heading = 0.1, through = [0.0, 20.0] }]

[vessels.pushed]
length = 6.0
beam = 2.0
draft = 0.6
depth = 1.2
position = [0.0, -20.0]
bollard_pull = 4e3
side_thrust = 1e3
yaw_moment = 2e4
control = "manual"

[moorings.stern]
vessel = "pushed"
at = "stern"
anchor = [-30.0, -20.0]
kind = "weight"
mass = 300.0
parts = [{ material = "chain", length = 10.0, diameter = 0.013 }, { material = "polyester", length = 20.0, diameter = 0.02 }]

[emitters.leak]
phase = "oil"
mouth = [-20.0, 0.0, -1.0]
radius = 0.1
speed = 0.5

[fill.slick]
shape = "block"
phase = "oil"
lower = [-40.0, 10.0, -0.01]
upper = [-30.0, 14.0, 0.0]

[skimmers.brush]
kind = "brush"
nameplate = 100.0
swath = 3.0
storage = 5.0
throughput_efficiency = 0.7
recovery_efficiency = 0.8
place = [-35.0, 12.0]
"""
    + SEA
)
IRREGULAR = ALONE.replace('"regular"\nheight = 0.2\nperiod', '"jonswap"\nsignificant_height = 0.2\npeak_period')
SLIP = library_paths()["launch-from-slip"].read_text(encoding="utf-8")
REEL = (
    library_paths()["deploy-from-reel"]
    .read_text(encoding="utf-8")
    .replace("\nwinch_speed = 0.4\n", "\npaid_out = 40.0\n")
)


@dataclass(frozen=True)
class Trial:
    """A setting of a control. starts: whether a run that begins with it is that in which it is ordered at once."""

    setting: str
    text: str = TOW
    starts: bool = False
    verb: dict[str, Any] | None = None


TRIALS = (
    Trial("tow.speed=0.6", verb={"do": "tow", "speed": 0.6, "heading": 0.0}),
    Trial("tow.heading=0.2", verb={"do": "tow", "speed": 0.3, "heading": 0.2}),
    Trial(
        "vessels.legged.legs=[{speed=0.7,heading=0.2}]",
        ALONE,
        verb={"do": "steer", "vessel": "legged", "speed": 0.7, "heading": 0.2, "keeps_line": False},
    ),
    Trial(
        "vessels.legged.legs=[{speed=0.0,heading=0.0,by_hand=[0.5,0.1]}]",
        ALONE,
        verb={"do": "levers", "vessel": "legged", "thrust": 0.5, "steering": 0.1},
    ),
    Trial("vessels.legged.legs.0.speed=0.8", ALONE),
    Trial("vessels.legged.legs.0.heading=0.4", ALONE),
    Trial("vessels.pushed.thrust_order=500.0", ALONE, starts=True),
    Trial("vessels.pushed.side_thrust_order=300.0", ALONE, starts=True),
    Trial("vessels.pushed.yaw_moment_order=900.0", ALONE, starts=True),
    Trial("vessels.port.engine=stopped", starts=True, verb={"do": "engine", "vessel": "port", "runs": False}),
    Trial("vessels.port.hauled=0.25", starts=True, verb={"do": "line", "vessel": "port", "length": 1.75}),
    Trial("booms.main.parted=[4]"),
    Trial("booms.main.tow_line=2.25"),
    Trial("booms.main.reel.paid_out=5.0", REEL, starts=True),
    Trial("moorings.stern.parted=true", ALONE, starts=True),
    Trial("moorings.stern.hauled=0.25", ALONE, starts=True),
    Trial("moorings.stern.holding=1.0", ALONE),
    Trial("ties.brake.hauled=-0.25", SLIP, starts=True),
    Trial("ties.brake.parted=true", SLIP),
    Trial("skimmers.brush.running=false", ALONE, starts=True),
    Trial("skimmers.brush.place=[-35.5, 12.0]", ALONE),
    Trial("skimmers.brush.nameplate=10.0", ALONE, starts=True),
    Trial("skimmers.brush.storage=0.001", ALONE, starts=True),
    Trial("skimmers.brush.throughput_efficiency=0.2", ALONE, starts=True),
    Trial("skimmers.brush.recovery_efficiency=0.3", ALONE, starts=True),
    Trial("sea.current.speed=0.5", ALONE),
    Trial("sea.current.direction=1.0", ALONE),
    Trial("sea.wind.speed=12.0", ALONE),
    Trial("sea.wind.direction=1.5", ALONE),
    Trial("sea.wind.gust_intensity=0.3", ALONE),
    Trial("sea.waves.height=0.4", ALONE),
    Trial("sea.waves.period=2.5", ALONE),
    Trial("sea.waves.significant_height=0.4", IRREGULAR),
    Trial("sea.waves.peak_period=2.5", IRREGULAR),
    Trial("emitters.leak.speed=0.25", ALONE, starts=True),
)
# A tie is made fast within its reach (test_ties), an inject is a way in itself, a time acts beside another order (test_sea_change),
# and visibility is for people alone (test_feed).
ELSEWHERE = {"ties.*.made_fast", "injects.*.given", "sea.within", "sea.visibility"}


def looped(plan: Plan, setting: str | None = None, at: int = 0) -> str:
    """Return the hash of the state at the end of a run of a plan, with an order at a point."""
    assembly = build(plan.scenario)
    simulation = assembly.co_simulation()
    loop = RunLoop(plan, assembly, simulation, requests=RunRequests(), keepers={}, checkpoints=None)
    loop.begin()
    for point in range(END):
        if setting is not None and point == at:
            loop.order([setting])
        loop.step()
    told = state_hash(simulation.save_state())
    simulation.terminate()
    return told


def ordered(trial: Trial, at: int = POINT) -> str:
    return looped(Plan(scenario=scenario_from(tomllib.loads(trial.text))), trial.setting, at)


@cache
def untouched(text: str) -> str:
    return looped(Plan(scenario=scenario_from(tomllib.loads(text))))


def injected(trial: Trial) -> str:
    data = tomllib.loads(trial.text)
    inject = {"one": {"at": POINT * data["run"]["communication_step"], "orders": [trial.setting]}}
    return looped(Plan(scenario=scenario_from(data | {"injects": inject})))


def signaled(trial: Trial) -> str:
    """The same by the master of an exported exercise."""
    keys, value = parse_override(trial.setting)
    scenario = scenario_from(tomllib.loads(trial.text))
    exercise, step = ExerciseParticipant("exercise", scenario), scenario.run.communication_step
    exercise.enter_initialization_mode(0.0)
    exercise.exit_initialization_mode()
    for point in range(END):
        if point >= POINT:  # a master sets its outputs at every step
            exercise.set(".".join(keys), np.array([value]))
        exercise.do_step(point * step, step)
    told = state_hash(exercise.save_state()["simulation"])
    exercise.terminate()
    return told


@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.setting.partition("=")[0])
def test_every_way_in_gives_the_same_run(trial: Trial) -> None:
    key = trial.setting.partition("=")[0]
    scenario = scenario_from(tomllib.loads(trial.text))
    expected = ordered(trial)
    assert expected != untouched(trial.text)  # something feels it
    assert injected(trial) == expected
    driven = {path for path, _, _ in driven_entries(scenario.parts)}
    assert (key in driven) == _control(key).driven
    if key in driven:
        assert signaled(trial) == expected
    if trial.starts:
        keys, value = parse_override(trial.setting)
        begun = scenario_from(with_override(tomllib.loads(trial.text), keys, value))
        assert looped(Plan(scenario=begun)) == ordered(trial, 0)
    if trial.verb is not None:
        present = {name: {"x": 0.0, "y": 20.0, "heading": 0.0, "line": {"laid": 2.0}} for name in scenario.vessels}
        entries = {name: entry for name, entry in trial.verb.items() if name != "do"}
        settings = settings_of(Command(1, trial.verb["do"], entries), present)
        plan = Plan(scenario=scenario)
        assert looped(plan.ordered(settings, POINT)) == expected


def _control(key: str) -> Control:
    """Return the control of a key."""
    parts = key.split(".")
    (found,) = (one for one in CONTROLS if one.key.count(".") == len(parts) - 1 and matches(key, [one.key]))
    return found


def test_every_control_is_tried() -> None:
    tried = {_control(trial.setting.partition("=")[0]).key for trial in TRIALS}
    assert tried | ELSEWHERE == set(KEYS)

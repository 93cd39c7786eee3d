"""Injects: orders that a scenario gives itself, at a time, on a condition, by seed; made again and gone on with bit for bit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from recordings.replay.recording import Replay
from scenarios.running.checkpoints import find_restart
from scenarios.running.plan import Plan
from scenarios.running.run import RunOptions, resume, run_scenario
from scenarios.running.verify import verify
from scenarios.schema.injects import InjectSettings
from scenarios.schema.sea import SteadySeaCurrent, SteadySeaWind
from scenarios.spec.load import load_scenario, scenario_from
from scenarios.text.problems import ScenarioError
from scenarios.text.toml import read_toml
from tests.scenarios.small_tow import small_tow

STEP = 0.05
INJECTS = """
[injects.quits]
at = 0.2
orders = ["vessels.port.engine=stopped"]
text = "The outboard of the port vessel quits"

[injects.turns]
when = {signal = "vessels.starboard.x", above = 0.001}
delay = 0.1
orders = ["tow.speed_kn=0.1", "sea.current={kind='steady', speed=0.2, direction_deg=90}"]

[injects.parts]
orders = ["booms.main.parted=[4]"]

[levels.hard]
tow.speed_kn = 2.0
injects.quits.at = 0.1
"""
QUIET = Console(quiet=True)


def scenario(duration: float, more: str = INJECTS):
    return scenario_from(read_toml(small_tow(duration=duration, communication_step=STEP, frame_rate=20) + more))


def run(path: Path, duration: float) -> dict:
    options = RunOptions(record=path, summary=path.with_suffix(".json"))
    assert run_scenario(scenario(duration), options=options, console=QUIET) == 0
    return json.loads(path.with_suffix(".json").read_text())


def told(path: Path) -> list[tuple[float, str, str]]:
    sources = ("injects", "instructor")
    return [
        (round(event.time, 6), event.source, event.text)
        for event in Replay(path).events
        if event.source in sources or event.source.startswith("inject ")
    ]


def test_injects_come_at_their_time_and_on_their_condition_and_are_made_again(tmp_path: Path) -> None:
    whole, first, second = (tmp_path / f"{name}.rrd" for name in ("whole", "first", "second"))
    summary = run(whole, 1.0)
    events = told(whole)
    assert events[:2] == [
        (0.2, "injects", "orders vessels.port.engine=stopped injects.quits.given=true"),
        (0.2, "inject quits", "The outboard of the port vessel quits"),
    ]
    assert events[2][1] == "injects" and events[2][2].startswith("orders tow.speed_kn=0.1 'sea.current=")
    assert 0.2 < events[2][0] < 1.0  # the condition, and its delay
    assert [source for _, source, _ in events[3:]] == ["inject turns"]  # the third waits for the instructor
    verdict = verify(whole, console=QUIET)
    assert (verdict.difference, verdict.equal_frames) == ("", 21)
    run(first, 0.15)
    restart = find_restart(first).with_settings(("run.duration=1.0",), None)
    assert resume(restart, options=RunOptions(record=second, summary=tmp_path / "second.json"), console=QUIET) == 0
    again = json.loads((tmp_path / "second.json").read_text())
    assert again["state_hash"] == summary["state_hash"] is not None
    assert told(second) == events
    assert verify(second, console=QUIET).difference == ""
    later = find_restart(first).with_settings(("injects.parts.given=true", "run.duration=0.3"), 0.15)
    assert resume(later, options=RunOptions(record=tmp_path / "third.rrd"), console=QUIET) == 0
    assert "orders 'booms.main.parted=[4]' injects.parts.given=true" in [
        text for _, _, text in told(tmp_path / "third.rrd")
    ]
    assert verify(tmp_path / "third.rrd", console=QUIET).difference == ""


def test_two_injects_part_two_joints_whatever_was_ordered_before(tmp_path: Path) -> None:
    """Joint 2 parts by order, then 4 and 6 by injects: at times of their own, and both at once."""
    parts = '[injects.{0}]\nat = {1}\norders = ["booms.main.parted=[{0}]"]\n'
    begin = Plan(scenario=scenario(1.0, parts.format(4, 0.2) + parts.format(6, 0.4)))
    plan = begin.ordered(["booms.main.parted=[2]"], 1)
    plan = plan.ordered(["injects.4.given=true"], 4).ordered(["injects.6.given=true"], 8)
    assert [plan.scenario_at(index).booms["main"].parted for index in (1, 4, 8)] == [(2,), (2, 4), (2, 4, 6)]
    both = begin.ordered(["booms.main.parted=[2]", "injects.4.given=true", "injects.6.given=true"], 4)
    assert both.scenario_at(4).booms["main"].parted == (2, 4, 6)
    for wrong, reason in (
        ("[5, 5]", "each once"),
        ("[8]", "numbers from 1 to 7"),
        ("[]", "one that has parted stays so"),
    ):
        with pytest.raises(ScenarioError, match=reason):
            plan.ordered([f"booms.main.parted={wrong}"], 9)
    record = tmp_path / "whole.rrd"
    assert run_scenario(plan.scenario, options=RunOptions(record=record), console=QUIET) == 0
    assert [text for _, source, text in told(record) if source == "injects"] == [
        "orders 'booms.main.parted=[4]' injects.4.given=true",
        "orders 'booms.main.parted=[6]' injects.6.given=true",
    ]


WEATHER = """
[sea.current]
kind = "steady"
speed = 0.3
direction = 1.0
[sea.waves]
kind = "regular"
height = 0.3
period = 3.0
direction = 2.0
[sea.wind]
kind = "steady"
speed = 8.0
direction = 2.0
gust_intensity = 0.1
[injects.first]
at = 0.2
orders = ["tow.heading_deg=20", "sea.current.speed=0.5", "sea.wind.speed=12"]
[injects.second]
at = 0.7
orders = ["tow.speed=0.4", "sea.current.direction=0.5", "sea.wind.direction=2.5"]
"""


def test_run_goes_on_exactly_where_tow_current_and_wind_have_turned(tmp_path: Path) -> None:
    """From a checkpoint between two orders to all of them; what the sea has taken over at the first belongs into the state."""
    records = [tmp_path / f"{name}.rrd" for name in ("whole", "first", "second")]
    options = [RunOptions(record=record, summary=record.with_suffix(".json")) for record in records]
    assert run_scenario(scenario(1.0, WEATHER), options=options[0], console=QUIET) == 0
    assert run_scenario(scenario(0.5, WEATHER), options=options[1], console=QUIET) == 0
    restart = find_restart(records[1]).with_settings(("run.duration=1.0",), None)
    assert resume(restart, options=options[2], console=QUIET) == 0
    summaries = [json.loads(record.with_suffix(".json").read_text()) for record in records]
    assert summaries[2]["state_hash"] == summaries[0]["state_hash"] is not None
    for record in (records[0], records[2]):
        assert verify(record, console=QUIET).difference == ""


def test_injects_take_compass_courses() -> None:
    """A wind from the south-west blows to 45 degrees from +x, and north-west is 135; with the x axis due north instead of east, 90 less."""
    orders = """
[injects.veers]
at = 0.1
orders = ["sea.wind={kind='steady', speed=3, from_compass=225}", "tow.heading_compass=315",
          "sea.current={kind='steady', speed=0.1, toward_compass=90}"]
"""
    for site, turn in (("", 0.0), ("[site]\nlatitude = 54\nlongitude = 8\nbearing_deg = 0\n", -90.0)):
        plan = Plan(scenario=scenario(0.3, orders + site)).ordered(["injects.veers.given=true"], 0)
        ordered = plan.scenario_at(0)
        assert ordered.sea is not None and ordered.tow is not None
        assert isinstance(ordered.sea.wind, SteadySeaWind) and isinstance(ordered.sea.current, SteadySeaCurrent)
        found = [ordered.sea.wind.direction, ordered.tow.heading, ordered.sea.current.direction]
        assert np.rad2deg(found) == pytest.approx([45.0 + turn, 135.0 + turn, turn])


def test_a_table_that_cannot_be_read_is_not_blamed_on_injects() -> None:
    data = read_toml(small_tow(duration=1.0, communication_step=STEP, frame_rate=20) + INJECTS)
    with pytest.raises(ScenarioError) as found:
        scenario_from(data | {"sea": data["sea"] | {"depth": -1.0}})
    (problem,) = found.value.problems
    assert problem.path == "sea.depth"


def test_seed_draws_the_time_and_whether_it_comes() -> None:
    inject = InjectSettings(at=100.0, spread=30.0, chance=0.5, orders=("tow.speed=1",))
    drawn = [inject.drawn("gust", seed) for seed in range(400)]
    assert drawn == [inject.drawn("gust", seed) for seed in range(400)]
    assert drawn != [inject.drawn("other", seed) for seed in range(400)]
    assert sum(comes for comes, _ in drawn) == pytest.approx(200, abs=40)  # 4 standard deviations
    shifts = [shift for _, shift in drawn]
    assert -30.0 <= min(shifts) < -25.0 and 25.0 < max(shifts) <= 30.0
    assert {inject.time_at("gust", seed) == float("inf") for seed in range(50)} == {True, False}


def test_levels_change_the_scenario(tmp_path: Path) -> None:
    file = tmp_path / "tow.toml"
    file.write_text(small_tow(duration=1.0, communication_step=STEP, frame_rate=20) + INJECTS)
    normal, hard = load_scenario(file).scenario, load_scenario(file, overrides=["level=hard"]).scenario
    assert normal.tow is not None and hard.tow is not None
    assert (normal.injects["quits"].at, hard.injects["quits"].at) == (0.2, 0.1)
    assert hard.tow.speed > 3.0 * normal.tow.speed
    for quoted in ('level="hard"', "level = 'hard'"):
        assert load_scenario(file, overrides=[quoted]).scenario == hard
    with pytest.raises(ScenarioError, match="level is 'easy', allowed in this scenario: normal, hard"):
        load_scenario(file, overrides=["level=easy"])
    file.write_text(file.read_text().replace("tow.speed_kn = 2.0", "tow.speed_kn = 2000.0"))
    with pytest.raises(ScenarioError, match=r"levels\.hard\.tow\.speed_kn"):
        load_scenario(file)


def test_all_that_is_wrong_with_injects_is_named_at_once() -> None:
    wrong = """
[injects.a]
at = -1.0
orders = ["tow.speed=1"]
[injects.b]
at = 1.0
when = {signal = "vessels.port.x", above = 1.0}
orders = ["tow.speed=1"]
[injects.c]
when = {signal = "vessels.port.speeed", above = 1.0}
orders = ["vessels.port.engine=off", "vessels.prot.engine=stopped", "fluid.particle_spacing=1", "nonsense"]
[injects.d]
orders = []
[injects.e]
at = 3.0
orders = ["sea.wind.speed=4", "sea.wind={kind='steady', speed=900, direction=0}", "booms.main.parted=[40]"]
[injects.f]
when = {signal = "vessels.port.x", above = 1.0, below = 0.0}
orders = ["emitters.leak.speed=1"]
"""
    with pytest.raises(ScenarioError) as found:
        scenario(1.0, wrong)
    problems = [str(problem) for problem in found.value.problems]
    for text in (
        "injects.a.at is -1.0",
        "injects.b.when is given beside at",
        "injects.c.when.signal is 'vessels.port.speeed', which is no signal of the run, did you mean 'vessels.port.speed'?",
        "injects.c.orders has vessels.port.engine, which is 'off'",
        "injects.c.orders has vessels.prot.engine, which names 'prot', which is no entry of vessels, did you mean 'port'?",
        "injects.c.orders has fluid.particle_spacing, which cannot be changed during a run, allowed: tow.speed",
        "injects.c.orders has 'nonsense', allowed: key=value",
        "injects.d.orders is empty",
        "injects.e.orders has sea.wind.speed, which is 900",
        "injects.e.orders has booms.main.parted, which is [40], allowed: numbers from 1 to 7",
        "injects.f.when.below is given beside above",
    ):
        assert any(problem.startswith(text) for problem in problems), (text, problems)

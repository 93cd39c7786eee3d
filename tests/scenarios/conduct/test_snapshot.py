"""What the console's page is told of a run: outlines of fixed bodies, tow lines as laid, as ordered and as they are, joints that parted."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.conduct.snapshot import scene_of, state_of
from scenarios.running.plan import Plan
from scenarios.schema.exercise import joint_name
from scenarios.spec.load import load_scenario, scenario_from
from tests.scenarios.small_tow import small_tow

MORE = """line_stiffness = 2000.0
winch_speed = 0.5

[bodies.pier]
shape = "box"
size = [3.0, 2.0, 12.0]
position = [40.0, 20.0, -4.0]
rotation_deg = [0.0, 0.0, 90.0]
motion = { kind = "fixed" }
"""


@pytest.fixture
def run(scenario_run: type[ScenarioRun]) -> ScenarioRun:
    text = small_tow(duration=9.0, communication_step=0.1, frame_rate=5) + MORE
    return scenario_run(scenario_from(tomllib.loads(text)))


def test_fixed_bodies_have_their_outline_in_plan(run: ScenarioRun) -> None:
    outlines = scene_of(run.assembly)["bodies"]
    assert list(outlines) == ["pier"]
    corners = np.array(outlines["pier"])
    assert sorted(map(tuple, corners)) == [(39.0, 18.5), (39.0, 21.5), (41.0, 18.5), (41.0, 21.5)]


def test_a_tow_line_is_told_as_laid_as_ordered_and_as_it_is(run: ScenarioRun) -> None:
    plan = Plan(scenario=run.scenario)
    ordered = plan.ordered(["booms.main.tow_line=3.0", "vessels.port.hauled=0.25"], 0).scenario_at(0)
    run.assembly.controls.order(ordered)
    run.simulation.run(0.1)
    vessels = state_of(run.assembly, ordered, run.history.frames[-1])["vessels"]
    # the winch pays out 0.5 m/s towards 3 m; the port one hauls a quarter of a metre of that in again
    assert vessels["port"]["line"] == pytest.approx({"laid": 3.0, "ordered": 2.75, "now": 2.05})
    assert vessels["starboard"]["line"] == pytest.approx({"laid": 3.0, "ordered": 3.0, "now": 2.05})


def test_joints_that_broke_by_their_load_are_told_beside_those_that_were_ordered_to_part(
    scenario_run: type[ScenarioRun],
) -> None:
    changes = ["fidelity='none'", "run.communication_step=0.02", "sea.current.speed=1.0"]
    weak = ["booms.main.strength=1e6", "booms.main.section_length=3.0", "booms.main.connector_strength=10.0"]
    run = scenario_run(load_scenario("u-sweep", overrides=[*changes, *weak]).scenario)
    ordered = Plan(scenario=run.scenario).ordered(["booms.main.parted=[2]"], 0).scenario_at(0)
    run.assembly.controls.order(ordered)
    run.run(0.5)
    holding = run.assembly.world.joint_names
    parted = state_of(run.assembly, ordered, run.history.frames[-1])["booms"]["main"]["parted"]
    assert {2, 10} <= set(parted)
    assert parted == [number for number in range(1, 20) if joint_name("main", number) not in holding]


def test_skimmers_anchors_and_cross_bridles_are_where_they_are(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(load_scenario("anchored-containment").scenario)
    run.run(0.4)
    state = state_of(run.assembly, run.scenario, run.history.frames[-1])
    line, weir = np.array(state["booms"]["main"]["line"]), state["skimmers"]["weir"]
    top, anchor = state["lines"]["moorings/north"]["ends"]
    assert anchor == pytest.approx([72.0, 29.4], abs=0.05)
    assert np.linalg.norm(line[0] - top) < 0.5
    middle = 0.5 * (line[19] + line[20])
    assert np.linalg.norm(middle - [weir["x"], weir["y"]]) == pytest.approx(2.0, abs=0.2)  # ahead of segment 19
    assert weir["nameplate"] == pytest.approx(run.scenario.skimmers["weir"].nameplate / 3600.0)
    assert (weir["stands"], weir["oil"]) == ("", 0.0)
    ordered = Plan(scenario=run.scenario).ordered(["skimmers.weir.running=false"], 0).scenario_at(0)
    run.assembly.controls.order(ordered)
    assert state_of(run.assembly, ordered, run.history.frames[-1])["skimmers"]["weir"]["stands"] == "stopped"


def test_a_cross_bridle_that_is_cast_off_holds_no_more(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(load_scenario("v-sweep").scenario)
    ordered = Plan(scenario=run.scenario).ordered(["ties.aft.parted=true"], 0).scenario_at(0)
    run.assembly.controls.order(ordered)
    run.run(0.4)
    lines = state_of(run.assembly, ordered, run.history.frames[-1])["lines"]
    assert [lines[f"ties/{name}"]["holds"] for name in ("fore", "middle", "aft")] == [True, True, False]
    ends = np.array(lines["ties/fore"]["ends"])
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(run.scenario.ties["fore"].length, rel=0.05)


def test_the_beach_is_land_from_its_waterline_on(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(load_scenario("shore-seal").scenario)
    land, shore = np.array(scene_of(run.assembly)["land"][0]["outline"]), run.scenario.shore
    inland = -(land - shore.waterline) @ [np.cos(shore.seaward), np.sin(shore.seaward)]
    assert inland.min() > -2.0
    assert np.ptp(land, axis=0).max() == pytest.approx(shore.width, rel=0.05)

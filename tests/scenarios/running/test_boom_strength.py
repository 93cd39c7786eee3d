"""Booms of the catalogue, and booms that part where the tension passes what they or their connectors bear."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from booms.boom import catalogue
from coupling.testkit import assert_restarts_exactly
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.running.assembly import build
from scenarios.schema.exercise import BoomSettings, joint_name
from scenarios.schema.parsing.structuring import as_data, structure
from scenarios.spec.load import load_scenario, scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError

ENDS = ((0.0, 0.0), (20.0, 0.0))
PULLED = ("fidelity='none'", "run.communication_step=0.02", "sea.current.speed=1.0")


def pulled(*changes: str) -> Scenario:
    """`u-sweep` without particles, its boom across 1 m/s."""
    return load_scenario("u-sweep", overrides=[*PULLED, *changes]).scenario


def test_a_boom_takes_what_it_does_not_state_from_the_catalogue() -> None:
    entry = catalogue()["nafac-2"]
    boom = BoomSettings(ends=ENDS, boom="nafac-2", length=30.0, freeboard=0.25)
    assert (boom.skirt_depth, boom.freeboard) == (entry.skirt_depth, 0.25)
    assert (boom.strength, boom.section_length) == (entry.strength, entry.section_length)
    assert BoomSettings(ends=ENDS, length=30.0, skirt_depth=0.3, freeboard=0.2).buoyancy_to_weight == 5.0


def test_connectors_are_the_joints_nearest_to_the_ends_of_sections() -> None:
    boom = BoomSettings(ends=ENDS, boom="cfr-inland", length=100.0, segments=50, connector_strength=1e4)
    assert boom.section_length == 30.5
    assert boom.connectors == (15, 30, 46)  # at 30, 60 and 92 m
    assert boom.strength_of(15) == 1e4
    assert boom.strength_of(16) == catalogue()["cfr-inland"].strength


@pytest.mark.parametrize(
    ("table", "paths"),
    [
        ({}, {"skirt_depth", "freeboard"}),
        ({"boom": "nafac-9"}, {"boom"}),
        ({"boom": "nafac-1", "pocket": {"length": 5.0, "volume": -1.0}}, {"pocket.speed_ratio", "pocket.volume"}),
        ({"boom": "nafac-1", "strength": -1.0}, {"strength"}),
        ({"skirt_depth": "deep", "freeboard": 0.2}, {"skirt_depth"}),
    ],
)
def test_all_that_is_wrong_with_a_boom_is_named(table: dict[str, object], paths: set[str]) -> None:
    with pytest.raises(ScenarioError) as found:
        structure({"ends": [[0.0, 0.0], [20.0, 0.0]], "length": 30.0} | table, BoomSettings)
    assert {problem.path for problem in found.value.problems} == paths


def test_a_boom_that_bears_its_load_stays_whole_and_tells_its_share(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(pulled("booms.main.strength=1e6"))
    run.run(0.4)
    world = run.assembly.world
    assert len([name for name in world.joint_names if "/joint-" in name]) == 19
    largest = max(world.tension(joint_name("main", number)) for number in range(1, 20))
    assert largest / 1e6 <= run.assembly.strength.peak_share["main"] < 0.01


def test_an_overloaded_connector_fails_and_the_run_goes_on_the_same_after_a_restart() -> None:
    weak = pulled("booms.main.strength=1e6", "booms.main.section_length=3.0", "booms.main.connector_strength=20.0")
    made = []

    def build() -> ScenarioRun:
        made.append(ScenarioRun(weak))
        return made[-1]

    assert_restarts_exactly(build, at=20, steps=5)
    for run in made:
        assert run.assembly.world.tension(joint_name("main", 10)) == 0.0
        assert joint_name("main", 10) not in run.assembly.world.joint_names
        assert np.flatnonzero(run.assembly.slicks[0].slick.barriers.parted).tolist() == [9]
    told = [event.text for event in made[0].history.events if "has parted at joint 10" in event.text]
    assert len(told) == 1
    assert "its connector has failed" in told[0]
    assert "more than 0.02 kN" in told[0]


def test_oil_passes_where_a_scenario_or_an_order_lets_a_boom_part() -> None:
    assembly = build(pulled("booms.main.parted=[4]"))
    simulation = assembly.co_simulation()
    simulation.initialize()
    simulation.run(0.2)
    assembly.controls.order(pulled("booms.main.parted=[4, 6]"))
    simulation.run(0.4)
    barriers = assembly.slicks[0].slick.barriers
    assert np.flatnonzero(barriers.parted).tolist() == [3, 5]
    opened = np.linalg.norm(barriers.start[1:] - barriers.end[:-1], axis=1)
    assert np.flatnonzero(opened).tolist() == [3, 5]
    layout, world = assembly.fleet.booms["main"], assembly.world
    pose = world.pose(layout.segments[3].name)
    end = Rotation.from_quat(pose[3:]).apply(layout.segment.joint_points[1]) + pose[:3]
    assert np.allclose(barriers.end[3], end[:2], atol=1e-9)


def test_a_scenario_may_name_its_boom() -> None:
    scenario = load_scenario("sweep-200m").scenario
    data = as_data(scenario)
    for key in ("skirt_depth", "freeboard", "buoyancy_to_weight", "ballast_fraction"):
        data["booms"]["main"].pop(key)
    named = scenario_from(data | {"booms": {"main": data["booms"]["main"] | {"boom": "cfr-ocean"}}})
    assert named.booms["main"].strength == 89000.0

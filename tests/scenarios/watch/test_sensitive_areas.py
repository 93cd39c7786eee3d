"""Sensitive areas: the oil in each, told once when it comes, and where pages and recordings find it."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.conduct.snapshot import scene_of
from scenarios.running.assembly import build
from scenarios.spec.load import load_scenario
from scenarios.text.problems import ScenarioError
from tests.scenarios.setup.test_land import HARBOUR

AREAS = """
[areas.all]
outline = [[-60.0, -60.0], [60.0, -60.0], [60.0, 60.0], [-60.0, 60.0]]
[areas.half]
outline = [[-9.0, -20.0], [-30.0, -20.0], [-30.0, 20.0], [-9.0, 20.0]]
[areas.ahead]
outline = [[-3.0, -20.0], [-1.0, -20.0], [-1.0, 20.0], [-3.0, 20.0]]
[areas.behind]
outline = [[-50.0, -20.0], [-40.0, -20.0], [-40.0, 20.0], [-50.0, 20.0]]
"""


def test_oil_is_counted_where_it_lies_and_told_once(scenario_run: type[ScenarioRun], tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(HARBOUR + AREAS)
    run = scenario_run(load_scenario(tmp_path / "own.toml").scenario)
    scoring = run.assembly.scoring
    run.run(0.1)
    spilled = run.assembly.slicks[0].slick.oil.spilled
    assert scoring.oil_in_areas["all"] == pytest.approx(spilled)
    assert scoring.oil_in_areas["half"] == pytest.approx(0.5 * spilled, rel=0.15)  # to a row of parcels
    assert scoring.oil_in_areas["ahead"] == scoring.oil_in_areas["behind"] == 0.0
    run.run(5.0)  # 0.8 m/s with the wind's drift: 4 m
    assert 0.0 < scoring.oil_in_areas["ahead"] < scoring.oil_in_areas["all"] == pytest.approx(spilled)
    assert (
        run.assembly.frame_source(run.simulation.communication_point).scalars["metrics/areas/ahead/oil"]
        == scoring.oil_in_areas["ahead"]
    )
    told = run.history.events
    assert [one.source for one in told if one.source.startswith("area ")] == ["area all", "area half", "area ahead"]
    assert all(one.level == "warning" for one in told if one.source.startswith("area "))


def test_the_intake_of_the_river_is_on_plan_and_in_the_recording() -> None:
    assembly = build(load_scenario("river-diversion-cascade").scenario)
    assert list(assembly.description.exercise.areas) == list(scene_of(assembly)["areas"]) == ["intake"]
    assert len(scene_of(assembly)["areas"]["intake"][0]) == 4


@pytest.mark.parametrize(
    ("area", "told"),
    [
        ("outline = [[0, 0], [1, 1]]", "areas.own.outline has 2 corners, allowed: 3 or more"),
        ('file = "own.geojson"', "areas.own.file is given, allowed with [site]"),
        ("", "areas.own.outline and file are both given, or both missing"),
        ("outline = [[0, 0], [1, 1], [2, 2]]", "areas.own.outline encloses 0 m2"),
    ],
)
def test_an_area_that_is_none_is_refused_by_its_key(area: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(f"{HARBOUR}[areas.own]\n{area}\n")
    with pytest.raises(ScenarioError) as caught:
        build(load_scenario(tmp_path / "own.toml").scenario)
    assert told in str(caught.value)

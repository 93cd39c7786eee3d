"""Winches that orders set to work while a run goes on, and tow lines that break."""

from __future__ import annotations

import tomllib

import pytest

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.running.plan import Plan
from scenarios.spec.load import scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError
from tests.scenarios.small_tow import small_tow

ELASTIC = "line_stiffness = 2000.0\nwinch_speed = 0.5\n"
LEG = """
[moorings.stern]
vessel = "port"
at = "stern"
anchor = [-30.0, 6.0]
kind = "fixed"
parts = [{ material = "chain", length = 10.0, diameter = 0.013 }, { material = "polyester", length = 24.0, diameter = 0.02 }]
"""


def tow_with(more: str) -> Scenario:
    return scenario_from(tomllib.loads(small_tow(duration=9.0, communication_step=0.1, frame_rate=5) + more))


def test_tow_lines_and_mooring_legs_are_winched_at_their_speed(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(tow_with(ELASTIC + LEG))
    plan, assembly, simulation = Plan(scenario=run.scenario), run.assembly, run.simulation
    lines = assembly.world.lines
    tow, leg = assembly.fleet.tensions_of("main")["port"], "moorings/stern"
    laid = lines.length(tow), lines.length(leg)
    plan = plan.ordered(["booms.main.tow_line=3.0", "moorings.stern.hauled=-0.1"], 0)
    assembly.controls.order(plan.scenario_at(0))
    simulation.step()
    assert lines.length(tow) - laid[0] == pytest.approx(0.05)
    assert lines.length(leg) - laid[1] == pytest.approx(0.02)
    simulation.run(3.0)
    assert lines.length(tow) - laid[0] == pytest.approx(1.0)
    assert lines.length(leg) - laid[1] == pytest.approx(0.1)
    assembly.controls.order(plan.ordered(["booms.main.tow_line=2.0"], 30).scenario_at(30))
    simulation.run(6.0)
    assert lines.length(tow) == pytest.approx(laid[0])


def test_what_no_winch_can_do_is_refused() -> None:
    rigid = Plan(scenario=tow_with(""))
    with pytest.raises(ScenarioError, match="the tow lines are rigid links; allowed: in runs with line_stiffness"):
        rigid.ordered(["booms.main.tow_line=3.0"], 0)
    moored = Plan(scenario=tow_with(ELASTIC + LEG))
    with pytest.raises(ScenarioError, match="hauled is 30, allowed: below 24 m, the length of the uppermost part"):
        moored.ordered(["moorings.stern.hauled=30.0"], 0)
    with pytest.raises(ScenarioError, match=r"line_breaking_load is .*, allowed: only with line_stiffness"):
        tow_with("line_breaking_load = 50.0\n")


def test_an_overloaded_tow_line_breaks_and_is_told_of(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(tow_with(ELASTIC + "line_breaking_load = 150.0\n"))
    run.run(6.0)
    lines = run.assembly.world.lines
    broken = [line for line in run.assembly.fleet.tensions_of("main").values() if lines[line].parted]
    assert broken
    assert sum("parted" in event.text for event in run.history.events) == len(broken)


def test_a_vessel_hauls_in_its_own_line_and_leaves_the_other(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(tow_with(ELASTIC))
    plan, lines = Plan(scenario=run.scenario), run.assembly.world.lines
    own, other = (run.assembly.fleet.tensions_of("main")[name] for name in ("port", "starboard"))
    laid = lines.length(own), lines.length(other)
    plan = plan.ordered(["vessels.port.hauled=0.5"], 0)
    run.assembly.controls.order(plan.scenario_at(0))
    run.simulation.run(1.5)
    assert lines.length(own) - laid[0] == pytest.approx(-0.5)
    assert lines.length(other) == laid[1]
    run.assembly.controls.order(plan.ordered(["booms.main.tow_line=3.0"], 15).scenario_at(15))
    run.simulation.run(4.0)
    assert lines.length(own) - laid[0] == pytest.approx(0.5)
    assert lines.length(other) - laid[1] == pytest.approx(1.0)


def test_no_more_is_hauled_in_than_the_line_is_long() -> None:
    elastic, rigid = (Plan(scenario=tow_with(more)) for more in (ELASTIC, ""))
    with pytest.raises(
        ScenarioError, match=r"vessels\.port\.hauled is 2, allowed: below 2 m, the length of its tow line"
    ):
        elastic.ordered(["vessels.port.hauled=2.0"], 0)
    with pytest.raises(ScenarioError, match="the vessel holds no boom whose lines have line_stiffness"):
        rigid.ordered(["vessels.port.hauled=1.0"], 0)

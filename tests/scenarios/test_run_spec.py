"""A scenario is resolved once: below `build`, parts take sections of the spec, and no scenario."""

from __future__ import annotations

import ast

from scenarios.spec.load import load_scenario
from scenarios.spec.resolve import SeaSpec, resolve
from scenarios.spec.scenario import Scenario
from tests.house import ROOT, sources


def test_no_part_of_a_run_takes_a_scenario() -> None:
    """In set-up and watch; the estimate of a cost stands beside `build`, and takes what a file says."""
    found = {
        f"{name}.{function.name}"
        for name, text in sources(ROOT, ("scenarios",))
        if name.startswith(("scenarios.setup.", "scenarios.watch."))
        for function in ast.walk(ast.parse(text))
        if isinstance(function, ast.FunctionDef)
        for argument in (*function.args.args, *function.args.kwonlyargs)
        if argument.annotation is not None
        and "Scenario" in ast.unparse(argument.annotation).replace("ScenarioError", "")
    }
    assert found == {"scenarios.setup.cost.estimate"}


def test_a_spec_is_no_scenario_and_stays_as_it_is() -> None:
    spec = resolve(load_scenario("u-sweep").scenario)
    assert not isinstance(spec, Scenario) and resolve(spec) is spec


def test_the_sea_of_a_run_has_numbers_for_depth_and_level() -> None:
    """In a tank, of the water in it; without one, of the file, or of the water that the tank would hold."""
    tank = resolve(load_scenario("u-sweep").scenario)
    sea = tank.sea_at(0.5)
    assert isinstance(sea, SeaSpec) and sea.level == 0.5 and sea.depth == 0.5 - tank.domain.lower[2]
    open_sea = resolve(load_scenario("sweep-200m").scenario)
    assert isinstance(open_sea.sea, SeaSpec)
    assert open_sea.domain.lower[2] == open_sea.sea.level - open_sea.sea.depth

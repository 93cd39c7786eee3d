"""Booms for fast water in scenarios: a high-speed system at three knots with and without its pocket, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.spec.load import load_scenario
from scenarios.text.problems import ScenarioError

SCENE = Path(__file__).with_name("high_speed.toml")
BARE = ("booms.main.boom=sea-going", "booms.main.skirt_depth=0.8")  # the same boom, more or less, without a pocket


@pytest.mark.slow
@pytest.mark.parametrize(("overrides", "least", "most"), [((), 0.85, 1.0), (BARE, 0.0, 0.2)])
def test_a_pocket_holds_oil_at_three_knots(
    scenario_run: type[ScenarioRun], overrides: tuple[str, ...], least: float, most: float
) -> None:
    run = scenario_run(load_scenario(SCENE, overrides=overrides).scenario)
    run.run(65.0)
    oil = run.assembly.slicks[0].slick.oil
    assert least <= oil.contained / oil.spilled <= most


def test_particles_and_reels_that_cannot_be_are_refused_at_once() -> None:
    assert refused("fidelity=fine") >= {"booms.main.pocket"}
    assert refused("booms.main.reel={winch_speed = 0.0}") >= {"booms.main.reel.winch_speed"}
    assert refused("booms.main.reel={paid_out = 130.0}") == {"booms.main.reel.paid_out", "booms.main.stream"}


def refused(*overrides: str) -> set[str]:
    """Places of the problems of the scene with these changes."""
    with pytest.raises(ScenarioError) as caught:
        load_scenario(SCENE, overrides=overrides)
    return {problem.path for problem in caught.value.problems}

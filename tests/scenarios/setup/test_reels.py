"""A boom on a reel in a scenario: paid out as ordered, told in the recording, and the same after a restart."""

from __future__ import annotations

from pathlib import Path

import pytest

from coupling.testing import assert_restarts_exactly
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.load import load_scenario
from scenarios.setup.boom_lines import laid_out, paid_out

SCENE = load_scenario(Path(__file__).with_name("off_the_reel.toml"), overrides=["run.communication_step=0.1"]).scenario


def test_a_reel_pays_out_as_ordered_and_a_run_goes_on_the_same_after_a_restart() -> None:
    assert_restarts_exactly(lambda: ScenarioRun(SCENE), at=8, steps=3)
    run = ScenarioRun(SCENE)
    layout, world = run.assembly.fleet.booms["main"], run.assembly.world
    begun = laid_out(layout, (0.0, 0.0))
    assert begun == pytest.approx(9.0)  # 21 m less the boat's tow point, 4 m, and its tow line of 8 m
    run.run(1.0)
    assert world is not None
    assert paid_out("main", layout, (0.0, 0.0), world.lines) == pytest.approx(begun + 0.4 * 1.0)
    run.close()

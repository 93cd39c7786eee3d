"""A boom on a reel in a scenario: paid out as ordered, told in the recording, and the same after a restart."""

from __future__ import annotations

import pytest

from coupling.testkit import assert_restarts_exactly
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.setup.afloat.boom_lines import laid_out, paid_out
from scenarios.spec.load import load_scenario

CHANGES = ["run.communication_step=0.1", "booms.main.reel.paid_out=40.0"]
SCENE = load_scenario("deploy-from-reel", overrides=CHANGES).scenario


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


def test_what_is_wound_on_the_reel_is_neither_scored_nor_in_the_way_of_oil() -> None:
    """In 1 kn across, a speed of 0.51 m/s would be that of the ten segments behind the mouth; those outside give way."""
    changes = [*CHANGES, "sea.current.speed_kn=1.0", "phases.crude={oil='brent'}"]
    changes += ["fill.spill={shape='cylinder', phase='crude', base=[-30.0, -3.0, -0.05], radius=2.0, height=0.05}"]
    run = ScenarioRun(load_scenario("deploy-from-reel", overrides=changes).scenario)
    run.run(5.0)
    (score,), slick = run.assembly.scoring.booms, run.assembly.slicks[0]
    barriers, series = slick.slick.barriers, score.series()
    assert barriers.is_there.tolist() == [False] * 10 + [True] * 2
    assert barriers.start[10].tolist() == [0.0, 0.0]
    assert slick.slick.oil.contained == slick.slick.oil.all_lost == 0.0
    for name in ("normal_speed", "normal_speed_held"):
        assert 0.2 < series[f"metrics/{name}"] < 0.35
    assert series["metrics/gap_ratio"] < 0.97
    run.close()

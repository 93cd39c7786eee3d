"""Weather that changes over a time: wind, current and waves on their way to what is ordered, also over a restart."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.running.checkpoints import find_restart
from scenarios.running.run import RunOptions, resume, run_scenario
from scenarios.running.run_controls import SeaChange
from scenarios.running.verify import verify
from scenarios.spec.load import scenario_from
from scenarios.text.toml import read_toml
from tests.scenarios.running.test_injects import QUIET, STEP
from tests.scenarios.small_tow import small_tow

SEA = """
[sea.current]
kind = "steady"
speed = 0.1
direction = 0.0
[sea.waves]
kind = "jonswap"
significant_height = 0.2
peak_period = 2.5
direction = 1.0
[sea.wind]
kind = "steady"
speed = 4.0
direction = 3.0
"""
FRESHENS = """
[injects.freshens]
at = 0.2
orders = ["sea.within=0.4", "sea.wind.speed=12", "sea.wind.direction=-3.0", "sea.waves.significant_height=0.4", "sea.waves.peak_period=3.5"]
[injects.turns]
at = 0.3
orders = ["tow.heading_deg=20"]
[injects.lulls]
at = {lulls}
orders = ["sea.wind.speed=6", "sea.within=0.0"]
"""


def scenario(duration: float, lulls: float):
    text = small_tow(duration=duration, communication_step=STEP, frame_rate=20) + SEA + FRESHENS.format(lulls=lulls)
    return scenario_from(read_toml(text))


def test_numbers_go_linearly_and_directions_the_short_way() -> None:
    way = SeaChange(
        10.0,
        20.0,
        {"sea.wind.speed": 4.0, "sea.wind.direction": 3.0},
        {"sea.wind.speed": 12.0, "sea.wind.direction": -3.0},
    )
    assert way.at(0.0) == {"sea.wind.speed": 4.0, "sea.wind.direction": 3.0}
    assert way.at(15.0)["sea.wind.speed"] == 8.0
    assert math.cos(way.at(15.0)["sea.wind.direction"]) == pytest.approx(-1.0)
    assert math.cos(way.at(99.0)["sea.wind.direction"]) == pytest.approx(math.cos(3.0))


def test_wind_and_waves_reach_what_is_ordered_in_their_time_without_a_step(scenario_run: type[ScenarioRun]) -> None:
    """Another order on the way, which is none to the sea, changes nothing; the surface where the run is never jumps."""
    run = scenario_run(scenario(9.0, 8.0))
    speeds, heights, surface = [], [], []
    for _ in range(16):
        run.run(STEP)
        sea, time = run.assembly.sea.now, run.simulation.communication_point.time
        place = run.assembly.world.poses(run.assembly.world.loaded_names)[:, :2].mean(axis=0)
        speeds.append(float(np.hypot(*sea.mean_wind(time))))
        heights.append(4.0 * math.sqrt(0.5 * float((sea.components.amplitude**2).sum())))
        surface.append(float(sea.elevation(place, time)))
    assert speeds[3] == pytest.approx(4.0) and speeds[12:] == pytest.approx([12.0] * 4)
    assert speeds[7] == pytest.approx(8.0, abs=1.1)  # half way, to a step
    assert np.diff(speeds[4:12]) == pytest.approx(1.0)  # 8 m/s in 8 steps
    assert heights[2] == pytest.approx(0.2, rel=0.01) and heights[-1] == pytest.approx(0.4, rel=0.01)
    assert np.abs(np.diff(surface)).max() < 0.05 * 2.0 * math.pi / 2.5 * 0.4  # the fastest rise of such a sea in a step
    assert run.assembly.controls.sea.wind.speed == 12.0


@pytest.mark.parametrize("lulls", [0.45, 0.9])
def test_a_run_goes_on_exactly_on_the_way(tmp_path: Path, lulls: float) -> None:
    """From a checkpoint on the way, and after it; an order that acts at once ends a change that is on its way."""
    records = [tmp_path / f"{name}.rrd" for name in ("whole", "first", "second")]
    options = [RunOptions(record=record, summary=record.with_suffix(".json")) for record in records]
    assert run_scenario(scenario(1.0, lulls), options=options[0], console=QUIET) == 0
    assert run_scenario(scenario(0.4, lulls), options=options[1], console=QUIET) == 0
    restart = find_restart(records[1]).with_settings(("run.duration=1.0",), None)
    assert resume(restart, options=options[2], console=QUIET) == 0
    summaries = [json.loads(record.with_suffix(".json").read_text()) for record in records]
    assert summaries[2]["state_hash"] == summaries[0]["state_hash"] is not None
    assert verify(records[2], console=QUIET).difference == ""

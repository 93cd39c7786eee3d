"""A boom's scoring ends where the boom leaves the simulated sea, and goes on where the sea repeats; both are told."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.load import scenario_from
from scenarios.running.assembly import Assembly

STEP = 0.04
RUNAWAY: dict[str, Any] = {
    "name": "runaway",
    "run": {"duration": 2.0, "communication_step": STEP},
    "fluid": {"particle_spacing": 0.1, "maximum_time_step": 0.04},
    "phases": {"sea": {"density": 1025.0, "dynamic_viscosity": 0.0}, "oil": {"oil": "brent"}},
    "tank": {"lower": [0.0, 0.0, 0.0], "upper": [3.0, 2.0, 1.2], "open": ["+z"], "periodic": ["x", "y"]},
    "fill": {
        "sea": {"shape": "slab", "phase": "sea", "bottom": 0.0, "top": 0.6},
        "oil": {"shape": "block", "phase": "oil", "lower": [0.6, 0.9, 0.6], "upper": [0.8, 1.1, 0.7]},
    },
    "vessels": {
        name: {
            "length": 0.6, "beam": 0.3, "draft": 0.1, "depth": 0.25, "position": [2.75, y], "bollard_pull": 200.0,
            "yaw_moment": 30.0, "side_thrust": 60.0, "acceleration": 4.0,
        }
        for name, y in (("port", 1.6), ("starboard", 0.4))
    },
    "booms": {
        "main": {
            "ends": ["port", "starboard"], "length": 1.8, "segments": 6, "skirt_depth": 0.2, "freeboard": 0.1,
            "buoyancy_to_weight": 6.0, "tow_line": 0.2,
        }
    },
    "tow": {"speed": 1.0, "heading": 0.0},
}  # fmt: skip


def sailed(tank: dict[str, Any], steps: int) -> tuple[Assembly, list[str]]:
    with ScenarioRun(scenario_from(RUNAWAY | {"tank": RUNAWAY["tank"] | tank})) as run:
        run.run(steps * STEP)
    return run.assembly, [event.text for event in run.history.events]


def test_the_scoring_ends_at_an_open_side_and_the_oil_goes_on() -> None:
    assembly, told = sailed({"periodic": ["y"], "open": ["+z", "+x"]}, 25)
    assert [text for text in told if "its scoring ends here" in text] == [
        "has left the simulated sea through its open side +x: its scoring ends here"
    ]
    score = assembly.scoring.booms[0]
    assert score.report is not None
    assert score.report.time < 0.9
    assert score.series() == {}
    saved = score.save_state()
    assert saved["ended"]
    assert assembly.particle_counts()["oil"] > 0


def test_a_boom_sails_on_where_the_sea_repeats() -> None:
    assembly, told = sailed({}, 25)
    assert [text for text in told if text.startswith("sails past side +x of the sea, which repeats every 3 m")]
    score = assembly.scoring.booms[0]
    assert score.report is not None
    assert score.report.time == pytest.approx(1.0)
    assert score.series()


def test_oil_in_a_boom_that_lies_across_a_periodic_side_is_inside() -> None:
    """The vessels are 0.45 m past side -x and the boom reaches back across it; the oil in it lies before side +x."""
    data = copy.deepcopy(RUNAWAY)
    for vessel in data["vessels"].values():
        vessel["position"][0] = 0.45
    data["fill"]["oil"] |= {"lower": [2.6, 0.8, 0.6], "upper": [2.8, 1.2, 0.7]}
    data["tow"]["speed"] = 0.2
    with ScenarioRun(scenario_from(data)) as run:
        run.run(5 * STEP)
    report = run.assembly.scoring.booms[0].report
    assert report is not None
    assert report.inside == report.retained == pytest.approx(8 * 0.1**3)
    assert report.lost == report.outside == 0.0

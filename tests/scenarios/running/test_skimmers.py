"""Skimmers in a run without particles: they take parcels, tell what happens, obey orders, and go on the same after a restart."""

from __future__ import annotations

from typing import Any

import pytest

from recordings.files.checkpoint import state_hash
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.running.plan import Plan
from scenarios.running.summary import SummaryObserver
from scenarios.spec.load import scenario_from
from scenarios.text.problems import ScenarioError


def drifting(**skimmer: Any) -> dict[str, Any]:
    """A slick of 2 m3 that drifts at 0.5 m/s over a skimmer which lies still."""
    return {
        "name": "skimmed",
        "fidelity": "none",
        "run": {"duration": 60.0, "communication_step": 0.1},
        "fluid": {"particle_spacing": 0.25},
        "phases": {
            "water": {"density": 1027.0, "dynamic_viscosity": 1.05e-3},
            "oil": {"oil": "alaska-north-slope"},
        },
        "fill": {"slick": {"shape": "block", "phase": "oil", "lower": [-15.0, -5.0, -0.02], "upper": [-5.0, 5.0, 0.0]}},
        "tank": {"lower": [-60.0, -40.0, -20.0], "upper": [60.0, 40.0, 5.0], "open": ["-x", "+x", "-y", "+y", "+z"]},
        "sea": {"depth": 20.0, "current": {"kind": "steady", "speed": 0.5, "direction": 0.0}},
        "skimmers": {
            "one": {"kind": "brush", "nameplate": 240.0, "swath": 6.0, "storage": 0.2, "throughput_efficiency": 0.7}
            | skimmer
        },
    }


def test_a_skimmer_takes_oil_off_the_water_until_its_storage_is_full(scenario_run: type[ScenarioRun]) -> None:
    run, again = (scenario_run(scenario_from(drifting())) for _ in range(2))
    summary = SummaryObserver(run.assembly)
    run.watch(summary)
    run.run(40.0)
    told = [event.text for event in run.history.events]
    assert "skimmer 'one': a recovery efficiency of 0.75 is assumed for a brush" in told
    assert "takes its first oil" in told
    assert "its storage of 0.2 m3 is full: it stops" in told
    found = summary.summary(40.0)
    figures, oil = found["skimmers"]["one"], found["oil_m3"]
    assert figures["oil_m3"] == pytest.approx(0.75 * 0.2)
    assert figures["recovery_efficiency"] == pytest.approx(0.75)
    assert (
        figures["oil_m3"] <= figures["encountered_m3"] <= oil["spilled"]
    )  # each litre once, though it lies at the mouth for long
    assert figures["throughput_efficiency"] == pytest.approx(figures["oil_m3"] / figures["encountered_m3"])
    assert oil["recovered"] == pytest.approx(figures["oil_m3"])
    assert oil["spilled"] == pytest.approx(oil["recovered"] + oil["afloat"] + oil["contained"])
    again.restore_state(run.save_state())
    for one in (run, again):
        one.run(1.0)
    assert state_hash(again.save_state()) == state_hash(run.save_state())


def test_an_order_stops_a_skimmer(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(scenario_from(drifting(storage=10.0)))
    run.run(20.0)
    account = run.assembly.skimmers[0].skimmer.account
    taken = account.oil
    assert taken > 0.0
    plan = Plan(scenario=run.scenario).ordered(["skimmers.one.running=false"], 200)
    run.assembly.controls.order(plan.scenario_after(1))
    run.run(5.0)
    assert account.oil == taken


def test_an_order_moves_a_skimmer_along_what_carries_it(scenario_run: type[ScenarioRun]) -> None:
    """3 m ahead and 4 m to port of where it lay, at 0.5 m/s; it goes on the same from a state in between."""
    run, again = (scenario_run(scenario_from(drifting())) for _ in range(2))
    scenario = Plan(scenario=run.scenario).ordered(["skimmers.one.place=[3.0, 4.0]"], 0).scenario_after(1)
    run.assembly.controls.order(scenario)
    run.run(4.0)
    again.restore_state(run.save_state())
    again.assembly.controls.order(scenario)  # the plan of a run that goes on has it
    for one in (run, again):
        assert one.assembly.skimmers[0].mouth == pytest.approx((1.2, 1.6))
        one.run(8.0)
        assert one.assembly.skimmers[0].mouth == pytest.approx((3.0, 4.0))
    assert state_hash(again.save_state()) == state_hash(run.save_state())
    assert run.history.frames[-1].scalars["skimmers/one/y"] == pytest.approx(4.0)


def test_all_that_is_wrong_with_skimmers_is_named() -> None:
    data = drifting(on="nobody")
    data["skimmers"]["two"] = data["skimmers"]["one"] | {"on": None, "segment": 3}
    data["skimmers"]["two"].pop("on")
    with pytest.raises(ScenarioError) as found:
        scenario_from(data)
    assert {problem.path for problem in found.value.problems} == {"skimmers.one.on", "skimmers.two.segment"}
    data = drifting()
    data.pop("fidelity")
    data.pop("sea")
    with pytest.raises(ScenarioError, match=r"skimmers is given, allowed: without a tank"):
        scenario_from(data)

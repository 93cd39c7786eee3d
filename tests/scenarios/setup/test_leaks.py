"""A leak that stays with its vessel, from the start or by an order."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.bench.scenario_run import ScenarioRun
from scenarios.running.plan import Plan
from scenarios.spec.load import scenario_from
from scenarios.text.problems import ScenarioError
from scenarios.text.toml import read_toml
from tests.scenarios.small_tow import small_tow

STEP = 0.1
OIL = 'phases.oil = {oil = "alaska-north-slope"}\n'
LEAK = 'emitters.leak = {phase = "oil", on = "port", mouth = [-2.0, 3.0, 0.3], radius = 0.1, speed = 0.05}\n'


def tow(more: str):
    return scenario_from(read_toml(small_tow(duration=30.0, communication_step=STEP, frame_rate=10, more=OIL + more)))


def place(run: ScenarioRun) -> np.ndarray:
    """Return where the leak is, 2 m astern and 3 m to port of midships; the vessel heads along x, to some degrees."""
    x, y, *_ = run.assembly.world.pose("vessels/port")
    return np.array([x - 2.0, y + 3.0])


def test_oil_comes_onto_the_water_where_the_vessel_is(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(tow(LEAK))
    places, seen = [], 0
    while run.simulation.communication_point.time < 12.0:
        before = place(run)
        run.run(STEP)
        parcels = run.assembly.slicks[0].slick.parcels
        if len(parcels.volume) > seen:
            seen = len(parcels.volume)
            places.append((parcels.position[-1], before))
    assert len(places) >= 10
    for found, expected in places:
        assert found == pytest.approx(
            expected, abs=0.35
        )  # in a disc of the leak's radius, which a parcel of a second's oil has
    assert places[-1][1][0] - places[0][1][0] > 1.5  # the vessel has made way


def test_an_order_adds_a_leak_to_a_vessel_and_a_tank_refuses_it(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(tow(""))
    run.run(STEP)
    leak = LEAK.strip().replace("emitters.leak = ", "emitters.leak=")
    run.assembly.controls.order(Plan(scenario=run.scenario).ordered([leak], 1).scenario_at(1))
    run.run(3.0)
    parcels = run.assembly.slicks[0].slick.parcels
    assert len(parcels.volume) >= 2
    assert np.abs(parcels.position - place(run)).max() < 1.5
    with pytest.raises(ScenarioError, match=r"emitters\.leak\.on is 'tug', which is no vessel"):
        tow(LEAK.replace("port", "tug"))
    tank = small_tow(duration=1.0, communication_step=STEP, frame_rate=10, more=OIL + LEAK).replace(
        'fidelity = "none"', ""
    )
    with pytest.raises(ScenarioError, match=r'emitters\.leak\.on is "port", allowed: without a tank'):
        scenario_from(read_toml(tank))

"""What a scenario file refuses, orders refuse too; what no control takes is said before anything is built."""

from __future__ import annotations

from dataclasses import replace

import pytest

from scenarios.controls.signals import signals_of
from scenarios.running.exercise_fmu import exercise_signals
from scenarios.running.plan import Plan
from scenarios.spec.load import scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError
from scenarios.text.toml import read_toml
from tests.scenarios.small_tow import small_tow

INJECT = '\nline_stiffness = 2000.0\n[injects.parts]\norders = ["booms.main.parted=[4]"]\n'


def tow(more: str = INJECT) -> Scenario:
    return scenario_from(read_toml(small_tow(duration=1.0, communication_step=0.1, frame_rate=5) + more))


@pytest.mark.parametrize(
    ("orders", "told"),
    [
        (["tow.speed_kn=0.7", "tow.speed=0.3"], "tow.speed is given beside tow.speed_kn, allowed: one of the two"),
        (["tow.heading_compass=90", "tow.heading_deg=3"], "tow.heading_deg is given beside tow.heading_compass"),
        (["tow.speed=0.3", "tow.speed=0.4"], "tow.speed is given twice, allowed: once"),
        (["booms.main.tow_line=1e6"], "booms.main.tow_line is 1000000.0, allowed: 0 or more and at most 2000 m"),
        (["vessels.port.hauled=-1e6"], "vessels.port.hauled is -1000000.0, allowed: -2000 or more and at most 2000 m"),
        (["vessels.port.hauled=50.0"], "vessels.port.hauled is 50, allowed: below 2 m, the length of its tow line"),
        (["vessels.port.thrust_order=9.0"], 'thrust_order is 9, allowed: only with control = "manual"'),
    ],
)
def test_an_order_is_refused_as_the_file_would_be(orders: list[str], told: str) -> None:
    with pytest.raises(ScenarioError) as found:
        Plan(scenario=tow()).ordered(orders, 1)
    assert told in str(found.value)
    inject = f"\nline_stiffness = 2000.0\n[injects.wrong]\norders = {orders}\n"
    with pytest.raises(ScenarioError, match=r"injects\.wrong\.orders has "):
        tow(inject)


def test_an_inject_is_given_once() -> None:
    plan = Plan(scenario=tow()).ordered(["injects.parts.given=true"], 1)
    with pytest.raises(ScenarioError, match=r"injects\.parts\.given has been given already, allowed: once"):
        plan.ordered(["injects.parts.given=true"], 2)


def test_waves_that_come_first_are_not_refused_for_waves_that_come_no_more() -> None:
    """The second inject adds waves of a direction of their own, which no order may change once there are waves."""
    one, two = (f"sea.waves={{height=0.1, period=3.0, direction={way}}}" for way in (0.0, 1.0))
    plan = Plan(scenario=tow(f'\n[injects.one]\norders = ["{one}"]\n[injects.two]\norders = ["{two}"]\n'))
    after = plan.ordered(["injects.one.given=true"], 1)
    with pytest.raises(ScenarioError, match=r"sea\.waves\.direction cannot be changed during a run"):
        after.ordered(["injects.two.given=true"], 2)


@pytest.mark.parametrize("role", ["instructor", "Observer"])
def test_no_vessel_passes_for_a_role(role: str) -> None:
    text = small_tow(duration=1.0, communication_step=0.1, frame_rate=5).replace("starboard", role)
    with pytest.raises(ScenarioError, match=f"has an entry '{role}', which is a role of the console"):
        scenario_from(read_toml(text))


def test_scores_are_signals_and_an_exercise_without_signals_says_so() -> None:
    assert "booms.main.normal_speed_held" in signals_of(tow().parts)
    nothing = replace(tow("\n"), booms={}, vessels={}, tow=None)
    with pytest.raises(ScenarioError, match="has no signals, allowed: with vessels, booms"):
        exercise_signals(nothing)


def test_an_order_that_cannot_be_read_is_not_blamed_on_conditions() -> None:
    watched = (
        '\n[injects.late]\nwhen = {signal = "booms.main.normal_speed_held", above = 9.0}\norders = ["tow.speed=0.1"]\n'
    )
    with pytest.raises(ScenarioError) as found:
        Plan(scenario=tow(watched)).ordered(["booms.main.parted=[99]"], 1)
    (problem,) = found.value.problems
    assert problem.path.endswith("booms.main.parted")

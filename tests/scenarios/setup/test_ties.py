"""Ties between booms: laid taut with their booms in equilibrium, refused where they cannot be, and cast off by an order."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from recordings.replay.recording import Replay
from scenarios.debrief.boom_history import boom_histories
from scenarios.debrief.measures import connected
from scenarios.running.assembly import build
from scenarios.running.plan import Plan
from scenarios.running.run import RunOptions, run_scenario
from scenarios.setup.layout import Layout, lay_out
from scenarios.spec.load import library_paths, load_scenario, scenario_from
from scenarios.spec.resolve import resolve
from scenarios.text.problems import ScenarioError


def laid(name: str, *settings: str) -> Layout:
    return lay_out(resolve(load_scenario(name, overrides=list(settings)).scenario))


def refused(name: str, settings: Sequence[str]) -> str:
    with pytest.raises(ScenarioError) as caught:
        laid(name, *settings)
    return str(caught.value)


def test_cross_bridles_are_laid_taut_on_the_booms_that_they_hold() -> None:
    layout = laid("v-sweep")
    ties = {line.name: line for line in layout.fleet.lines if line.name.startswith("ties/")}
    assert {name: line.length for name, line in ties.items()} == pytest.approx(
        {"ties/fore": 21.0, "ties/middle": 14.0, "ties/aft": 7.0}, abs=1e-4
    )
    assert {"ties/fore", "ties/middle", "ties/aft"} < set(layout.world.lines.names)
    assert layout.fleet.booms["main"].gap_ratio == pytest.approx(28.0 / 80.0, abs=1e-6)
    poses = layout.world.poses(layout.world.body_names)
    for name in ties:  # taut, without tension
        tension, _ = layout.world.lines[name].pull(poses, np.zeros((len(poses), 6)), 0.0)
        assert tension < 1.0


def test_a_tie_holds_a_free_end_in_the_place_of_a_post() -> None:
    fleet = laid("open-apex-follow").fleet
    ends = [fleet.booms["port"].end_points[1], fleet.booms["starboard"].end_points[0]]
    assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(6.0, abs=1e-4)
    assert fleet.tensions_of("port")["end-1"] == fleet.tensions_of("starboard")["end-0"] == "ties/apex"
    assert not any(joint.body_b is None for joint in fleet.joints)


def test_wrong_ties_are_told_all_at_once() -> None:
    told = refused(
        "v-sweep",
        [
            "ties.fore={booms=['main', 'mian'], joints=[4, 40], length=21.0, stiffness=4e4}",
            "ties.middle.joints=[0, 33]",
            "ties.aft={booms=['main', 'main'], joints=[12, 12], length=-1.0, stiffness=0.0}",
        ],
    )
    assert all(f"ties.aft.{key}" in told for key in ("length", "stiffness"))
    told = refused(
        "v-sweep",
        [
            "ties.fore={booms=['main', 'mian'], joints=[4, 40], length=21.0, stiffness=4e4}",
            "ties.middle.joints=[0, 33]",
            "criteria.gap.boom='mian'",
        ],
    )
    for text in (
        "ties.fore.booms holds 'mian'",
        "ties.middle.joints holds 33, allowed: 0 to 32",
        "ties.middle.joints holds 0 of 'main', the end that vessel 'port' holds",
        "criteria.gap.boom is 'mian'",
    ):
        assert text in told


def test_ties_that_no_stream_holds_are_refused() -> None:
    assert "ties cannot be laid: tie 'aft' would be slack" in refused("v-sweep", ["ties.aft.length=15.0"])
    text = library_paths()["v-sweep"].read_text(encoding="utf-8").replace("stream_deg = 180.0\n", "")
    with pytest.raises(
        ScenarioError, match=r"booms\.main\.stream is missing, allowed: a direction, because tie 'fore' holds the boom"
    ):
        scenario_from(tomllib.loads(text))


def test_a_tie_is_cast_off_by_an_order_and_stays_so() -> None:
    plan = Plan(scenario=load_scenario("v-sweep").scenario)
    cast = plan.ordered(["ties.aft.parted=true"], 3)
    assert cast.scenario_at(3).ties["aft"].parted
    with pytest.raises(ScenarioError, match="because the tie has parted"):
        cast.ordered(["ties.aft.parted=false"], 4)


def test_a_boom_is_paid_out_from_a_winch_ashore_at_its_speed() -> None:
    scenario = load_scenario("launch-from-slip").scenario
    assembly = build(scenario)
    simulation, lines = assembly.co_simulation(), assembly.world.lines
    simulation.initialize()
    plan, laid = Plan(scenario=scenario), lines.length("ties/brake")
    assembly.controls.order(plan.ordered(["ties.brake.hauled=-0.3"], 0).scenario_at(0))
    simulation.step()
    assert lines.length("ties/brake") - laid == pytest.approx(0.4 * 0.2)
    simulation.run(1.0)
    assert lines.length("ties/brake") - laid == pytest.approx(0.3)
    simulation.terminate()
    assert assembly.fleet.tensions_of("main")["end-0"] == "ties/brake"


def test_a_tie_has_two_booms_or_one_and_a_place() -> None:
    told = refused("launch-from-slip", ["ties.brake.length=3.0", "ties.brake.joints=[0, 3]"])
    assert "ties.brake.length is given beside place" in told
    assert "ties.brake.joints has 2 entries, allowed: 1 with place" in told


WAITING = (
    "ties.connect={booms=['main', 'far'], joints=[30, 0], length=0.6, stiffness=4e4, winch_speed=0.3, reach=5.0}",
    "vessels.boat.position=[12.0, 46.0]",  # where the boat brings the end of its boom to the dolphin
    "vessels.boat.legs=[{start=0.0, speed_kn=0.0, heading_deg=0.0, through=[12.0, 46.0]}]",
)


def test_a_tie_that_waits_is_made_fast_within_reach_and_hauled_in() -> None:
    scenario = load_scenario("deploy-and-connect", overrides=WAITING).scenario
    assembly = build(scenario)
    simulation, world = assembly.co_simulation(), assembly.world
    simulation.initialize()
    line = world.lines["ties/connect"]
    assert 0.6 < world.line_distance("ties/connect") < 5.0
    assert world.lines.length("ties/connect") == pytest.approx(0.6)
    simulation.step()
    assert world.tension("ties/connect") == 0.0
    ordered = Plan(scenario=scenario).ordered(["ties.connect.made_fast=true"], 1).scenario_at(1)
    apart = world.line_distance("ties/connect")
    assembly.controls.order(ordered)
    assert world.lines.length("ties/connect") == pytest.approx(apart)
    simulation.step()
    assert world.lines.length("ties/connect") == pytest.approx(apart - 0.3 * 0.2)
    told = [notice.text for notice in assembly.remarks.look(None)]
    assert "has been made fast, and is hauled in to 0.6 m" in told
    saved = world.save_state()
    simulation.run(2.0)
    assert world.lines.length("ties/connect") == pytest.approx(apart - 0.3 * 1.8)
    assert world.line_distance("ties/connect") == pytest.approx(world.lines.length("ties/connect"), rel=0.02)
    assert world.tension("ties/connect") > 1.0
    world.lines.loosen("ties/connect")
    world.restore_state(saved)
    assert line.made_fast
    simulation.terminate()


def test_a_tie_out_of_reach_is_refused_and_stays_loose(tmp_path: Path) -> None:
    scenario = load_scenario(
        "deploy-and-connect",
        overrides=["run.duration=0.6", "injects.tries={at=0.2, orders=['ties.connect.made_fast=true']}"],
    ).scenario
    record = tmp_path / "run.rrd"
    assert run_scenario(scenario, options=RunOptions(record=record), console=Console(quiet=True)) == 0
    replay = Replay(record)
    (told,) = [event.text for event in replay.events if event.source == "inject tries"]
    assert "ties.connect.made_fast cannot be true yet: its ends are " in told
    assert " m apart, allowed: within its reach of 5 m" in told
    assert not replay.scalars["ties/connect/made_fast"].value.any()
    history = boom_histories(replay)[0]
    assert connected(history) == math.inf  # it never was


def test_orders_to_ties_that_cannot_be_are_told() -> None:
    plan = Plan(scenario=load_scenario("deploy-and-connect").scenario)
    fast = plan.ordered(["ties.connect.made_fast=true"], 3)
    with pytest.raises(
        ScenarioError, match=r"because the tie has been made fast; ties\.connect\.parted=true casts it off"
    ):
        fast.ordered(["ties.connect.made_fast=false"], 4)
    with pytest.raises(ScenarioError, match="because the tie has parted"):
        plan.ordered(["ties.connect.parted=true"], 2).ordered(["ties.connect.made_fast=true"], 4)
    assert "ties.connect.made_fast is true at the start, allowed: false" in refused(
        "deploy-and-connect", ["ties.connect.made_fast=true"]
    )
    assert "ties.aft.made_fast is true, allowed: only with reach" in refused("v-sweep", ["ties.aft.made_fast=true"])
    assert "ties.connect.reach is -1" in refused("deploy-and-connect", ["ties.connect.reach=-1.0"])

"""Closures in a run: oil that particles are too coarse to lose leaves the boom, labelled, once, and the same way every time."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from recordings.files.checkpoint import state_hash
from recordings.replay.recording import Replay
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.cli import main
from scenarios.oils.library import oil_named
from scenarios.running.run import RunOptions, run_scenario
from scenarios.running.summary import SummaryObserver
from scenarios.setup.afloat.boom_losses import oils_of
from scenarios.spec.load import library_paths, load_scenario, scenario_from
from scenarios.text.problems import ScenarioError
from tests.scenarios.test_oil_balance import BOOMS, Balance, channel

STREAM = 0.55  # m/s, above the onset of entrainment


def pool(**changes: Any) -> dict[str, Any]:
    """A pool in the apex of a boom, in a stream; `boom` and `oil` change those tables."""
    data = channel(BOOMS["alone"])
    for fill in data["fill"].values():
        fill["velocity"] = [-STREAM, 0.0, 0.0]
    data["fill"]["slick"] |= {"lower": [0.9, 0.6, 0.5], "upper": [1.6, 1.4, 0.66], "velocity": [0.0, 0.0, 0.0]}
    data["sea"]["current"]["speed"] = STREAM
    data["booms"]["a"] |= changes.get("boom", {})
    data["phases"]["oil"] |= changes.get("oil", {})
    return data


def balanced(run: ScenarioRun, seconds: float) -> dict[str, Any]:
    """Run for so long, while all oil is accounted for at every communication point; the summary."""
    summary = SummaryObserver(run.assembly)
    for observer in (summary, Balance(run.assembly, summary)):
        run.watch(observer)
    run.run(seconds)
    return summary.summary(seconds)


def test_modelled_loss_is_part_of_the_loss_and_the_same_on_two_threads_and_after_a_restart(
    scenario_run: type[ScenarioRun],
) -> None:
    scenario = scenario_from(pool(oil={"oil": "alaska-north-slope"}))  # has no interfacial tension in the library
    first, second, third = (scenario_run(scenario, threads=threads) for threads in (1, 2, 2))
    oil = balanced(first, 2.0)["oil_m3"]
    modelled = sum(oil["lost_modelled"].values())
    assert modelled > 0.0
    assert all(volume <= oil["lost"][cause] for cause, volume in oil["lost_modelled"].items())
    series = first.assembly.scoring.series()
    assert series["metrics/oil_lost_modelled"] == pytest.approx(modelled)
    assert series["metrics/closure_loss_rate"] > 0.0
    told = [event.text for event in first.history.events]
    assert any("(modelled)" in text for text in told)
    assert any("0.02 N/m is assumed" in text for text in told)
    second.run(1.0)
    third.restore_state(second.save_state())
    third.run(1.0)
    assert state_hash(third.save_state()) == state_hash(first.save_state())


@pytest.mark.slow
def test_a_run_in_which_particles_changed_places_is_made_again_bit_for_bit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By two threads too."""
    data, path = pool(), tmp_path / "pool.rrd"
    data["run"]["duration"] = 1.2
    assert run_scenario(scenario_from(data), options=RunOptions(record=path)) == 0
    assert Replay(path).scalars["oil_passed_modelled"].value[-1] > 0.0
    capsys.readouterr()
    assert main(["verify", str(path), "--threads", "2"]) == 0
    assert capsys.readouterr().out.startswith("0 frames differ: all ")


def test_closures_see_the_oil_of_a_boom_that_lies_across_a_periodic_side(scenario_run: type[ScenarioRun]) -> None:
    """The apex has gone past side -x, and the oil in it lies before side +x."""
    data = pool(boom={"ends": [[0.4, 1.8], [0.4, 0.2]]})
    data["tank"] |= {"periodic": ["x"], "open": ["+z"]}
    data["fill"]["slick"] |= {"lower": [3.4, 0.6, 0.5], "upper": [4.0, 1.4, 0.66]}
    run = scenario_run(scenario_from(data))
    run.run(1.5)
    assert run.assembly.scoring.series()["metrics/closure_loss_rate"] > 1e-5


def test_without_closures_nothing_is_modelled(scenario_run: type[ScenarioRun]) -> None:
    run = scenario_run(scenario_from(pool(boom={"losses": "resolved"})))
    assert not any(balanced(run, 0.3)["oil_m3"]["lost_modelled"].values())
    assert "metrics/closure_loss_rate" not in run.assembly.scoring.series()


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"oil": {"interfacial_tension": 2.0}},
            "interfacial_tension.*is 2.0, allowed: 0.001 or more and at most 0.1 N/m",
        ),
        ({"oil": {"temperature": 90.0}}, "temperature.*is 90.0, allowed: -2 or more and at most 40 degrees C"),
        (
            {"boom": {"skirt_depth": 0.09}},
            "booms.a.skirt_depth.*is 0.09, allowed: 0.1 m or more, one fluid.particle_spacing",
        ),
        ({"boom": {"losses": "guessed"}}, "losses.*is 'guessed'"),
        ({"oil": {"density": 1100.0}}, "booms.a.losses.*with 'oil' of 1100 kg/m3 on water of 1027"),
    ],
)
def test_bad_input_is_named(changes: dict[str, Any], text: str) -> None:
    with pytest.raises(ScenarioError, match=text):
        scenario_from(pool(**changes))


def test_tension_and_temperature_belong_to_oils() -> None:
    data = pool()
    data["phases"]["sea"] |= {"interfacial_tension": 0.02, "temperature": 10.0}
    with pytest.raises(ScenarioError) as found:
        scenario_from(data)
    told = {problem.path: problem.text for problem in found.value.problems}
    assert told == {
        "phases.sea.temperature": "is 10, allowed: only with oil",
        "phases.sea.interfacial_tension": "is 0.02, allowed: only of an oil or of air",
    }


def test_oil_properties_are_those_at_the_scenarios_temperature() -> None:
    cold, mild = (oils_of(scenario_from(pool(oil={"temperature": degrees})).phases)["oil"] for degrees in (5.0, 15.0))
    brent = oil_named("brent")
    assert cold.oil_density == pytest.approx(brent.density_at(5.0))
    assert cold.oil_density > mild.oil_density
    assert cold.kinematic_viscosity == pytest.approx(brent.kinematic_viscosity_at(5.0))
    assert cold.kinematic_viscosity > mild.kinematic_viscosity
    assert mild == oils_of(scenario_from(pool()).phases)["oil"]


NO_WATER = (
    "phases holds no water under the oil 'oil' of 875 kg/m3, "
    "allowed without a tank: with a phase of water, denser than this oil"
)


def test_oil_without_water_is_refused_by_every_entrance(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """In a run whose sea is formulas; `check` passed it, and `run` refused the oil for its own density."""
    path = tmp_path / "dry.toml"
    shipped = library_paths()["sweep-200m"].read_text(encoding="utf-8")
    path.write_text(re.sub(r"\[phases\.water\]\n(?:[^\[\n].*\n)*", "", shipped), encoding="utf-8")
    for command in (["check"], ["run", "--no-record"]):
        assert main([command[0], str(path), *command[1:]]) == 2
        assert NO_WATER in " ".join(capsys.readouterr().err.split())
    with pytest.raises(ScenarioError, match=re.escape(NO_WATER)):
        load_scenario(path)


@pytest.mark.parametrize(
    ("losses", "problem"),
    [
        ("resolved", "phases.oil is oil of 1100 kg/m3 on water of 1027, allowed without a tank: lighter oil"),
        (
            "closures",
            "booms.a.losses is \"closures\" with 'oil' of 1100 kg/m3 on water of 1027, allowed: with lighter oil",
        ),
    ],
)
def test_oil_that_sinks_is_refused_once_where_the_sea_is_formulas(losses: str, problem: str) -> None:
    data = pool(oil={"density": 1100.0}, boom={"losses": losses})
    data["fidelity"] = "none"
    with pytest.raises(ScenarioError) as found:
        scenario_from(data)
    assert problem in str(found.value)
    assert str(found.value).count("1100") == 1
    del data["fill"]["slick"]  # then no such oil is let in
    if losses == "resolved":
        assert scenario_from(data).phases["oil"].rest_density == 1100.0

"""Faults of scenario runs: told, deterministic, and the run ends or goes on as promised."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from coupling.testkit import Fault, fails_in_order, goes_on_in_order, viewer_fails_in_order
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.text.problems import ScenarioError
from tests.scenarios.small_tow import small_tow

Runs = Callable[..., ScenarioRun]
STEP = 0.05


def small_run(scenario_run: Runs, folder: Path, *settings: str) -> ScenarioRun:
    """A small tow of six steps; what fails does so at 0.12 s, in the step that begins at 0.1 s."""
    path = folder / "tow.toml"
    path.write_text(small_tow(duration=0.3, communication_step=STEP, frame_rate=20))
    return scenario_run(path, *settings)


@pytest.mark.parametrize(
    ("fault", "at", "words"),
    [
        (Fault.ERROR, 0.1, "error injected at 0.12 s"),
        (Fault.NAN, 0.15, "nan"),
        (Fault.LATE, 0.1, "reached 0.2"),
        (Fault.EXCEPTION, 0.1, "exception injected at 0.12 s"),
    ],
)
def test_participant_that_cannot_go_on_ends_the_run(
    scenario_run: Runs, tmp_path: Path, fault: Fault, at: float, words: str
) -> None:
    run = small_run(scenario_run, tmp_path)
    run.faults.participant("bodies", fault, at_time=0.12)
    with fails_in_order(run, participant="bodies", at=at, match=words):
        run.run()
    assert f"fault on purpose: 'bodies': {fault.value}" in [event.text for event in run.history.events]


@pytest.mark.parametrize("fault", [Fault.DISCARD, Fault.EARLY_RETURN, Fault.HANG])
def test_run_goes_on_after_a_step_in_parts_or_a_stall(scenario_run: Runs, tmp_path: Path, fault: Fault) -> None:
    run = small_run(scenario_run, tmp_path)
    run.faults.participant("bodies", fault, at_time=0.12)
    with goes_on_in_order(run, match=f"'bodies': {fault.value}"):
        run.run(0.25)


def test_helmsman_in_a_wrong_unit_is_found_by_what_his_vessel_does(scenario_run: Runs, tmp_path: Path) -> None:
    run = small_run(scenario_run, tmp_path)
    run.faults.participant("port-control", Fault.WRONG_UNIT, at_time=0.12)
    with fails_in_order(run, participant="bodies", match="'vessels/port' moves at .* unstable"):
        run.run()
    assert "fault on purpose: 'port-control': wrong unit" in [event.text for event in run.history.events]


def test_line_parts_when_it_is_told(scenario_run: Runs, tmp_path: Path) -> None:
    run = small_run(scenario_run, tmp_path)
    run.faults.line("boom/main/joint-04", at_time=0.12)
    with goes_on_in_order(run, match="line 'boom/main/joint-04' parts"):
        run.run(0.25)
    world = run.assembly.world
    assert world is not None and "boom/main/joint-04" not in world.joint_names
    assert "parts on purpose" in run.assembly.why_not_kept


def test_viewer_fails_and_hangs(scenario_run: Runs, tmp_path: Path) -> None:
    run = small_run(scenario_run, tmp_path)
    run.faults.observer(Fault.EXCEPTION, at_time=0.12)
    with viewer_fails_in_order(run, match=r"exception injected at 0\.12 s"):
        run.run()
    run = small_run(scenario_run, tmp_path)
    run.faults.observer(Fault.HANG, at_time=0.12)
    with goes_on_in_order(run):
        run.run(0.25)


def test_two_faults_come_one_after_the_other(scenario_run: Runs, tmp_path: Path) -> None:
    run = small_run(scenario_run, tmp_path)
    run.faults.participant("bodies", Fault.DISCARD, at_time=0.12)
    run.faults.participant("bodies", Fault.ERROR, at_time=0.21)
    with fails_in_order(run, participant="bodies", at=0.2):
        run.run()
    told = [event.text for event in run.history.events if "on purpose" in event.text]
    assert told == ["fault on purpose: 'bodies': discard", "fault on purpose: 'bodies': error"]


def test_faults_that_cannot_come_are_refused(scenario_run: Runs, tmp_path: Path) -> None:
    run = small_run(scenario_run, tmp_path)
    run.faults.participant("winch", Fault.ERROR, at_time=0.12)
    with pytest.raises(ScenarioError, match=r"fault of 'winch', which does not take part, allowed: .*bodies"):
        run.run()
    run = small_run(scenario_run, tmp_path)
    run.faults.line("tow", at_time=0.12)
    with pytest.raises(ScenarioError, match=r"line 'tow' that is to part does not exist, allowed: .*main/joint-04"):
        run.run()


def test_a_scenario_file_has_no_faults(scenario_run: Runs, tmp_path: Path) -> None:
    path = tmp_path / "tow.toml"
    path.write_text(
        small_tow(
            duration=0.3,
            communication_step=STEP,
            frame_rate=20,
            more='faults.planned = { of = "line", name = "tow", at = 0.1 }',
        )
    )
    with pytest.raises(ScenarioError, match="faults"):
        scenario_run(path)

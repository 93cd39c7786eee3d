"""Faults in scenario files: told, deterministic, and the run ends or goes on as promised, also under `oilsim run`."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from coupling.testing import Fault, fails_in_order, goes_on_in_order, viewer_fails_in_order
from recordings.replay.recording import Replay
from scenarios.bench.scenario_run import ScenarioRun
from scenarios.cli import main
from scenarios.problems import ScenarioError
from tests.scenarios.small_tow import small_tow

Runs = Callable[..., ScenarioRun]
STEP = 0.05


def failing_tow(folder: Path, of: str, **terms: Any) -> Path:
    """Write the file of a small tow in which something fails at 0.12 s, in the step that begins at 0.1 s."""
    fault = ", ".join(f'{name} = "{value}"' for name, value in terms.items())
    more = f'faults.planned = {{of = "{of}", at = 0.12{", " + fault if fault else ""}}}'
    path = folder / "tow.toml"
    path.write_text(small_tow(duration=0.3, communication_step=STEP, frame_rate=20, more=more))
    return path


@pytest.mark.parametrize(
    ("fault", "at", "words"),
    [
        ("error", 0.1, "error injected at 0.12 s"),
        ("nan", 0.15, "nan"),
        ("late", 0.1, "reached 0.2"),
        ("exception", 0.1, "exception injected at 0.12 s"),
    ],
)
def test_participant_that_cannot_go_on_ends_the_run(
    scenario_run: Runs, tmp_path: Path, fault: str, at: float, words: str
) -> None:
    run = scenario_run(failing_tow(tmp_path, "participant", name="bodies", fault=fault))
    with fails_in_order(run, participant="bodies", at=at, match=words):
        run.run()
    assert f"fault on purpose: 'bodies': {fault}" in [event.text for event in run.history.events]


@pytest.mark.parametrize("fault", ["discard", "early return", "hang"])
def test_run_goes_on_after_a_step_in_parts_or_a_stall(scenario_run: Runs, tmp_path: Path, fault: str) -> None:
    run = scenario_run(failing_tow(tmp_path, "participant", name="bodies", fault=fault))
    with goes_on_in_order(run, match=f"'bodies': {fault}"):
        run.run(0.25)


def test_helmsman_in_a_wrong_unit_is_found_by_what_his_vessel_does(scenario_run: Runs, tmp_path: Path) -> None:
    run = scenario_run(failing_tow(tmp_path, "participant", name="port-control", fault="wrong unit"))
    with fails_in_order(run, participant="bodies", match="'vessels/port' moves at .* unstable"):
        run.run()
    assert "fault on purpose: 'port-control': wrong unit" in [event.text for event in run.history.events]


def test_line_parts_when_it_is_told(scenario_run: Runs, tmp_path: Path) -> None:
    run = scenario_run(failing_tow(tmp_path, "line", name="boom/main/joint-04"))
    with goes_on_in_order(run, match="line 'boom/main/joint-04' parts"):
        run.run(0.25)
    world = run.assembly.world
    assert world is not None and "boom/main/joint-04" not in world.joint_names
    assert "parts on purpose" in run.assembly.why_not_kept


def test_viewer_fails_and_hangs(scenario_run: Runs, tmp_path: Path) -> None:
    run = scenario_run(failing_tow(tmp_path, "viewer", fault="exception"))
    with viewer_fails_in_order(run, match=r"exception injected at 0\.12 s"):
        run.run()
    run = scenario_run(failing_tow(tmp_path, "viewer", fault="hang"))
    with goes_on_in_order(run):
        run.run(0.25)


def test_faults_of_file_and_test_come_together(scenario_run: Runs, tmp_path: Path) -> None:
    run = scenario_run(failing_tow(tmp_path, "participant", name="bodies", fault="discard"))
    run.faults.participant("bodies", Fault.ERROR, at_time=0.21)
    with fails_in_order(run, participant="bodies", at=0.2):
        run.run()
    told = [event.text for event in run.history.events if "on purpose" in event.text]
    assert told == ["fault on purpose: 'bodies': discard", "fault on purpose: 'bodies': error"]


@pytest.mark.parametrize(("of", "code"), [("participant", 1), ("viewer", 1), ("line", 0)])
def test_run_of_the_command_ends_as_promised(tmp_path: Path, of: str, code: int, capsys: Any) -> None:
    terms = {
        "participant": {"name": "bodies", "fault": "error"}, "viewer": {"fault": "exception"},
        "line": {"name": "boom/main/joint-04"},
    }[of]  # fmt: skip
    file, recording = failing_tow(tmp_path, of, **terms), tmp_path / "tow.rrd"
    assert main(["run", str(file), "--record", str(recording)]) == code
    told = "".join(capsys.readouterr())
    assert "warning: fault on purpose: " in told
    events = [(event.level, event.text) for event in Replay(recording).events]
    assert any(level == "warning" and text.startswith("fault on purpose: ") for level, text in events)


@pytest.mark.parametrize(
    ("of", "terms", "message"),
    [
        (
            "participant",
            {"name": "winch", "fault": "error"},
            r"faults\.planned\.name is 'winch', which is no participant.*bodies",
        ),
        (
            "participant",
            {"name": "bodies", "fault": "crash"},
            r"faults\.planned\.fault is 'crash' of 'bodies', allowed: of an FMU.*has none",
        ),
        ("participant", {"name": "bodies", "fault": "tired"}, r"faults\.planned\.fault is 'tired', allowed: "),
        (
            "line",
            {"name": "tow"},
            r"faults\.planned\.name is 'tow', which is no line or joint.*main/joint-04",
        ),
        ("viewer", {"fault": "nan"}, r"faults\.planned\.fault is 'nan', allowed: "),
    ],
)
def test_faults_that_cannot_come_are_refused(
    scenario_run: Runs, tmp_path: Path, of: str, terms: dict[str, str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ScenarioError, match=message):
        scenario_run(failing_tow(tmp_path, of, **terms)).run()
    for command in ("check", "run"):
        assert main([command, str(tmp_path / "tow.toml")]) == 2
        assert re.search(message, capsys.readouterr().err)


def test_fault_after_the_end_is_refused(scenario_run: Runs, tmp_path: Path) -> None:
    file = failing_tow(tmp_path, "line", name="boom/main/joint-04")
    message = r"faults\.planned\.at is 0\.12 s, allowed: before the run's end, run\.duration = 0\.1 s"
    with pytest.raises(ScenarioError, match=message):
        scenario_run(file, "run.duration=0.1")

"""`oilsim sweep`: every combination once, side by side, going on where it was stopped."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from coupling.master.participant import StepResult
from coupling.participants.fluid import FluidParticipant
from scenarios.cli import main
from scenarios.sweeps.remote_run import run_elsewhere
from scenarios.sweeps.results import Outcome, differing, read_summary
from scenarios.sweeps.variants import Variation, parse_variation, variants
from scenarios.text.problems import ScenarioError
from tests.scenarios.small_tow import small_tow

SHORT = ["--set", "fluid.particle_spacing=0.1", "--until", "0.02", "--threads", "1"]
TWO = ["sweep", "two-layer", *SHORT, "--workers", "1", "--vary", "fluid.maximum_time_step=0.004,0.005"]


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "sweep.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("tow.speed_kn=0.3,0.50", ("0.3", "0.5")),
        ("phases.oil.oil=bunker-c, alaska-north-slope", ("bunker-c", "alaska-north-slope")),
        ("bodies.a.position=[1, 2, 3], [4, 5, 6]", ("[1, 2, 3]", "[4, 5, 6]")),
        ("run.ledger=true,false", ("true", "false")),
    ],
)
def test_values_are_those_of_toml(text: str, values: tuple[str, ...]) -> None:
    assert parse_variation(text) == Variation(key=text.partition("=")[0], values=values)


@pytest.mark.parametrize("text", ["tow.speed_kn", "tow.speed_kn=", "=1,2", "tow.speed_kn=1,,2", "tow.speed_kn=1,1.0,1"])
def test_values_that_are_none_or_there_twice_are_refused(text: str) -> None:
    with pytest.raises(ScenarioError, match=r"--vary .*allowed: "):
        parse_variation(text)


def test_every_combination_has_files_of_its_own() -> None:
    varied = [
        Variation(key="tow.speed_kn", values=("0.3", "0.5")),
        Variation(key="booms.main.segments", values=("10", "20")),
    ]
    chosen = variants("u-sweep", varied)
    assert [list(variant.values.values()) for variant in chosen] == [
        [a, b] for a in ("0.3", "0.5") for b in ("10", "20")
    ]
    assert [variant.plan.scenario.booms["main"].segments for variant in chosen] == [10, 20, 10, 20]
    longer = variants("u-sweep", varied, overrides=("run.duration=17",))
    others = variants("u-sweep", varied, overrides=("fluid.particle_spacing=0.1",))
    assert len({variant.name for variant in chosen + longer + others}) == 12


def test_what_is_wrong_with_any_combination_is_told_before_anything_is_run(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "results"
    asked = [*TWO, "--vary", "phases.oil.density=900,-1", "--vary", "tank.bottom=1", "--to", str(folder)]
    assert main(asked) == 2
    said = capsys.readouterr().err
    assert "phases.oil.density is -1" in said and "tank.bottom is unknown" in said
    assert not folder.exists()


def test_runs_stand_side_by_side_and_are_not_repeated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = [*TWO, "--to", str(tmp_path)]
    assert main(asked) == 0
    assert [row["fluid.maximum_time_step"] for row in rows(tmp_path)] == ["0.004", "0.005"]
    assert all(row["ended"] == "completed" and float(row["oil_m3.spilled"]) > 0.0 for row in rows(tmp_path))
    summaries = sorted(tmp_path.glob("*.json"))
    first, second = (path.read_bytes() for path in summaries)
    capsys.readouterr()
    summaries[0].write_bytes(first[: len(first) // 2])
    assert main(asked) == 0
    assert capsys.readouterr().err.count("already complete") == 1
    assert json.loads(summaries[0].read_text())["state_hash"] == json.loads(first)["state_hash"]
    assert summaries[1].read_bytes() == second
    capsys.readouterr()
    assert main([*asked, "--record", "--workers", "2"]) == 0  # complete runs without a recording run again, at once
    said = capsys.readouterr().err
    assert "1 of 2: " in said and "2 of 2: " in said and " left" in said
    assert len(list(tmp_path.glob("*.rrd"))) == 2
    assert summaries[0].read_bytes() != first  # made anew, and the same
    assert [json.loads(path.read_text())["state_hash"] for path in summaries] == [
        json.loads(told)["state_hash"] for told in (first, second)
    ]


@pytest.mark.parametrize(
    "spoiled",
    [
        "[]", "3", "null", "{}", "[" * 100_000, '{"ended": "completed"}',
        '{"ended": [], "simulated_s": 1, "wall_s": 1, "density_error": {}, "probes": {}}',
        '{"ended": "completed", "simulated_s": "x", "wall_s": 1, "density_error": {}, "probes": {}}',
        '{"ended": "completed", "simulated_s": NaN, "wall_s": 1, "density_error": {}, "probes": {}}',
        '{"ended": "completed", "simulated_s": 1, "wall_s": 1, "density_error": {}, "probes": {"gauge": 1}}',
    ],
)  # fmt: skip
def test_a_summary_that_is_none_counts_as_missing(tmp_path: Path, spoiled: str) -> None:
    (tmp_path / "run.json").write_text(spoiled, encoding="utf-8")
    assert read_summary(tmp_path / "run.json") is None


def test_a_run_whose_summary_is_spoiled_is_made_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "tow.toml").write_text(small_tow(duration=0.1, communication_step=0.1, frame_rate=10))
    asked = [
        "sweep",
        str(tmp_path / "tow.toml"),
        "--workers",
        "1",
        "--vary",
        "tow.speed=0.2,0.3",
        "--to",
        str(tmp_path),
    ]
    assert main(asked) == 0
    first = sorted(tmp_path.glob("*.json"))[0]
    whole = json.loads(first.read_text())["state_hash"]
    first.write_text("[]")
    capsys.readouterr()
    assert main(asked) == 0
    assert "1 of 2 already complete" in capsys.readouterr().err
    assert json.loads(first.read_text())["state_hash"] == whole


@pytest.mark.parametrize("method", ["monte-carlo", "latin-hypercube"])
def test_the_command_samples_by_the_method_that_is_asked_for(tmp_path: Path, method: str) -> None:
    """By seed 0 two independent draws are 0.64 and 0.27 of the range; with one in every half of it, the hypercube's are other numbers."""
    asked = [
        "sweep",
        "two-layer",
        *SHORT,
        "--workers",
        "1",
        "--range",
        "fluid.maximum_time_step=0.004:0.006",
        "--runs",
        "2",
    ]
    assert main([*asked, "--method", method, "--to", str(tmp_path)]) == 0
    drawn = [float(row["fluid.maximum_time_step"]) for row in rows(tmp_path)]
    independent = [float(f"{0.004 + 0.002 * share:.6g}") for share in np.random.default_rng(0).random(2)]
    assert (drawn == independent) is (method == "monte-carlo")
    assert method == "monte-carlo" or sorted(value > 0.005 for value in drawn) == [False, True]


def test_only_figures_that_differ_are_shown() -> None:
    (variant,) = variants("u-sweep", [Variation(key="tow.speed_kn", values=("0.3",))])
    probes = {"gauge": {"time_s": [0.0, 1.0], "value": [0.1, 0.2]}}
    scores = {"main": {"gap_ratio": 0.3, "first_loss_speed_kn": None}}
    first = Outcome(variant, {"oil_m3": {"spilled": 0.2}, "scores": scores, "probes": probes})
    assert first.figures() == {"oil_m3.spilled": 0.2, "scores.main.gap_ratio": 0.3, "probes.gauge": 0.2}
    lost = {
        "oil_m3.spilled": 0.2,
        "scores.main.gap_ratio": 0.3,
        "probes.gauge": 0.3,
        "scores.main.first_loss_speed_kn": 0.6,
    }
    assert differing([first.figures(), lost]) == ["probes.gauge", "scores.main.first_loss_speed_kn"]


def test_runs_after_a_failed_one_are_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    healthy, failed = FluidParticipant.do_step, []

    def failing(self: FluidParticipant, time: float, step_size: float) -> StepResult:
        if not failed:
            failed.append(time)
            raise ValueError("the water has gone")
        return healthy(self, time, step_size)

    monkeypatch.setattr(FluidParticipant, "do_step", failing)
    assert main([*TWO, "--to", str(tmp_path), "--record"]) == 1
    first, second = rows(tmp_path)
    assert "the water has gone" in first["ended"] and second["ended"] == "completed"
    assert len(list(tmp_path.glob("*.rrd"))) == 2


@pytest.mark.parametrize("workers", ["1", "2"])
def test_runs_after_one_that_cannot_be_built_are_made(
    workers: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "tow.toml"
    file.write_text(small_tow(duration=0.1, communication_step=0.05, frame_rate=20))
    asked = ["sweep", str(file), "--vary", "booms.main.length=5,24", "--workers", workers, "--to", str(tmp_path)]
    assert main(asked) == 1
    assert "booms.main cannot be laid" in " ".join(capsys.readouterr().err.split())
    (row,) = rows(tmp_path)
    assert (row["booms.main.length"], row["ended"]) == ("24", "completed")


def test_stop_ends_the_sweep_and_the_next_one_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    healthy = FluidParticipant.do_step

    def stopped(self: FluidParticipant, time: float, step_size: float) -> StepResult:
        os.kill(os.getpid(), signal.SIGINT)
        return healthy(self, time, step_size)

    asked = [*TWO, "--to", str(tmp_path)]
    before = signal.signal(
        signal.SIGINT, signal.default_int_handler
    )  # a shell starts its background jobs with SIGINT ignored
    try:
        with monkeypatch.context() as patched:
            patched.setattr(FluidParticipant, "do_step", stopped)
            assert main(asked) == 130
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(list(tmp_path.glob("*.json"))) == 1 and not (tmp_path / "sweep.csv").exists()
    assert main(asked) == 0
    assert [row["ended"] for row in rows(tmp_path)] == ["completed", "completed"]


@pytest.mark.slow
def test_a_run_that_is_killed_is_told_and_the_rest_is_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by a system that runs out of memory: the process of the second of three runs is killed as soon as it is there."""
    started = []

    def elsewhere(
        plan: dict[str, Any], record: str | None, watch: Callable[[subprocess.Popen[str]], None]
    ) -> dict[str, Any]:
        def watched(process: subprocess.Popen[str]) -> None:
            watch(process)
            started.append(process.pid)
            if plan["scenario"]["fluid"]["maximum_time_step"] == 0.005:
                process.kill()

        assert plan["scenario"]["run"]["threads"] == 1
        return run_elsewhere(plan, record, watched)

    monkeypatch.setattr("scenarios.sweeps.sweep.run_elsewhere", elsewhere)
    short = ["--set", "fluid.particle_spacing=0.1", "--until", "0.02"]
    asked = ["sweep", "two-layer", *short, "--vary", "fluid.maximum_time_step=0.004,0.005,0.006", "--workers", "2"]
    assert main([*asked, "--to", str(tmp_path)]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert said.count("failed with exit code -9: no word") == 1 and "3 of 3: " in said
    assert len(started) == 3
    assert [(row["fluid.maximum_time_step"], row["ended"]) for row in rows(tmp_path)] == [
        ("0.004", "completed"),
        ("0.006", "completed"),
    ]


def test_folder_that_cannot_be_made_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "taken").write_text("")
    assert main([*TWO, "--to", str(tmp_path / "taken")]) == 2
    assert "--to" in capsys.readouterr().err

"""Ctrl-C while several runs of a sweep go on: all of them end in order, and the next sweep makes those that are not complete."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from recordings.files.writing import module_command, module_environment

SCENE = Path(__file__).parents[2] / "benchmarks" / "small-sweep.toml"
DURATIONS = ("0.2", "60", "61", "62")  # the first is over before the others


def started(folder: Path) -> subprocess.Popen[str]:
    """Start the sweep on two workers, with Ctrl-C in effect also where the tests run in the background."""
    varied = f"run.duration={','.join(DURATIONS)}"
    command = module_command(
        "scenarios.cli", "sweep", str(SCENE), "--vary", varied, "--workers", "2", "--to", str(folder)
    )
    return subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=module_environment(),
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def children(process: int) -> list[str]:
    """Return the processes that any thread of a process has started."""
    found = Path(f"/proc/{process}/task").glob("*/children")
    return [child for path in found for child in path.read_text(encoding="utf-8").split()]


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_ctrl_c_ends_all_runs_in_order_and_the_next_sweep_goes_on(tmp_path: Path) -> None:
    sweep = started(tmp_path)
    assert sweep.stderr is not None
    for line in sweep.stderr:
        if line.startswith("1 of 4: "):
            break
    runs = children(sweep.pid)
    assert len(runs) >= 1  # the second, and mostly the third
    sweep.send_signal(signal.SIGINT)
    said = sweep.stderr.read()
    assert sweep.wait(timeout=120) == 130
    assert "stopped; the same command goes on" in said and "Traceback" not in said
    assert not any(Path("/proc", run).exists() for run in runs)
    kept = [json.loads(path.read_text(encoding="utf-8")) for path in tmp_path.glob("*.json")]
    assert [summary["ended"] for summary in kept] == ["completed"]
    again = started(tmp_path)
    _, said = again.communicate(timeout=600)
    assert again.returncode == 0
    assert "1 of 4 already complete" in said
    with (tmp_path / "sweep.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["run.duration"], row["ended"]) for row in rows] == [(one, "completed") for one in DURATIONS]

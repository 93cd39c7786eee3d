"""Real runs, killed without warning twenty times at random moments: every frame but those of the last second is there."""

from __future__ import annotations

import random
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from recordings.replay.recording import Replay
from tests.scenarios.kills import SETTINGS, killed_run

KILLS = 5  # `make bench` draws more


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, KILLS))])
def test_killed_run_keeps_all_but_the_last_second_and_can_go_on(seed: int, tmp_path: Path) -> None:
    """The clock is the killed program's own. A machine that is busy with other tests may keep the writer waiting: then once more."""
    chance = random.Random(seed)
    kill = killed_run(tmp_path, chance.uniform(1.05, 2.0))
    if kill.lost > 0.0:
        again = tmp_path / "again"
        again.mkdir()
        kill = killed_run(again, chance.uniform(1.05, 2.0))
    assert kill.said > 0.0
    assert kill.lost == 0.0
    assert kill.checkpoint <= kill.kept + 0.015  # three frames: water is in every second one


def test_full_disk_ends_a_run_in_order_with_one_error(tmp_path: Path) -> None:
    """The system allows files of 300 kB only: one line says so, and what was written can be replayed."""
    record = tmp_path / "full.rrd"
    settings = [part for setting in SETTINGS for part in ("--set", setting)]
    command = [
        "run",
        "two-layer",
        *settings,
        "--threads",
        "1",
        "--record",
        str(record),
        "--summary",
        str(tmp_path / "full.json"),
    ]
    done = subprocess.run(
        [sys.executable, "-m", "scenarios.cli", *command],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000)),
    )
    errors = [line for line in done.stderr.splitlines() if line.startswith("oilsim: ")]
    assert (done.returncode, len(errors)) == (1, 1), done.stderr
    assert "cannot be written any more: File too large" in done.stderr.replace("\n", " ")
    frames = len(Replay(record).scalars["kinetic_energy"].index)
    assert frames >= 2, "a slow machine writes each second, and so more around fewer frames"
    assert "File too large" in (tmp_path / "full.json").read_text()

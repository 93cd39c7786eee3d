"""What is left of a recording when the run ends badly."""

from __future__ import annotations

import itertools
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from recordings.files.writing import RecordingError
from recordings.model.sample import take_sample
from recordings.replay import repair
from recordings.replay.recording import Replay
from recordings.sink import rerun_sink

PROGRAM = Path(__file__).with_name("writing_program.py")
KILLS = 3
FILE_LIMIT = 3_000_000  # bytes, in place of a full disk


def _start(path: Path, pause: float, ocean_count: int = 20_000, limit: int | None = None) -> subprocess.Popen[str]:
    """Start a program that records until it is stopped."""

    def limit_file_size() -> None:
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    command = [sys.executable, str(PROGRAM), str(path), "1000000", str(pause), str(ocean_count)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, preexec_fn=limit_file_size)


def _read_for(program: subprocess.Popen[str], seconds: float) -> list[float]:
    """Let the program run for a while after its first frame; returns when each frame was reported."""
    assert program.stdout is not None
    reported: list[float] = []
    for _ in program.stdout:
        reported.append(time.monotonic())
        if reported[-1] - reported[0] > seconds:
            break
    return reported


def _assert_whole_frames(path: Path, made_up: ModuleType, ocean_count: int, expected_frames: int) -> None:
    """Frames, bodies and series reach the same instant, and the particles are the ones written."""
    replay = Replay(path)
    frames = list(replay.phase_frames("ocean"))
    assert len(frames) >= expected_frames
    assert [index for index, _, _ in frames] == list(range(len(frames)))
    for index, _, phase in itertools.islice(frames, 0, None, 7):
        assert phase.position.tobytes() == made_up.positions("ocean", index, ocean_count).tobytes()
    for series in (*replay.bodies.values(), *replay.scalars.values()):
        assert len(series.index) >= expected_frames
    assert replay.events[0].text == "begins"


@pytest.mark.parametrize("attempt", range(KILLS))
def test_killed_run_loses_at_most_the_last_second(tmp_path: Path, made_up: ModuleType, attempt: int) -> None:
    seconds = random.Random(attempt).uniform(0.8, 2.0)
    program = _start(tmp_path / "killed.rrd", pause=0.02)
    reported = _read_for(program, seconds)
    program.kill()
    killed = time.monotonic()
    program.wait()
    older_than_a_second = sum(moment < killed - 1.0 for moment in reported)
    _assert_whole_frames(tmp_path / "killed.rrd", made_up, 20_000, older_than_a_second)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_terminated_run_is_ended_and_has_every_frame(tmp_path: Path, made_up: ModuleType, number: int) -> None:
    path = tmp_path / "terminated.rrd"
    program = _start(path, pause=0.02)
    reported = _read_for(program, 0.5)
    program.send_signal(number)
    program.communicate(timeout=60)
    assert program.returncode != 0
    _assert_whole_frames(path, made_up, 20_000, len(reported))
    replay = Replay(path)
    assert replay.repaired_from is None
    assert repair.damage_of(path).is_ended
    assert replay.end_reason.startswith("SystemExit" if number == signal.SIGTERM else "KeyboardInterrupt")


def test_full_disk_is_one_clear_error_and_leaves_a_readable_file(tmp_path: Path, made_up: ModuleType) -> None:
    path = tmp_path / "full.rrd"
    program = _start(path, pause=0.0, limit=FILE_LIMIT)
    printed, _ = program.communicate(timeout=120)
    assert program.returncode == 1
    assert printed.splitlines()[-1] == f"error: recording {path}: cannot be written any more: File too large"
    _assert_whole_frames(path, made_up, 20_000, 1)


def test_cut_file_is_repaired_and_says_so(record: Callable[..., Path], made_up: ModuleType) -> None:
    path = record(35)
    os.truncate(path, int(0.9 * path.stat().st_size))
    with pytest.raises(RecordingError, match="cannot be read"):
        Replay(path, mend=False)
    replay = Replay(path)
    assert replay.repaired_from == path
    assert replay.path == repair.repaired_path(path)
    frames = [(index, phase.position.tobytes()) for index, _, phase in replay.phase_frames("oil")]
    assert [index for index, _ in frames] == list(range(len(frames)))
    assert len(frames) >= 10  # the first block at least
    for index, position in frames:
        assert position == made_up.positions("oil", index, len(made_up.oil_ids(index))).tobytes()


def test_what_cannot_be_repaired_is_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / "letter.rrd").write_text("dear trainer, ")
    with pytest.raises(RecordingError, match=r"letter.rrd: is not a Rerun recording"):
        Replay(tmp_path / "letter.rrd")


@pytest.mark.parametrize(
    ("between", "fewest"), [(0.01, 55), (0.05, 14), (0.1, 7), (0.2, 4), (0.249, 4), (0.45, 2), (2.0, 0)]
)
def test_a_block_is_made_in_the_steps_that_follow_and_is_on_the_disk_within_a_second(
    between: float, fewest: int, made_up: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Steps follow each other after `between` [s]. The block fills for half a second, and has five parts at least, one a step."""
    now, run, path = [0.0], made_up.describe(), tmp_path / "parts.rrd"
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    monkeypatch.setattr(rerun_sink, "PART_SECONDS", -1.0)
    file = rerun_sink.RerunFile(path, run, {})
    samples = [take_sample(made_up.make_frame(index), precision=None, phases=None, run=run) for index in range(2)]
    file.add(samples[0])  # at once
    before, steps, now[0] = path.stat().st_size, 0, between
    file.add(samples[1])
    while path.stat().st_size == before:
        now[0] += between
        steps += 1
        file.write_if_full()
    assert steps >= fewest
    assert steps * between < 1.0
    file.close()
    assert [index for index, _, _ in Replay(path).phase_frames("ocean")] == [0, 1]

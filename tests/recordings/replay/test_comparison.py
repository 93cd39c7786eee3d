"""Scores of two recordings over their common time, against numpy; and both recordings in one, bit for bit."""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from recordings.files.writing import RecordingError
from recordings.model.frame import Frame
from recordings.replay.comparison import common_time, scores, write_side_by_side
from recordings.replay.recording import Replay
from recordings.replay.repair import open_reader
from recordings.replay.series import read_rows
from recordings.sink.recorder import Recorder

BEGIN, COUNT, FACTOR = 10, 40, 1.5


@pytest.fixture
def pair(record: Callable[..., Path], made_up: ModuleType, tmp_path: Path) -> tuple[Path, Path]:
    """Steps 0 to 34 of the made-up run, and steps 10 to 39 with 1.5 times the pull and two litres lost by planing."""
    first, second = record(35), tmp_path / "second.rrd"
    recorder = Recorder(second, frame_rate=1.0 / made_up.STEP)
    recorder.initialized(made_up.describe())
    for index in range(BEGIN, COUNT):
        frame = made_up.make_frame(index)
        pull = {"tow_tension/port": FACTOR * frame.scalars["tow_tension/port"]}
        lost = {"main/oil_lost/planing": 0.002, "main/oil_lost/through": 0.0}
        scalars = dict(frame.scalars) | pull | lost
        recorder.step_completed(
            Frame(index=index, time=frame.time, scalars=scalars, read_phases=lambda one=frame: one.phases)
        )
    recorder.terminated("completed")
    return first, second


def test_scores_are_of_the_common_time(pair: tuple[Path, Path], made_up: ModuleType) -> None:
    first, second = (Replay(path) for path in pair)
    assert common_time(first, second) == pytest.approx((BEGIN * made_up.STEP, 34 * made_up.STEP))
    found = {score.label: (score.unit, score.first, score.second) for score in scores(first, second)}
    pull = np.array([made_up.make_frame(index).scalars["tow_tension/port"] for index in range(BEGIN, 35)])
    assert found["mean tow tension, port"] == (
        "kN",
        pytest.approx(1e-3 * pull.mean()),
        pytest.approx(1e-3 * FACTOR * pull.mean()),
    )
    assert found["largest tow tension, port"] == (
        "kN",
        pytest.approx(1e-3 * pull.max()),
        pytest.approx(1e-3 * FACTOR * pull.max()),
    )
    gauge = made_up.make_frame(34).scalars["probes/gauge"]
    assert found["gauge at the end"] == ("SI", pytest.approx(gauge), pytest.approx(gauge))
    assert len(found) == 3  # the first run knows no losses


def test_scores_take_the_last_the_mean_the_largest_and_the_smallest_in_a_readers_units(
    made_up: ModuleType, tmp_path: Path
) -> None:
    series = {
        "main/oil_contained": [0.3, 0.1, 0.2],  # m3
        "main/normal_speed_held": [0.1, 0.5144, 0.3],  # m/s
        "main/skirt_angle": [0.1, 0.5, 0.2],  # rad
        "main/effective_draft": [0.5, 0.3, 0.4],
        "main/gap_ratio": [0.2, 0.4, 0.3],
    }
    with Recorder(tmp_path / "run.rrd") as recorder:
        recorder.initialized(made_up.describe())
        for index in range(3):
            recorder.step_completed(
                Frame(index=index, time=0.1 * index, scalars={name: values[index] for name, values in series.items()})
            )
    replay = Replay(tmp_path / "run.rrd")
    found = {score.label.removeprefix("boom main: "): (score.unit, score.first) for score in scores(replay, replay)}
    assert found == {
        "oil held at the end": ("litres", pytest.approx(200.0)),
        "largest held speed normal to the boom": ("kn", pytest.approx(1.0, rel=1e-4)),
        "largest lean of the skirt": ("deg", pytest.approx(28.648, rel=1e-4)),
        "smallest draft": ("m", pytest.approx(0.3)),
        "gap ratio at the end": ("", pytest.approx(0.3)),
    }


def test_causes_are_named_with_their_boom_and_those_of_nothing_left_out(pair: tuple[Path, Path]) -> None:
    second = Replay(pair[1])
    found = {score.label: score.second for score in scores(second, second) if "leaning" in score.label}
    assert found == {"boom main: oil slipped under the leaning skirt": pytest.approx(2.0)}


def test_each_score_says_its_boom_and_its_unit(made_up: ModuleType, tmp_path: Path) -> None:
    held = {"a/oil_contained": 0.138, "b/oil_contained": 0.0, "b/tow_tension/tug-1": 5.0}
    probes = {"probes/ball/roll_deg": 30.0, "probes/ball/x": 1.0, "probes/ball/force_x": 2.0, "probes/gauge": 3.0}
    path = tmp_path / "two.rrd"
    with Recorder(path, frame_rate=1.0) as recorder:
        recorder.initialized(replace(made_up.describe(), plots={"Probe gauge: pressure [Pa]": ("probes/gauge",)}))
        recorder.step_completed(Frame(index=0, time=0.0, scalars=held | probes))
    replay = Replay(path)
    found = {score.label: (score.unit, score.first) for score in scores(replay, replay)}
    assert found == {
        "boom a: oil held at the end": ("litres", pytest.approx(138.0)),
        "boom b: oil held at the end": ("litres", 0.0),
        "boom b: mean tow tension, tug-1": ("kN", 0.005),
        "boom b: largest tow tension, tug-1": ("kN", 0.005),
        "ball/roll at the end": ("deg", 30.0),
        "ball/x at the end": ("m", 1.0),
        "ball/force x at the end": ("N", 2.0),
        "gauge at the end": ("Pa", 3.0),
    }


def test_both_recordings_lie_in_one(pair: tuple[Path, Path], tmp_path: Path) -> None:
    target = tmp_path / "both.rrd"
    write_side_by_side(*map(Replay, pair), target)
    for side, path in zip("AB", pair, strict=True):
        frames = {index: phase.position.tobytes() for index, _, phase in Replay(path).phase_frames("oil")}
        copied = {}
        for chunk in open_reader(target).stream().filter(content=[f"/{side}/fluid/oil"]):
            rows = read_rows(chunk.to_record_batch(), "Points3D:positions")
            if rows is not None:
                copied |= {index: part.tobytes() for index, part in zip(rows.index.tolist(), rows.split(), strict=True)}
        assert copied == frames


def test_full_disk_is_one_clear_error(pair: tuple[Path, Path], tmp_path: Path) -> None:
    target = tmp_path / "both.rrd"
    done = subprocess.run(
        [sys.executable, "-m", "scenarios.cli", "compare", *map(str, pair), "--to", str(target)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000)),
    )
    assert done.returncode == 2
    assert done.stderr.endswith(f"oilsim: recording {target}: cannot be written any more: File too large\n")
    assert "Traceback" not in done.stderr


def test_runs_without_common_time_are_one_clear_error(
    pair: tuple[Path, Path], record: Callable[..., Path], tmp_path: Path
) -> None:
    pair[0].rename(tmp_path / "long.rrd")
    with pytest.raises(RecordingError, match=r"second.rrd: has no time in common with .*made-up.rrd"):
        common_time(Replay(record(5)), Replay(pair[1]))

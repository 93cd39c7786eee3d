"""Files that hold no run of oilsim, no frame of one, or one of another format are one clear error, whatever is asked of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from recordings.files.writing import RecordingError
from recordings.replay.comparison import write_side_by_side
from recordings.replay.recording import Replay
from recordings.sink import rerun_sink
from scenarios.cli import main

COMMANDS = ("debrief {}", "report {} --csv tables", "verify {}", "export {} --vtk film", "compare {} {} --table")
HEAD = 4000  # bytes, in which a recording says its name and not yet what it is


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("command", COMMANDS)
def test_what_compare_has_written_is_no_run(
    command: str, record: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = record(3)
    write_side_by_side(Replay(path), Replay(path), Path("both.rrd"))
    assert main(command.format("both.rrd", "both.rrd").split()) == 2
    assert "recording both.rrd: has no run of oilsim" in capsys.readouterr().err


@pytest.mark.parametrize("command", [*COMMANDS, "repair {}"])
def test_a_recording_cut_off_at_its_head_is_no_run(
    command: str, record: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    Path("cut.rrd").write_bytes(record(3).read_bytes()[:HEAD])
    assert main(command.format("cut.rrd", "cut.rrd").split()) == 2
    assert "has no run of oilsim, or was cut off before a run began" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["debrief {}", "export {} --vtk film", "export {} --netcdf oil.nc --site 0,0"])
def test_a_run_without_a_frame_is_said(
    command: str, record: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = record(0)
    assert main(command.format(path).split()) == 2
    assert f"recording {path}: has no frames" in capsys.readouterr().err


def test_another_format_is_refused(record: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as changed:
        changed.setattr(rerun_sink, "FORMAT_VERSION", 99)
        path = record(1)
    with pytest.raises(RecordingError, match=f"has format version 99, allowed: {rerun_sink.FORMAT_VERSION}, which"):
        Replay(path)

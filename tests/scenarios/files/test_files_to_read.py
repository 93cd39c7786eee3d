"""Files that a command is to read: what is said of a folder, of nothing, of a text, and of a file that was cut off."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from scenarios.cli import main

Said = Callable[..., str]
FOLDER = "recording folder.rrd: is a folder, allowed: the file of a recording (.rrd)"
NO_RECORDING = "is not a Rerun recording, or was cut off before anything was written"


@pytest.fixture
def said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Said:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.rrd").mkdir()
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "empty.rrd").touch()
    (tmp_path / "text.rrd").write_text("dear run")

    def of(*arguments: str) -> str:
        assert main(arguments) == 2
        return capsys.readouterr().err

    return of


@pytest.mark.parametrize(
    "command", [["replay"], ["repair"], ["debrief"], ["verify"], ["report", "--csv", "out"], ["export", "--vtk", "out"]]
)
def test_a_folder_is_no_recording(command: list[str], said: Said) -> None:
    assert FOLDER in said(*command, "folder.rrd")


def test_a_run_goes_on_from_a_recording_that_is_there(said: Said) -> None:
    assert "folder.rrd: is a folder without checkpoints" in said("run", "--resume", "folder.rrd")
    assert "recording nothing.rrd: does not exist" in said("run", "--resume", "nothing.rrd")
    for name in ("empty.rrd", "text.rrd"):
        assert f"recording {name}: {NO_RECORDING}" in said("run", "--resume", name)


def test_other_files_that_are_not_there(said: Said) -> None:
    assert "--password cannot be read: nothing: No such file or directory" in said(
        "conduct", "u-sweep", "--password", "nothing"
    )
    assert "scenario 'folder.toml' is a folder, allowed: a .toml file in it" in said("check", "folder.toml")
    assert "--runs is missing, allowed: 1 or more, with --range" in said(
        "sweep", "u-sweep", "--range", "tow.speed_kn=0.1:0.3"
    )


def test_the_debrief_of_a_cut_file_names_the_file_that_was_given(said: Said, tmp_path: Path) -> None:
    run = ["run", "still-column", "--set", "fluid.particle_spacing=0.1", "--until", "0.04", "--threads", "1"]
    assert main([*run, "--record", "whole.rrd"]) == 0
    (tmp_path / "cut.rrd").write_bytes((tmp_path / "whole.rrd").read_bytes()[:15000])
    assert "recording cut.rrd: has no frames" in said("debrief", "cut.rrd")


def test_options_that_would_do_nothing_are_refused(said: Said) -> None:
    assert "--notes is given, allowed: only with NAME-or-FILE" in said("list", "--notes")
    assert "--until is -1.0, allowed: 1e-06 or more" in said("verify", "empty.rrd", "--until", "-1")
    run = ["run", "still-column", "--set", "fluid.particle_spacing=0.1", "--until", "0.04", "--threads", "1"]
    assert main([*run, "--record", "run.rrd"]) == 0
    told = said("report", "run.rrd", "--csv", "out", "--tracks", "water", "--ids", "3,999999")
    assert "recording run.rrd: has no particle 999999 of 'water', allowed: " in told

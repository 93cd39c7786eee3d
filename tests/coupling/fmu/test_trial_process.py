"""Folders of unpacked FMUs go, also those of processes that were killed."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from coupling.fmu.trial_process import temporary_folder

LEAVE = """
import os
from coupling.fmu.trial_process import temporary_folder
kept = temporary_folder("fmu")
print(kept.name, flush=True)
os.kill(os.getpid(), 9)
"""


def test_a_killed_process_leaves_nothing_for_long(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    left = Path(
        subprocess.run([sys.executable, "-c", LEAVE], capture_output=True, text=True, check=False).stdout.strip()
    )
    assert left.is_dir()
    other = tmp_path / "oilsim-fmu-kept"
    other.mkdir()
    with temporary_folder("trial") as mine:
        assert not left.exists()
        with temporary_folder("fmu"):
            assert Path(mine).is_dir(), "a folder of a process that runs stays"
    assert [one.name for one in tmp_path.iterdir()] == ["oilsim-fmu-kept"]


def test_a_folder_that_another_process_removes_meanwhile_is_passed_over(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    gone = tmp_path / "oilsim-trial-1-gone"
    monkeypatch.setattr(Path, "glob", lambda folder, pattern: [gone])
    with temporary_folder("fmu") as mine:
        assert Path(mine).is_dir()

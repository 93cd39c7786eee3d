"""`oilsim verify` and `oilsim repair`: a recording that can be made again, one that cannot, and one that was cut."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from oilsim import Fluid
from scenarios.cli import main

STEP = 0.02
SETTINGS = [
    "fluid.particle_spacing=0.1",
    f"run.communication_step={STEP}",
    "run.duration=0.2",
    "recording.frame_rate=50",
]


def record(path: Path, *settings: str) -> Path:
    """Ten steps, each of them recorded."""
    settings = [part for setting in (*SETTINGS, *settings) for part in ("--set", setting)]
    assert main(["run", "two-layer", *settings, "--threads", "1", "--overwrite", "--record", str(path)]) == 0
    return path


def test_a_recording_is_made_again_bit_for_bit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By other threads too; particles as finely as they were recorded."""
    for settings, told in (
        ((), "; particle positions are compared on the recorded grid of 1/512 m"),
        (("recording.precision=0",), ""),
    ):
        path = record(tmp_path / "run.rrd", *settings)
        assert main(["verify", str(path), "--threads", "2"]) == 0
        assert capsys.readouterr().out == f"0 frames differ: all 11 are equal bit for bit{told}\n"


def test_the_first_frame_that_differs_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the recorded run one particle of oil is seen one bit further after step 5."""
    healthy = Fluid.phase_positions

    def disturbed(self: Fluid, phase: str) -> NDArray[np.float32]:
        positions = healthy(self, phase)
        if phase == "oil" and round(self.time / STEP) == 5:
            positions[0, 0] = np.nextafter(positions[0, 0], np.float32(9.0))
        return positions

    with monkeypatch.context() as patch:
        patch.setattr(Fluid, "phase_positions", disturbed)
        path = record(tmp_path / "run.rrd", "recording.precision=0")
    assert main(["verify", str(path)]) == 1
    said = capsys.readouterr().out
    assert said.startswith(
        "the runs differ after 5 equal frames: frame 5 at 0.1 s: 1 of 50 particles of oil have moved"
    )
    assert main(["verify", str(path), "--until", "0.08"]) == 0


def test_a_cut_recording_is_repaired_and_verified(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = record(tmp_path / "run.rrd")
    assert main(["repair", str(path)]) == 0
    assert "is complete; there is nothing to repair" in capsys.readouterr().out
    os.truncate(path, int(0.9 * path.stat().st_size))
    assert main(["repair", str(path), "--to", str(tmp_path / "copy.rrd")]) == 0
    said = capsys.readouterr().out
    assert "was cut off; " in said and "frames of water" in said
    assert main(["verify", str(tmp_path / "copy.rrd")]) == 0
    assert capsys.readouterr().out.startswith("0 frames differ")


@pytest.mark.parametrize("command", ["verify", "repair"])
def test_what_is_no_recording_ends_with_2(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "letter.rrd").write_text("dear trainer, ")
    for name, why in (("letter", "is not a Rerun recording"), ("nothing", "does not exist")):
        assert main([command, str(tmp_path / f"{name}.rrd")]) == 2
        assert why in capsys.readouterr().err

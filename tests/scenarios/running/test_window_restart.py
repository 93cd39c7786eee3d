"""Runs with a window are the same, to the last bit, from a checkpoint and when they are verified."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from recordings.replay.recording import Replay
from scenarios.cli import main

STEP = 0.05
WINDOW = (
    f"run.communication_step={STEP}",
    "run.threads=1",
    "fluid.particle_spacing=0.14",
    "window.target=main",
    "window.size=[3.4, 3.4]",
    "window.depth=0.6",
    "window.rim=0.6",
    "tow.start=0.1",
)


@pytest.mark.slow
def test_a_run_with_a_window_goes_on_and_is_verified_bit_for_bit(tmp_path: Path) -> None:
    """Eight steps with oil as parcels and as particles, from a checkpoint in the middle and from the start."""
    terms = (f"run.duration={8 * STEP}", f"recording.checkpoint_interval={4 * STEP}", "recording.frame_rate=20")
    slick = ("fill.slick.lower=[1.35, 2.2, 0.5]", "fill.slick.upper=[1.95, 2.8, 0.75]")
    settings = [part for one in (*WINDOW, *terms, *slick) for part in ("--set", one)]
    whole, second = str(tmp_path / "whole.rrd"), str(tmp_path / "second.rrd")
    summary = tmp_path / "whole.json"
    assert main(["run", "u-sweep", *settings, "--record", whole, "--summary", str(summary)]) == 0
    oil = json.loads(summary.read_text())["oil_m3"]
    assert 10 * 0.14**3 < oil["resolved"] < 0.9 * oil["spilled"], "some of the oil is particles, some parcels"
    assert main(["run", "--resume", whole, "--at", str(4 * STEP), "--record", second]) == 0
    assert main(["verify", whole]) == 0
    first, again = Replay(Path(whole)), Replay(Path(second))
    for name, body in first.bodies.items():
        late = body.index > 4
        assert again.bodies[name].pose[-4:].tobytes() == body.pose[late].tobytes(), name
        assert again.bodies[name].wrench[-4:].tobytes() == body.wrench[late].tobytes(), name

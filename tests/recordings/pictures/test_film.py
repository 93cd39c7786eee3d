"""A film shows the whole run, in order, by the drawing of the pictures, for as long as it says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from recordings.model.frame import BodyFrame, Frame, MeshDescription, RunDescription
from recordings.pictures import film
from recordings.sink.recorder import Recorder
from scenarios.cli import main

STEPS = 5
WIDTH = 200  # [pixels]


@pytest.fixture
def recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A box that moves a metre a second along x, five times its size in all."""
    monkeypatch.setattr(film, "_WIDTH", WIDTH)
    path = tmp_path / "slide.rrd"
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    box = MeshDescription(vertices=corners, faces=np.array([[1, 3, 5], [3, 5, 7], [0, 1, 4], [1, 4, 5]]))
    turn = np.array([0.0, 0.0, 0.0, 1.0])
    with Recorder(path, frame_rate=1.0) as recorder:
        recorder.initialized(RunDescription(name="slide", particle_spacing=0.1, meshes={"box": box}))
        for index in range(STEPS):
            body = BodyFrame(position=np.array([float(index), 0.0, 0.0]), orientation=turn)
            recorder.step_completed(
                Frame(index=index, time=float(index), bodies={"box": body}, scalars={}, read_phases=dict)
            )
    return path


@pytest.mark.parametrize("ending", film.FILM_ENDINGS)
def test_a_film_has_every_step_in_order_and_lasts_ten_seconds(recording: Path, tmp_path: Path, ending: str) -> None:
    """The box moves to the right by the same distance between frames, and the bar below grows by a quarter."""
    target = tmp_path / f"slide{ending}"
    assert main(["export", str(recording), "--film", str(target)]) == 0
    frames, lasting = [], []
    with Image.open(target) as opened:
        for place in range(opened.n_frames):
            opened.seek(place)
            frames.append(np.asarray(opened.convert("RGB"), dtype=float))
            lasting.append(opened.info["duration"])
    assert len(frames) == STEPS and sum(lasting) == pytest.approx(10_000, abs=50)
    heights = {frame.shape[0] for frame in frames}
    assert len(heights) == 1 and all(frame.shape[1] == WIDTH for frame in frames)
    edge = heights.pop() - film._STRIP
    empty = np.median([frame[:edge] for frame in frames], axis=0)  # each place is covered in one frame or two
    middles = []
    for frame in frames:
        away = np.abs(frame[:edge] - empty).max(axis=2) > 25.0
        middles.append(np.nonzero(away)[1].mean())
    assert np.all(np.diff(middles) > 0.1 * WIDTH)
    bars = [float((frame[edge + 1, :, 0] > 128.0).mean()) for frame in frames]
    assert bars == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0], abs=0.05)


def test_a_film_of_another_kind_is_refused_before_it_is_drawn(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "slide.avi"
    assert main(["export", str(recording), "--film", str(target)]) == 2
    assert ".gif or .webp" in capsys.readouterr().err and not target.exists()

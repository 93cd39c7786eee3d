"""The viewer opens recordings, where there is a screen or at least a graphics driver, and says so where there is none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from recordings.files.writing import RecordingError
from recordings.sink.viewer import ViewerError, open_viewer, render_viewer_screenshot


def test_no_screen_is_one_clear_error(record: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ViewerError, match="ended at once with code 1; it found no screen or no graphics driver"):
        open_viewer(record(2))


def test_no_recording_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="does not exist"):
        open_viewer(tmp_path / "nothing.rrd")


def test_viewer_shows_scene_and_diagrams(record: Callable[..., Path], tmp_path: Path) -> None:
    try:
        render_viewer_screenshot(record(30), {0.5: tmp_path / "view.png"}, width=1000, height=600)
    except ViewerError as error:
        if "it found no screen or no graphics driver" not in str(error):
            raise
        pytest.skip(f"no graphics driver here: {error}")
    image = matplotlib.image.imread(tmp_path / "view.png")[..., :3]
    left, right = image[:, : image.shape[1] * 2 // 3], image[:, image.shape[1] * 3 // 4 :]
    background = np.array([205, 224, 238]) / 255.0
    assert (np.abs(left - background).max(axis=2) < 0.02).mean() > 0.3  # the scene's pale sky, not an empty viewer
    assert np.median(right) < 0.2  # the diagrams are on black

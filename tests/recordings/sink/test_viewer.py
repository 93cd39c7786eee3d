"""The viewer opens recordings, where there is a screen or at least a graphics driver, and says so where there is none."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from rerun.experimental import ViewerClient

from recordings.files.writing import RecordingError
from recordings.sink.viewer import (
    LOOPBACK,
    ViewerError,
    end_viewer,
    free_port,
    open_viewer,
    start_viewer,
    viewer_executable,
    wait_for_port,
)

LOADING = 2.0  # [s] within which the viewer shows a small recording


def _screenshot(recording: Path, target: Path) -> None:
    """Draw what a viewer without a window shows of a recording at 0.5 s; skip where it has no driver."""
    port = free_port()
    command = [viewer_executable(), "--headless", "--bind", LOOPBACK, "--port", str(port)]
    viewer = start_viewer([*command, "--window-size", "1000x600"])
    try:
        wait_for_port(port, viewer)
        client = ViewerClient.connect(f"rerun+http://{LOOPBACK}:{port}/proxy")
        client.open(str(recording))
        time.sleep(LOADING)
        client.set_time("sim_time", duration=0.5, play_state="paused")
        time.sleep(LOADING)
        client.save_screenshot(str(target))
    except (ConnectionError, ViewerError) as error:  # the viewer listens before it looks for a driver
        viewer.wait(5.0)  # fails where the viewer goes on
        pytest.skip(f"no graphics driver here: {error}")
    finally:
        end_viewer(viewer)


def test_no_screen_is_one_clear_error(record: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ViewerError, match="ended at once with code 1; it found no screen or no graphics driver"):
        open_viewer(record(2))


def test_no_recording_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="does not exist"):
        open_viewer(tmp_path / "nothing.rrd")


def test_viewer_shows_scene_and_diagrams(record: Callable[..., Path], tmp_path: Path) -> None:
    _screenshot(record(30), tmp_path / "view.png")
    image = matplotlib.image.imread(tmp_path / "view.png")[..., :3]
    left, right = image[:, : image.shape[1] * 2 // 3], image[:, image.shape[1] * 3 // 4 :]
    background = np.array([205, 224, 238]) / 255.0
    assert (np.abs(left - background).max(axis=2) < 0.02).mean() > 0.3  # the scene's pale sky, not an empty viewer
    assert np.median(right) < 0.2  # the diagrams are on black

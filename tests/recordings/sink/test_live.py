"""A viewer is fed while the run is recorded, and cannot hold it up."""

from __future__ import annotations

import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import pytest

from recordings.replay.recording import Replay
from recordings.sink.live import QUEUE_FRAMES, LiveView
from recordings.sink.recorder import Recorder
from recordings.sink.viewer import LOOPBACK, free_port, start_viewer, viewer_executable, wait_for_port

FRAMES = 30
PATIENCE = 60.0  # seconds after which a test gives up waiting


@contextmanager
def _viewer_that_writes_down(path: Path) -> Iterator[str]:
    """Rerun's own receiving end, which needs no screen; yields its address."""
    port = free_port()
    command = [viewer_executable(), "--bind", LOOPBACK, "--port", str(port), "--save", str(path)]
    viewer = start_viewer(command)
    try:
        wait_for_port(port, viewer)
        yield f"rerun+http://{LOOPBACK}:{port}/proxy"
    finally:
        viewer.terminate()
        viewer.wait()


@contextmanager
def _viewer_that_never_reads() -> Iterator[str]:
    """Somebody who takes the call and says nothing."""
    with socket.socket() as silent:
        silent.bind((LOOPBACK, 0))
        silent.listen()
        yield f"rerun+http://{LOOPBACK}:{silent.getsockname()[1]}/proxy"


def _record(made_up: ModuleType, path: Path, live: LiveView, after_each: Callable[[int], None]) -> None:
    with Recorder(path, frame_rate=1.0 / made_up.STEP, live=live) as recorder:
        recorder.initialized(made_up.describe())
        for index in range(FRAMES):
            recorder.step_completed(made_up.make_frame(index))
            after_each(index)


def _wait_until(reached: Callable[[], bool]) -> None:
    give_up = time.monotonic() + PATIENCE
    while not reached():
        assert time.monotonic() < give_up
        time.sleep(0.01)


def test_a_viewer_that_keeps_up_sees_every_frame(tmp_path: Path, made_up: ModuleType) -> None:
    with _viewer_that_writes_down(tmp_path / "seen.rrd") as address:
        live = LiveView(address)
        _record(made_up, tmp_path / "file.rrd", live, lambda index: _wait_until(lambda: live.shown_frames > index))
        seen = tmp_path / "seen.rrd"
        _wait_until(lambda: seen.exists() and seen.stat().st_size > 0)
    assert live.dropped_frames == 0
    assert live.problem == ""
    written = {i: phase.position.tobytes() for i, _, phase in Replay(tmp_path / "file.rrd").phase_frames("oil")}
    shown = {i: phase.position.tobytes() for i, _, phase in Replay(seen).phase_frames("oil")}
    assert len(written) == FRAMES
    assert shown == written


def test_a_viewer_that_stalls_costs_only_its_own_frames(tmp_path: Path, made_up: ModuleType) -> None:
    with _viewer_that_never_reads() as address:
        live = LiveView(address)
        _record(made_up, tmp_path / "file.rrd", live, lambda index: None)
    in_hand = 1  # of the thread, as it waits for the viewer
    assert live.shown_frames + live.dropped_frames + QUEUE_FRAMES + in_hand >= FRAMES
    frames = [index for index, _, _ in Replay(tmp_path / "file.rrd").phase_frames("ocean")]
    assert frames == list(range(FRAMES))


def test_a_viewer_that_is_closed_costs_only_its_own_frames_and_is_told_of(
    tmp_path: Path, made_up: ModuleType, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Closed after five frames; it is Rerun's own receiving end, which needs no screen."""
    without_screen = ["--save", str(tmp_path / "seen.rrd")]
    monkeypatch.setattr("recordings.sink.live.start_viewer", lambda command: start_viewer([*command, *without_screen]))
    live = LiveView()

    def close_after_five(index: int) -> None:
        if index < 5:
            _wait_until(lambda: live.shown_frames > index)
        elif index == 5:
            assert live.viewer is not None
            live.viewer.terminate()
            live.viewer.wait()

    _record(made_up, tmp_path / "file.rrd", live, close_after_five)
    assert live.shown_frames >= 5
    assert "the live view has ended: the viewer was closed; the recording continues" in caplog.text
    frames = [index for index, _, _ in Replay(tmp_path / "file.rrd").phase_frames("ocean")]
    assert frames == list(range(FRAMES))


def test_a_viewer_that_cannot_start_is_a_note_and_not_the_end(
    tmp_path: Path, made_up: ModuleType, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("recordings.sink.live.viewer_executable", lambda: "/bin/false")
    live = LiveView()
    _record(made_up, tmp_path / "file.rrd", live, lambda index: _wait_until(lambda: live.problem != ""))
    assert "ended at once" in live.problem
    assert "the recording continues" in caplog.text
    assert live.shown_frames == 0
    assert len(Replay(tmp_path / "file.rrd").phase_times("ocean").index) == FRAMES


@pytest.mark.parametrize("address", ["rerun+http://192.168.0.7:9876/proxy", "rerun+http://0.0.0.0:9876/proxy"])
def test_a_viewer_elsewhere_is_refused(address: str) -> None:
    with pytest.raises(ValueError, match="allowed: a viewer on this machine"):
        LiveView(address)


def test_viewers_listen_on_this_machine_only(tmp_path: Path) -> None:
    with _viewer_that_writes_down(tmp_path / "seen.rrd") as address:
        port = address.split(":")[-1].split("/")[0]
        listening = subprocess.run(["cat", "/proc/net/tcp"], capture_output=True, text=True, check=True).stdout
    here = [line.split()[1] for line in listening.splitlines()[1:] if line.split()[3] == "0A"]
    assert f"0100007F:{int(port):04X}" in here  # 127.0.0.1, as Linux writes it
    assert f"00000000:{int(port):04X}" not in here

"""The Rerun viewer that comes with the package, on a screen or in a page.

It listens on this machine only, and its usage reports are switched off.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from recordings.files.writing import RecordingError, absence

LOOPBACK = "127.0.0.1"
_START_SECONDS = 30.0
_STOP_SECONDS = 5.0
_SETTLE_SECONDS = 1.0


class ViewerError(RuntimeError):
    """A viewer that could not be started or did not answer."""


def viewer_executable() -> str:
    """Return the path of the viewer itself; ViewerError if it is not installed.

    The `rerun` command is a Python program that starts the viewer as its child, and stopping that command leaves the child running.
    Therefore the child is started directly, if it is where rerun-sdk puts it.
    """
    package = importlib.util.find_spec("rerun_cli")
    for folder in (package.submodule_search_locations or []) if package else []:
        found = shutil.which("rerun", path=folder)
        if found is not None:
            return found
    found = shutil.which("rerun")
    if found is None:
        raise ViewerError("the rerun program was not found; install it with: pip install rerun-sdk")
    return found


def viewer_environment() -> dict[str, str]:
    """Return this environment with usage reports switched off.

    The viewer sends none if it believes that it runs in continuous integration, which this variable tells it. It has no other switch that
    leaves the user's own settings file alone.
    """
    return os.environ | {"CI": "true", "RERUN_APP_ONLY": "true"}


def open_viewer(path: str | Path) -> subprocess.Popen[bytes]:
    """Open a recording in a viewer on the screen; return its process, which outlives this one. ViewerError if the viewer ends at once."""
    source, port = _readable(path), free_port()
    viewer = start_viewer([viewer_executable(), str(source), "--bind", LOOPBACK, "--port", str(port)])
    wait_for_port(port, viewer)
    try:
        viewer.wait(_SETTLE_SECONDS)  # the viewer listens before it looks for a screen
    except subprocess.TimeoutExpired:
        return viewer
    raise _ended(viewer)


def start_viewer(command: list[str]) -> subprocess.Popen[bytes]:
    """Run a viewer in a session of its own, so that Ctrl-C in the simulation does not close it."""
    return subprocess.Popen(
        command,
        env=viewer_environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def free_port() -> int:
    """Find a free port on this machine."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def wait_for_port(port: int, viewer: subprocess.Popen[bytes]) -> None:
    """Wait until the viewer listens; ViewerError if it ends instead, as it does without a screen or a driver, or is too slow."""
    deadline = time.monotonic() + _START_SECONDS
    while time.monotonic() < deadline:
        if viewer.poll() is not None:
            raise _ended(viewer)
        with socket.socket() as probe:
            probe.settimeout(0.2)
            if probe.connect_ex((LOOPBACK, port)) == 0:
                return
        time.sleep(0.05)
    raise ViewerError(f"the viewer did not answer on port {port} within {_START_SECONDS:.0f} s")


def _ended(viewer: subprocess.Popen[bytes]) -> ViewerError:
    return ViewerError(
        f"the viewer ended at once with code {viewer.returncode}; it found no screen or no graphics driver"
    )


def end_viewer(viewer: subprocess.Popen[bytes]) -> None:
    """End a viewer that was started, by force if it does not heed the signal in time."""
    viewer.terminate()
    try:
        viewer.wait(_STOP_SECONDS)
    except subprocess.TimeoutExpired:
        viewer.kill()
        viewer.wait()


def _readable(path: str | Path) -> Path:
    """Return the path if there is a file; RecordingError otherwise."""
    file = Path(path)
    why = absence(file)
    if why:
        raise RecordingError(file, why)
    return file


MEMORY = "512MB"  # that the server keeps for viewers that come late; the oldest data go first


@dataclass(frozen=True)
class WebViewer:
    """A viewer that is served: its files are at `origin`, its page there with `query`, and a run is sent to `feed`."""

    origin: str
    feed: str

    @property
    def query(self) -> str:
        """The part of the page's address that tells it what to show."""
        return f"url={quote(self.feed, safe='')}"


@contextmanager
def web_viewer() -> Iterator[WebViewer]:
    """Serve the viewer within the block, to this machine only; ViewerError if it does not start."""
    port, page_port = free_port(), free_port()
    ports = ["--bind", LOOPBACK, "--port", str(port), "--web-viewer-port", str(page_port)]
    process = start_viewer([viewer_executable(), "--serve-web", *ports, "--server-memory-limit", MEMORY])
    try:
        wait_for_port(port, process)
        wait_for_port(page_port, process)
        feed = f"rerun+http://{LOOPBACK}:{port}/proxy"
        yield WebViewer(origin=f"http://{LOOPBACK}:{page_port}", feed=feed)
    finally:
        end_viewer(process)

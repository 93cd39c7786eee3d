"""The live view: it shows a run in a viewer while the run is recorded, and never makes the run wait.

A viewer that stops reading blocks the program that writes to it. Therefore a separate program writes to the viewer (`live_feed`), a
thread writes to that program, and a queue of two frames leads to the thread. A frame that finds the queue full is not shown. The
recording file does not depend on any of this.
"""

from __future__ import annotations

import logging
import pickle
import queue
import subprocess
import threading
from collections import deque
from typing import IO
from urllib.parse import urlsplit

from recordings.files.writing import module_command, module_environment
from recordings.model.frame import Event, RunDescription
from recordings.model.sample import Sample
from recordings.sink.viewer import LOOPBACK, ViewerError, free_port, start_viewer, viewer_executable, wait_for_port

QUEUE_FRAMES = 2
_STOP_SECONDS = 3.0
_LOCAL_HOSTS = (LOOPBACK, "localhost", "::1")
_LOG = logging.getLogger(__name__)


class LiveView:
    """A viewer on this machine, started here or already running at ``address``."""

    def __init__(self, address: str | None = None, *, is_embedded: bool = False) -> None:
        """Choose the viewer; ValueError for an address on another machine.

        Args:
            address: address of a running viewer, for example "rerun+http://127.0.0.1:9876/proxy"; None starts one.
            is_embedded: show scenes alone, in a page that has its own diagrams.
        """
        if address is not None and urlsplit(address).hostname not in _LOCAL_HOSTS:
            raise ValueError(
                f"the address of the live view is {address!r}, allowed: a viewer on this machine ({LOOPBACK})"
            )
        self.shown_frames = 0
        self.dropped_frames = 0
        self.problem = ""
        self.viewer: subprocess.Popen[bytes] | None = None
        self._address = address
        self._layout = "embedded" if is_embedded else "live"
        self._samples: queue.Queue[Sample] = queue.Queue(QUEUE_FRAMES)
        self._events: deque[tuple[Event, int]] = deque(maxlen=100)
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        self._feed: subprocess.Popen[bytes] | None = None

    def start(self, run: RunDescription, recording_id: str) -> None:
        """Begin to show ``run``; the call returns at once, and the viewer starts meanwhile."""
        arguments = (run, recording_id)
        self._thread = threading.Thread(target=self._work, args=arguments, name="live view", daemon=True)
        self._thread.start()

    def show(self, sample: Sample) -> None:
        """Show a frame if the viewer has shown the frames before."""
        try:
            self._samples.put_nowait(sample)
        except queue.Full:
            self.dropped_frames += 1
            self._notice_closed_viewer()

    def tell(self, event: Event, frame_index: int) -> None:
        """Show a line of the log with the next frame; a page that embeds the scenes has a log of its own, with what its role may know."""
        if self._layout != "embedded":
            self._events.append((event, frame_index))

    def stop(self) -> None:
        """Show the frames that wait, unless the viewer is slow; the viewer stays open. A second call does nothing."""
        if self._stopping.is_set():
            return
        self._stopping.set()
        if self._thread is not None:
            self._thread.join(_STOP_SECONDS)
        if self._feed is not None:
            self._feed.kill()
            self._feed.wait()
        if self.dropped_frames and not self.problem:
            _LOG.warning("the live view dropped %d frames; the recording has all of them", self.dropped_frames)

    def _work(self, run: RunDescription, recording_id: str) -> None:
        """Run the thread; if the viewer fails, the log says so and the run continues."""
        try:
            address = self._address or self._start_viewer()
            quiet = subprocess.DEVNULL
            self._feed = subprocess.Popen(
                module_command("recordings.sink.live_feed", address, recording_id, self._layout),
                env=module_environment(),
                stdin=subprocess.PIPE,
                stdout=quiet,
                stderr=quiet,
                start_new_session=True,
            )
            assert self._feed.stdin is not None  # Popen was asked for a pipe
            with self._feed.stdin as pipe:
                self._show_all(pipe, run)
            self._feed.wait()
        except (ViewerError, OSError) as error:
            if not self._stopping.is_set():
                self._give_up("the viewer was closed" if isinstance(error, BrokenPipeError) else str(error))

    def _notice_closed_viewer(self) -> None:
        """Ask the viewer itself whether it has ended; the feed cannot tell that from a viewer that stalls."""
        code = None if self.viewer is None else self.viewer.poll()
        if code is not None:
            self._give_up("the viewer was closed" if code <= 0 else "the viewer found no screen or no graphics driver")

    def _give_up(self, problem: str) -> None:
        """Log once why the live view has ended."""
        if not self.problem:
            self.problem = problem
            _LOG.warning("the live view has ended: %s; the recording continues", problem)

    def _show_all(self, pipe: IO[bytes], run: RunDescription) -> None:
        """Pass on one frame after another until told to stop."""
        _send(pipe, "write_run", run, {})
        while not (self._stopping.is_set() and self._samples.empty()):
            while self._events:
                _send(pipe, "write_event", *self._events.popleft())
            try:
                sample = self._samples.get(timeout=0.1)
            except queue.Empty:
                continue
            _send(pipe, "write_samples", [sample])
            self.shown_frames += 1

    def _start_viewer(self) -> str:
        """Start a viewer that listens on this machine only; return its address."""
        port = free_port()
        command = [viewer_executable(), "--bind", LOOPBACK, "--port", str(port), "--expect-data-soon"]
        self.viewer = start_viewer(command)
        wait_for_port(port, self.viewer)
        return f"rerun+http://{LOOPBACK}:{port}/proxy"


def _send(pipe: IO[bytes], verb: str, *arguments: object) -> None:
    """Send one message to the feed; this waits while the viewer does not read."""
    pickle.dump((verb, arguments), pipe, protocol=pickle.HIGHEST_PROTOCOL)
    pipe.flush()

"""The Rerun viewer as a web page of this machine, for a page that embeds it; it is fed as any viewer is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from urllib.parse import quote

from recordings.sink.viewer import LOOPBACK, end_viewer, free_port, start_viewer, viewer_executable, wait_for_port

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

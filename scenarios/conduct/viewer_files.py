"""The Rerun viewer's files, served by the console itself, and the policy under which a browser lets the viewer speak to this machine only.

Left alone, the viewer asks GitHub for its newest version, and reports its use. The page embeds the viewer from this machine's other name: a
browser gives it a process of its own there, so that a view that draws slowly does not hold up the page's orders.
"""

from __future__ import annotations

import asyncio
import urllib.error
import urllib.request

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

_OTHER_NAME = {"127.0.0.1": "localhost", "localhost": "127.0.0.1"}
PATIENCE = 30.0  # [s] that the viewer's server may take over a file
NAMES = ("re_viewer.js", "re_viewer_bg.wasm")


def other_origin(host: str) -> str:
    """Return the origin of this machine's other name, as http://localhost:8000 for the host 127.0.0.1:8000; empty for other hosts."""
    name, _, port = host.partition(":")
    return f"http://{_OTHER_NAME[name]}:{port}" if name in _OTHER_NAME else ""


def policy(host: str) -> dict[str, str]:
    """Return the headers of the viewer's page and files for a request to `host`: only the page of the other name may embed them."""
    return {
        "content-security-policy": "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data: blob:; connect-src 'self' http://127.0.0.1:*; worker-src 'none'; base-uri 'none'; "
        f"frame-ancestors {other_origin(host)}",
    }


class ViewerFiles:
    """Passes on the files of the viewer's own server, which listens on this machine."""

    def __init__(self, origin: str) -> None:
        """Pass on files from `origin`, as http://127.0.0.1:9090."""
        self._origin = origin
        self._kept: dict[str, tuple[bytes, str]] = {}

    async def answer(self, request: Request) -> Response:
        """Return a file."""
        name = request.path_params["name"]
        if name not in NAMES:
            return PlainTextResponse("there is no such file", status_code=404)
        try:
            if name not in self._kept:
                self._kept[name] = await asyncio.to_thread(self._fetched, name)
        except (OSError, urllib.error.URLError):
            return PlainTextResponse("there is no such file", status_code=404)
        content, kind = self._kept[name]
        return Response(content, media_type=kind, headers=policy(request.headers["host"]))

    def _fetched(self, name: str) -> tuple[bytes, str]:
        """Fetch a file once; OSError if there is none."""
        with urllib.request.urlopen(f"{self._origin}/{name}", timeout=PATIENCE) as answer:
            return answer.read(), answer.headers.get_content_type()

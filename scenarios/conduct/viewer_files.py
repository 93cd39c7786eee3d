"""The Rerun viewer's files, served by the console itself, and the policy under which a browser lets the viewer speak to this machine only.

Left alone, the viewer asks GitHub for its newest version, and reports its use.
"""

from __future__ import annotations

import asyncio
import urllib.error
import urllib.request

from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

POLICY = {
    "content-security-policy": "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; connect-src 'self' http://127.0.0.1:*; worker-src 'none'; frame-ancestors 'self'; base-uri 'none'",
}
PATIENCE = 30.0  # [s] that the viewer's server may take over a file
NAMES = ("re_viewer.js", "re_viewer_bg.wasm")


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
        return Response(content, media_type=kind, headers=POLICY)

    def _fetched(self, name: str) -> tuple[bytes, str]:
        """Fetch a file once; OSError if there is none."""
        with urllib.request.urlopen(f"{self._origin}/{name}", timeout=PATIENCE) as answer:
            return answer.read(), answer.headers.get_content_type()

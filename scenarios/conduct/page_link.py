"""One page that is open: what it has been shown, and how it is kept up to date without making anybody wait."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from typing import Any

from starlette.websockets import WebSocket

from scenarios.conduct.access import Role
from scenarios.conduct.session import Session

SLOWEST = 20.0  # [s] that a page may take to read one message


class PageLink:
    """Sends a page what has changed since it last read; of states only the latest."""

    def __init__(self, socket: WebSocket, role: Role, session: Session) -> None:
        """Serve the page behind `socket`, which has shown that it is in this role."""
        self.socket, self.role, self._session = socket, role, session
        self._changed = asyncio.Event()
        self._run = -1
        self._line = 0
        self._summary = self._state = ""
        self._answers: list[dict[str, Any]] = []

    def notice(self) -> None:
        """Take note that there is more to show."""
        self._changed.set()

    def answer(self, number: int, **entries: object) -> None:
        """Answer a command."""
        self._answers.append({"kind": "answer", "id": number, **entries})
        self._changed.set()

    async def send_all(self, first: dict[str, Any]) -> None:
        """Send `first`, and then all that changes, until the page is closed; TimeoutError for one that does not read."""
        await self._send(json.dumps(first))
        while True:
            self._changed.clear()
            for text in self._news():
                await self._send(text)
            await self._changed.wait()

    async def _send(self, text: str) -> None:
        async with asyncio.timeout(SLOWEST):
            await self.socket.send_text(text)

    def _news(self) -> Iterator[str]:
        """Yield the messages that the page has not been sent."""
        session = self._session
        while self._answers:
            yield json.dumps(self._answers.pop(0))
        summary = json.dumps(session.summary)
        if summary != self._summary:
            self._summary = summary
            yield summary
        if session.scene is not None and session.run_number != self._run and session.phase != "building":
            self._run = session.run_number
            yield json.dumps(session.scene)
            yield json.dumps({"kind": "history", "rows": session.history.rows})
        news = [line for line in session.lines if line["number"] > self._line]
        if news:
            self._line = news[-1]["number"]
            yield json.dumps({"kind": "lines", "lines": news})
        if session.state_text != self._state and self._run == session.run_number:
            self._state = session.state_text
            yield self._state

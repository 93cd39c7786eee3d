"""The console's end of the channel from a run: a thread reads, and the event loop takes what has come since it last looked."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection

_STATE = b'{"kind": "state"'


class Inbox:
    """Reads messages from a pipe; of the states that wait for the event loop, only the latest is kept."""

    def __init__(
        self, pipe: Connection, loop: asyncio.AbstractEventLoop, arrived: Callable[[Sequence[bytes] | None], None]
    ) -> None:
        """Call `arrived` in the loop with messages, in order; last with None, when the pipe is closed."""
        self._pipe, self._loop, self._arrived = pipe, loop, arrived
        self._lock = threading.Lock()
        self._messages: list[bytes] = []
        threading.Thread(target=self._read, name="inbox", daemon=True).start()

    def _read(self) -> None:
        with suppress(RuntimeError):  # the loop has been closed
            with suppress(EOFError, OSError):
                while True:
                    self._put(self._pipe.recv_bytes())
            self._loop.call_soon_threadsafe(self._arrived, None)
        self._pipe.close()

    def _put(self, message: bytes) -> None:
        with self._lock:
            was_empty = not self._messages
            if message.startswith(_STATE) and not was_empty and self._messages[-1].startswith(_STATE):
                self._messages[-1] = message
            else:
                self._messages.append(message)
        if was_empty:
            self._loop.call_soon_threadsafe(self._deliver)

    def _deliver(self) -> None:
        with self._lock:
            messages, self._messages = self._messages, []
        self._arrived(messages)

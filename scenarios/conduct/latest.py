"""The channel from a run to its console: only the latest state waits, so that a console that stalls costs the run nothing."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping, Sequence
from multiprocessing.connection import Connection
from typing import Any

MOST_LINES = 1000  # [1] of the log that wait for a console that stalls; the recording has all


class LatestSender:
    """Sends states and lines of the log through a pipe, in a thread of its own.

    A state that has not been sent when the next one comes is dropped. Lines of the log wait, up to `MOST_LINES`. A pipe that is closed ends
    the sending, not the run.
    """

    def __init__(self, pipe: Connection) -> None:
        """Send through `pipe`, which belongs to this sender from now on."""
        self._pipe = pipe
        self._changed = threading.Condition()
        self._first: list[Mapping[str, Any]] = []  # messages that must arrive
        self._lines: list[Mapping[str, Any]] = []
        self._state: Mapping[str, Any] | None = None
        self._is_ended = False
        self.dropped = 0
        self._thread = threading.Thread(target=self._work, name="console", daemon=True)
        self._thread.start()

    @property
    def is_idle(self) -> bool:
        """True if the last state has been taken, so that a new one would be sent at once."""
        return self._state is None

    def send(self, message: Mapping[str, Any]) -> None:
        """Send a message that must arrive, before all states and lines that wait."""
        with self._changed:
            self._first.append(message)
            self._changed.notify()

    def show(self, state: Mapping[str, Any]) -> None:
        """Send a state, unless another one comes before the console has read the last."""
        with self._changed:
            self.dropped += self._state is not None
            self._state = state
            self._changed.notify()

    def tell(self, line: Mapping[str, Any]) -> None:
        """Send a line of the log."""
        with self._changed:
            self._lines = [*self._lines[-MOST_LINES:], line]
            self._changed.notify()

    def close(self, patience: float) -> None:
        """Send what waits, for up to `patience` [s]."""
        with self._changed:
            self._is_ended = True
            self._changed.notify()
        self._thread.join(patience)

    def _work(self) -> None:
        while (messages := self._taken()) is not None:
            try:
                for message in messages:
                    self._pipe.send_bytes(json.dumps(message, allow_nan=False).encode())
            except OSError:
                return  # nobody listens any more

    def _taken(self) -> Sequence[Mapping[str, Any]] | None:
        """Wait for messages, and take them; None at the end."""
        with self._changed:
            while not (self._first or self._lines or self._state is not None):
                if self._is_ended:
                    return None
                self._changed.wait()
            lines = [{"kind": "lines", "lines": self._lines}] if self._lines else []
            states = [] if self._state is None else [self._state]
            taken = [*self._first, *lines, *states]
            self._first, self._lines, self._state = [], [], None
            return taken

"""Signals of the operating system to a run: to stop properly (Ctrl-C, SIGTERM, a closed terminal), or to write a checkpoint (SIGUSR1)."""

from __future__ import annotations

import signal
import threading
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from types import FrameType

from scenarios.exit_codes import DONE

STOP = (int(signal.SIGINT), int(signal.SIGTERM), int(signal.SIGHUP))
SAVE = int(signal.SIGUSR1)


class Requests:
    """The requests so far: to stop, by the signal's number, and to write a checkpoint."""

    def __init__(self) -> None:
        self.stop: int | None = None
        self._checkpoint = False

    @property
    def exit_code(self) -> int:
        """Exit code as shells count it: 130 after Ctrl-C, 143 after SIGTERM."""
        return DONE if self.stop is None else 128 + self.stop

    def take_checkpoint(self) -> bool:
        """Tell whether a checkpoint has been requested since the last call."""
        asked, self._checkpoint = self._checkpoint, False
        return asked

    def ask(self, number: int) -> None:
        """Note the request of a signal."""
        if number == SAVE:
            self._checkpoint = True
        else:
            self.stop = number


@contextmanager
def requests_by_signal() -> Iterator[Requests]:
    """Collect requests within the block: the first signal to stop requests a proper end, a second one ends the program at once.

    A signal that the program was started to ignore stays ignored: a script starts its background jobs so that Ctrl-C does not reach them,
    and nohup starts a command so that it outlives the terminal. Outside the main thread signals cannot be caught, and nothing is requested.
    """
    requests = Requests()
    if threading.current_thread() is not threading.main_thread():
        yield requests
        return
    before = {number: signal.getsignal(number) for number in (*STOP, SAVE)}
    heeded = [number for number, handler in before.items() if handler is not signal.SIG_IGN]

    def restore(numbers: Collection[int]) -> None:
        for number in heeded:
            if number in numbers:
                signal.signal(number, before[number])

    def ask(number: int, _: FrameType | None) -> None:
        requests.ask(number)
        if number in STOP:
            restore(STOP)

    for number in heeded:
        signal.signal(number, ask)
    try:
        yield requests
    finally:
        restore(heeded)

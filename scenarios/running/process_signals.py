"""What somebody asks a run for by signals: to stop in order (Ctrl-C, SIGTERM, a closed terminal), or for a checkpoint (SIGUSR1)."""

from __future__ import annotations

import signal
import threading
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from types import FrameType

from coupling.fmu.trial_process import STOPPING
from scenarios.exit_codes import DONE

STOP = (int(signal.SIGINT), int(signal.SIGTERM), int(signal.SIGHUP))
SAVE = int(signal.SIGUSR1)


class Requests:
    """Whether a stop was asked for, by its signal number, and whether a checkpoint was."""

    def __init__(self) -> None:
        self.stop: int | None = None
        self._checkpoint = False

    @property
    def exit_code(self) -> int:
        """As a shell counts it: 130 after Ctrl-C, 143 after SIGTERM."""
        return DONE if self.stop is None else 128 + self.stop

    def take_checkpoint(self) -> bool:
        """Whether a checkpoint was asked for since the last call."""
        asked, self._checkpoint = self._checkpoint, False
        return asked

    def ask(self, number: int) -> None:
        """Take a signal."""
        if number == SAVE:
            self._checkpoint = True
        else:
            self.stop = number
            STOPPING.set()


@contextmanager
def requests_by_signal() -> Iterator[Requests]:
    """Within the block the first signal to stop asks for an orderly one, a second one ends the program at once.

    A signal that the program was started to ignore stays ignored: a script starts its background jobs so that Ctrl-C does not reach
    them, and nohup its command so that it outlives the terminal. Outside the main thread signals cannot be caught; nothing is asked
    there.
    """
    requests = Requests()
    STOPPING.clear()
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
        STOPPING.clear()

"""Requests to a run by POSIX signals: an orderly stop (Ctrl-C, SIGTERM, a closed terminal), or a checkpoint (SIGUSR1).

Elsewhere in `scenarios` a signal is a number of a run that FMUs are connected to, see `scenarios.controls`.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from types import FrameType

from coupling.fmu.trial_process import STOPPING
from scenarios.text.problems import DONE

STOP = (int(signal.SIGINT), int(signal.SIGTERM), int(signal.SIGHUP))
SAVE = int(signal.SIGUSR1)


class RunRequests:
    """Holds whether a stop was asked for, by the number of its POSIX signal, and whether a checkpoint was."""

    def __init__(self) -> None:
        self.stop: int | None = None
        self._checkpoint = False

    @property
    def exit_code(self) -> int:
        """The exit code of the run, as a shell counts it: 130 after Ctrl-C, 143 after SIGTERM."""
        return DONE if self.stop is None else 128 + self.stop

    def take_checkpoint(self) -> bool:
        """Return whether a checkpoint was asked for since the last call."""
        asked, self._checkpoint = self._checkpoint, False
        return asked

    def ask(self, number: int) -> None:
        """Note the request that a POSIX signal stands for, by its number."""
        if number == SAVE:
            self._checkpoint = True
        else:
            self.stop = number
            STOPPING.set()


@contextmanager
def requests_by_posix_signal() -> Iterator[RunRequests]:
    """Take requests within the block: the first signal to stop asks for an orderly stop, a second one ends the program at once.

    A signal that the program was started to ignore stays ignored: a script starts its background jobs so that Ctrl-C does not reach
    them, and nohup its command so that it outlives the terminal. Outside the main thread signals cannot be caught; nothing is asked
    there.
    """
    requests = RunRequests()
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

"""What an FMU says: kept, so that its failure can be told in its own words, instead of printed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from ctypes import byref

from fmpy import calloc, free
from fmpy.fmi2 import (
    addLoggerProxy,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)

WARNING = 1  # of FMI 2 and 3; what ranks lower is no news
KEPT = 5


class FmuMessages:
    """The last warnings and errors of one FMU; `callbacks` (FMI 2) and `listener` (FMI 3) must live as long as the FMU."""

    def __init__(self) -> None:
        self._messages: deque[str] = deque(maxlen=KEPT)
        self.listener: Callable[..., None] = lambda _, status, category, message: self._keep(status, message)
        self._logger = fmi2CallbackLoggerTYPE(
            lambda _, instance, status, category, message: self._keep(status, message)
        )
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = self._logger
        self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        addLoggerProxy(byref(self.callbacks))

    def explain(self, failure: object) -> str:
        """A failure on one line, with what the FMU said since the last time."""
        said = "; ".join(self._messages)
        self._messages.clear()
        return f"{failure}: {said}" if said else str(failure)

    def _keep(self, status: int, message: bytes | None) -> None:
        text = " ".join((message or b"").decode("utf-8", "replace").split())
        if status >= WARNING and text:
            self._messages.append(text)

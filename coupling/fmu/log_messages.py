"""Keeps the log messages of FMUs, which are not printed, so that an error can quote them.

FMPy formats the messages of FMI 2 in a native function that knows one logger for the whole process, the one registered last. So there is
one logger here, and the environment that each FMU is given identifies the sender of a message.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from ctypes import byref
from itertools import count
from weakref import WeakValueDictionary

from fmpy import calloc, free
from fmpy.fmi2 import (
    addLoggerProxy,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)

WARNING = 1  # status of FMI 2 and 3; messages of lower rank are not kept
KEPT = 5


class FmuMessages:
    """The last warnings and errors of one FMU; `callbacks` (FMI 2) and `listener` (FMI 3) must live as long as the FMU."""

    def __init__(self) -> None:
        self._messages: deque[str] = deque(maxlen=KEPT)
        self.listener: Callable[..., None] = lambda _, status, category, message: self.keep(status, message)
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = _LOGGER
        self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        self.callbacks.componentEnvironment = next(_ENVIRONMENTS)
        _LISTENING[self.callbacks.componentEnvironment] = self
        addLoggerProxy(byref(self.callbacks))

    def explain(self, failure: object) -> str:
        """Describe a failure on one line, followed by the FMU's messages since the last call."""
        said = "; ".join(self._messages)
        self._messages.clear()
        return f"{failure}: {said}" if said else str(failure)

    def keep(self, status: int, message: bytes | None) -> None:
        """Keep a message if its status is a warning or worse."""
        text = " ".join((message or b"").decode("utf-8", "replace").split())
        if status >= WARNING and text:
            self._messages.append(text)


def _log(environment: int | None, _name: bytes, status: int, _category: bytes, message: bytes) -> None:
    listener = _LISTENING.get(environment or 0)
    if listener is not None:
        listener.keep(status, message)


_ENVIRONMENTS = count(1)
_LISTENING: WeakValueDictionary[int, FmuMessages] = WeakValueDictionary()
_LOGGER = fmi2CallbackLoggerTYPE(_log)

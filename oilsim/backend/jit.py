"""How kernels are compiled: the options of all of them, and a compiler that is not interrupted."""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any

from numba import config
from numba.core.event import Event, Listener, register
from numba.core.registry import CPUDispatcher

# Kernels own no arrays; to count references to those they are given, which numba does for each particle that is handed on to a function,
# threads wait for each other: a fifth of a product's time. C does not call them: a wrapper for it would only take time to compile.
FAST = {"nogil": True, "cache": True, "fastmath": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
ALLOCATING = FAST | {"_nrt": True}  # of those that make arrays

INLINED = {name: option for name, option in FAST.items() if name != "cache"} | {
    "nopython": True, "forceinline": True, "no_cpython_wrapper": True,
}  # fmt: skip


class Inlined(CPUDispatcher):
    """Compiled for kernels alone; to Python it is the function as it is written. (A wrapper for calls from there takes a tenth of the time
    to compile.)"""

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate what kernels call: it becomes part of them, always.

    Left to the compiler, that would hang on whether the callee came from the cache, and bits with it. It is typed once, where numba's own
    inlining would do so at every call, and needs no place in the cache.
    """
    return function if config.DISABLE_JIT else Inlined(function, targetoptions=INLINED)


class WithoutCollector(Listener):
    """Python's garbage collector rests while numba compiles: it would look through the compiler's many objects again and again, for a
    quarter of the time."""

    def __init__(self) -> None:
        self._depth = 0  # of compilations that asked for others; only one thread at a time is among them
        self._enabled = False

    def on_start(self, event: Event) -> None:
        if self._depth == 0:
            self._enabled = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: Event) -> None:
        self._depth -= 1
        if self._depth == 0 and self._enabled:
            gc.enable()


register("numba:compile", WithoutCollector())

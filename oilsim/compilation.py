"""How kernels are compiled: the options of all of them, and a compiler that is not interrupted."""

from __future__ import annotations

import gc

from numba.core.event import Event, Listener, register

# Kernels own no arrays; to count references to those they are given, which numba does for each particle that is handed on to a function,
# threads wait for each other: a fifth of a product's time. C does not call them: a wrapper for it would only take time to compile.
FAST = {"nogil": True, "cache": True, "fastmath": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
ALLOCATING = FAST | {"_nrt": True}  # of those that make arrays

# What kernels call becomes part of them, always: left to the compiler, that would hang on whether the callee came from the cache, and bits
# with it. It is typed once, where numba's own inlining would do so at every call, and needs no place in the cache.
INLINED = FAST | {"cache": False, "forceinline": True}


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

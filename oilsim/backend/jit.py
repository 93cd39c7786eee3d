"""Compile kernels: the options that all kernels share, and a compiler that the garbage collector does not interrupt.

A module that takes `njit`, or options, from here has its kernels kept by their sources.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import config
from numba import njit as njit
from numba.core.event import Event, Listener, register
from numba.core.registry import CPUDispatcher

from oilsim.backend import kernel_cache

# Kernels own no arrays. numba would count references to their arguments whenever a loop hands them to a function, and threads would wait
# for each other at that count: a fifth of a product's time. C does not call kernels: a wrapper for it would only take time to compile.
FAST = {"nogil": True, "cache": True, "fastmath": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
ALLOCATING = FAST | {"_nrt": True}  # of kernels that make arrays

EXACT = FAST | {"fastmath": False}  # of kernels whose result may not depend on how a formula is rounded

INLINED = {name: option for name, option in FAST.items() if name != "cache"} | {
    "nopython": True, "forceinline": True, "no_cpython_wrapper": True,
}  # fmt: skip


class Inlined(CPUDispatcher):
    """A function that is compiled for kernels alone; Python runs it as it is written.

    A wrapper for calls from Python would take a tenth of the time to compile.
    """

    def __call__(self, *arguments: Any) -> Any:
        """Run the function as Python, without compiling it."""
        return self.py_func(*arguments)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that kernels call in such a way that it always becomes part of them.

    Left to the compiler, inlining would depend on whether the callee came from the cache, and so would the bits of results. The function is
    typed once, where numba's own inlining would do so at every call, and it takes no place in the cache.
    """
    return function if config.DISABLE_JIT else Inlined(function, targetoptions=INLINED)


def exactly_inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function as `inlined` does, but with every operation rounded as it is written; for kernels compiled with `EXACT`."""
    return function if config.DISABLE_JIT else Inlined(function, targetoptions=INLINED | {"fastmath": False})


class WithoutCollector(Listener):
    """Stops Python's garbage collector while numba compiles.

    The collector would look through the compiler's many objects again and again, which takes a quarter of the time.
    """

    def __init__(self) -> None:
        self._depth = 0  # compilations under way; only one thread at a time compiles
        self._enabled = False

    def on_start(self, event: Event) -> None:
        """Stop the collector at the first of nested compilations."""
        if self._depth == 0:
            self._enabled = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: Event) -> None:
        """Start the collector again after the last of nested compilations."""
        self._depth -= 1
        if self._depth == 0 and self._enabled:
            gc.enable()


register("numba:compile", WithoutCollector())
kernel_cache.install()


ZERO, HALF, ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)
TWO, THREE = np.float32(2.0), np.float32(3.0)

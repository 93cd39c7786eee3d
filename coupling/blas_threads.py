"""Linear algebra beside the fluid.

The matrices of a step are those of a few hundred joints and bodies at most. The threads among which a BLAS shares such a product out
go on spinning for some ten milliseconds after it, on the cores that the fluid then wants: with a boom of 20 segments its steps
take 2.4 times as long.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import local

import numpy as np  # noqa: F401  a BLAS of its own
import scipy.linalg  # noqa: F401  and another one
from threadpoolctl import ThreadpoolController


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Each BLAS of the process works on one thread while this lasts, then on as many as before; within itself it costs nothing."""
    if _limited.is_set:
        yield
        return
    libraries = _libraries().lib_controllers
    before = [library.num_threads for library in libraries]
    _limited.is_set = True
    try:
        for library in libraries:
            library.set_num_threads(1)
        yield
    finally:
        for library, number in zip(libraries, before, strict=True):
            library.set_num_threads(number)
        _limited.is_set = False


class _Limited(local):
    """Whether this thread has set the limit already."""

    is_set = False


_limited = _Limited()


@cache
def _libraries() -> ThreadpoolController:
    """Those that numpy and scipy have brought, and what else was there at the first call; to look for them takes 3 ms."""
    return ThreadpoolController().select(user_api="blas")

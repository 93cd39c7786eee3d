"""Limits the threads of linear algebra, so that they do not slow the fluid down.

A step multiplies and solves matrices of a few hundred joints and bodies at most. After such a product the threads of a BLAS keep spinning
for some ten milliseconds, on the cores that the fluid needs next: with a boom of 20 segments the fluid's steps take 2.4 times as long.
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
    """Limit each BLAS of the process to one thread inside the `with` block or decorated function, then restore the earlier numbers.

    A block inside another one changes nothing.
    """
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
    """State of one thread: `is_set` is true while this thread has set the limit."""

    is_set = False


_limited = _Limited()


@cache
def _libraries() -> ThreadpoolController:
    """Find the BLAS libraries that numpy, scipy and others had loaded at the first call; the search takes 3 ms."""
    return ThreadpoolController().select(user_api="blas")

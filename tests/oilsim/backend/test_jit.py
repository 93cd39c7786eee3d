"""Compilation: what kernels call becomes part of them, and the garbage collector rests meanwhile, no longer and for nobody else."""

from __future__ import annotations

import gc

import numpy as np
import pytest
from numba import config, njit
from numba.extending import overload

from oilsim.backend.jit import FAST, inlined

pytestmark = pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled")
PLAIN = FAST | {"cache": False}


@inlined
def polynomial(x):
    """Long enough that the compiler, if it were asked, might leave it where it is."""
    for power in range(1, 9):
        x += np.sqrt(x * np.float32(power)) / (np.float32(1.0) + x)
    return x


def kernel_of(callee):
    """A kernel that calls `callee` at several places."""

    @njit(**PLAIN)
    def kernel(begin, end, values):
        for i in range(begin, end):
            values[i] = callee(callee(values[i]) + callee(values[i] * np.float32(2.0)))

    return kernel


def calls(kernel, name: str) -> int:
    """How many calls of a function whose name contains `name` are left after the compiler's passes."""
    (code,) = kernel.inspect_llvm().values()
    return sum(" call " in line and name in line for line in code.splitlines())


def test_what_kernels_call_becomes_part_of_them():
    kernel = kernel_of(polynomial)
    kernel(0, 4, np.ones(4, np.float32))
    assert calls(kernel, "polynomial") == 0


def test_the_count_of_calls_sees_one_that_is_left():
    left = njit(**PLAIN | {"_dbg_optnone": True})(polynomial.py_func)
    kernel = kernel_of(left)
    kernel(0, 4, np.ones(4, np.float32))
    assert calls(kernel, "polynomial") > 0


@pytest.fixture
def seen():
    """Whether the collector was at work, as told by a function that numba asks while it compiles."""
    found: list[bool] = []

    def asked():
        raise NotImplementedError

    @overload(asked)
    def implementation():
        found.append(gc.isenabled())
        return lambda: 1

    @njit
    def inner():
        return asked()

    @njit
    def outer():
        return inner() + asked()

    return found, outer


def test_collector_rests_while_numba_compiles(seen):
    found, function = seen
    assert gc.isenabled()
    assert function() == 2
    assert found and not any(found)
    assert gc.isenabled()


def test_collector_that_was_off_stays_off(seen):
    found, function = seen
    gc.disable()
    try:
        function()
        assert found and not gc.isenabled()
    finally:
        gc.enable()


def test_collector_is_back_after_code_that_cannot_be_compiled():
    @njit
    def wrong(x):
        return x.nothing

    with pytest.raises(Exception, match="nothing"):
        wrong(1.0)
    assert gc.isenabled()

"""The progress of a run: kernels that compile are told as such, and count neither as its speed nor as time left."""

from __future__ import annotations

import io
import time
from types import SimpleNamespace
from typing import Any

import pytest
from numba import njit
from rich.console import Console

from scenarios.watch import progress
from scenarios.watch.progress import Compilation, ProgressDisplay


def test_compilation_is_told_once_and_counted() -> None:
    told = io.StringIO()
    with Compilation("sweep", Console(file=told)) as compilation:
        assert (told.getvalue(), compilation.seconds) == ("", 0.0)
        begin = time.monotonic()
        inner = njit(lambda x: x + 1)
        njit(lambda x: 2 * inner(x))(1)  # two compilations, one inside the other
        njit(lambda x: x - 1)(1)
        assert 0.0 < compilation.seconds < time.monotonic() - begin
    counted = compilation.seconds
    njit(lambda x: x - 2)(1)
    assert compilation.seconds == counted
    assert told.getvalue() == "sweep: compiling kernels, once for each version of their source\n"


def test_compiling_counts_neither_as_speed_nor_as_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    told, clock = io.StringIO(), SimpleNamespace(now=100.0)
    monkeypatch.setattr(progress.wall_clock, "monotonic", lambda: clock.now)
    compilation = Compilation("sweep", Console(file=told))
    display = ProgressDisplay("sweep", 300.0, Console(file=told), compilation)
    frame: Any = SimpleNamespace(time=0.0)
    display.step_completed(frame)
    clock.now, compilation.seconds, frame.time = 122.0, 20.0, 10.0
    display.step_completed(frame)
    assert told.getvalue() == "sweep: 3 %, 10.00 of 300 s simulated, 5 x real time, 0:58 left\n"

"""The bench of one test: the runs that it made, the limits that it keeps, and what it leaves."""

from __future__ import annotations

import fcntl
import random
import re
import tempfile
import time as wall_clock
import zlib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np
import pytest

from coupling.master.blas_threads import one_blas_thread
from coupling.master.observer_dispatch import Observer
from coupling.testkit.claims import Reference
from coupling.testkit.left_behind import draw_moment, write_checkpoint, write_recording
from coupling.testkit.readings import History
from coupling.testkit.run import TestRun
from coupling.testkit.verdict import CheckFailed
from recordings.files.checkpoint import CheckpointError
from recordings.files.writing import RecordingError
from recordings.model.frame import Event, Frame, RunDescription

Terms = ParamSpec("Terms")
LONGEST_NAME = 80  # characters of a file's name from a test's; chosen: file systems take 255 with endings


AnyRun = TypeVar("AnyRun", bound=TestRun)


class Limits:
    """The wall time [s] and the number of particles that a test may take, over all of its runs; ValueError for other terms."""

    def __init__(self, marker: pytest.Mark | None) -> None:
        terms, unnamed = ({}, ()) if marker is None else (dict(marker.kwargs), marker.args)
        strange = [*unnamed, *sorted(set(terms) - {"seconds", "particles"})]
        if strange:
            raise ValueError(f"oilsim_limits has {strange}, allowed: seconds=..., particles=...")
        for name, value in terms.items():
            if value is not None and not (isinstance(value, int | float) and value > 0):
                raise ValueError(f"oilsim_limits: {name} is {value!r}, allowed: above 0")
        self.seconds, self.particles = terms.get("seconds"), terms.get("particles")
        self.spent = 0.0

    def watchers(self) -> list[Observer]:
        """Return the observer that keeps a run to the limits; none without limits."""
        return [] if self.seconds is None and self.particles is None else [_Watcher(self)]


class _Watcher(Observer):
    """Counts the steps of one run but the first, in which kernels may be compiled; CheckFailed beyond a limit."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._before: float | None = None
        self._seen = 0

    def step_completed(self, frame: Frame) -> None:
        """Count time and particles."""
        limits, now = self._limits, wall_clock.perf_counter()
        self._seen += 1
        if limits.particles is not None and self._seen == 1:
            count = sum(len(phase.id) for phase in frame.phases.values())
            if count > limits.particles:
                raise LimitExceeded(f"the run has {count} particles, allowed by oilsim_limits: {limits.particles}")
        if self._before is not None and self._seen > 2:
            limits.spent += now - self._before
        if limits.seconds is not None and limits.spent > limits.seconds:
            raise LimitExceeded(
                f"steps have taken {limits.spent:.3g} s, allowed by oilsim_limits: {limits.seconds:g} s"
            )
        self._before = wall_clock.perf_counter()


class LimitExceeded(AssertionError):
    """A test takes more time or particles than its marker allows."""


class TestBench:
    """Makes the runs of one test, watches them, and closes them at its end.

    test: its name, from which the seed follows. keeps_frames: keep frames with particles for a recording. marker: `oilsim_limits`.
    is_updating: references are renewed. worker: this process shares the machine with other workers.
    """

    __test__ = False  # for pytest: no test

    def __init__(
        self, test: str, *, keeps_frames: bool, marker: pytest.Mark | None, is_updating: bool, worker: bool
    ) -> None:
        self.test, self.seed = test, zlib.crc32(test.encode())
        self._keeps_frames, self._is_updating, self._worker = keeps_frames, is_updating, worker
        self._limits = Limits(marker)
        self._runs: list[TestRun] = []
        self._stack = ExitStack()

    def __enter__(self) -> TestBench:
        self._stack.enter_context(one_blas_thread())
        self._stack.enter_context(_seeded(self.seed))
        Reference.is_updated = self._is_updating
        return self

    def __exit__(self, *_: object) -> None:
        Reference.is_updated = False
        for run in reversed(self._runs):
            self._stack.callback(run.close)
        self._stack.close()

    def at_end(self, call: Callable[..., object], *arguments: object) -> None:
        """Call a function at the end of the test."""
        self._stack.callback(call, *arguments)

    def making(self, make: Callable[Terms, AnyRun]) -> Callable[Terms, AnyRun]:
        """Return a function that makes runs as `make` does, watches and later closes them."""

        @wraps(make)
        def made(*arguments: Terms.args, **keywords: Terms.kwargs) -> AnyRun:
            run = make(*arguments, **keywords)
            run.history = History(keeps_particles=self._keeps_frames)
            for watcher in [*self._limits.watchers(), *([_FirstStep()] if self._worker else [])]:
                run.watch(watcher)
            self._runs.append(run)
            return run

        return made

    def leave(self, folder: Path, failure: BaseException | None) -> list[tuple[str, Path]]:
        """Write recording, checkpoint and picture of each run, and return their paths, each with a word for it.

        The picture marks the bodies that a failed check names. A run that has not begun leaves nothing, and one whose state cannot be saved
        no checkpoint.
        """
        left: list[tuple[str, Path]] = []
        begun = [run for run in self._runs if run.history.run is not None and run.history.frames]
        if begun:
            folder.mkdir(parents=True, exist_ok=True)
        for number, run in enumerate(begun):
            base = folder / (_file_name(self.test) + (f"-{number + 1}" if len(begun) > 1 else ""))
            for what, ending, write in (
                ("recording", ".rrd", self._record),
                ("checkpoint", ".npz", self._save),
                ("picture", ".png", self._draw),
            ):
                path = base.with_name(base.name + ending)
                with suppress(RecordingError, CheckpointError, NotImplementedError, RuntimeError):
                    if write(run, path, failure):
                        left.append((what, path))
        return left

    def _record(self, run: TestRun, path: Path, failure: BaseException | None) -> bool:
        run.history.keep_last(run.last_frame())
        if failure is not None:
            run.history.events.append(Event(run.history.frames[-1].time, _one_line(failure), "error", "test"))
        write_recording(run.history, path)
        return True

    def _save(self, run: TestRun, path: Path, failure: BaseException | None) -> bool:
        simulation = run.simulation
        if not simulation.is_running:
            return False
        words = {"test": self.test, "run": run.history.run.name if run.history.run else "", "seed": self.seed}
        write_checkpoint(simulation.save_state(), run.history.frames[-1], words, path)
        return True

    def _draw(self, run: TestRun, path: Path, failure: BaseException | None) -> bool:
        marked = failure.bodies if isinstance(failure, CheckFailed) else (getattr(failure, "participant", ""),)
        frame = run.history.frames[-1]
        moment = failure.time if isinstance(failure, CheckFailed) else None
        if moment is not None:
            frame = min(run.history.frames, key=lambda one: abs(one.time - moment))
        draw_moment(run.history, frame, marked, "" if failure is None else _one_line(failure), path)
        return True


class _FirstStep(Observer):
    """Lets one worker at a time make the first step of a run, so that the first compiles the kernels and the others load them."""

    def __init__(self) -> None:
        self._lock = ExitStack()

    def initialized(self, run: RunDescription) -> None:
        """Wait for the other workers' first steps."""
        file = self._lock.enter_context((Path(tempfile.gettempdir()) / f"oilsim-first-step-{_user()}").open("w"))
        fcntl.flock(file, fcntl.LOCK_EX)

    def step_completed(self, frame: Frame) -> None:
        """Let the others go on after the first step."""
        if frame.index > 0:
            self._lock.close()

    def terminated(self, reason: str) -> None:
        """Let the others go on."""
        self._lock.close()


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    """Seed the global random numbers of Python and numpy within the block, and put their states back."""
    states = random.getstate(), np.random.get_state()  # noqa: NPY002
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002
    try:
        yield
    finally:
        random.setstate(states[0])
        np.random.set_state(states[1])  # noqa: NPY002


def _user() -> int:
    import os

    return os.getuid()


def _file_name(test: str) -> str:
    """Return a name for files from the name of a test, unlike that of others."""
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "-", test.rpartition("/")[2]).strip("-")
    return plain if len(plain) <= LONGEST_NAME else f"{plain[: LONGEST_NAME - 9]}-{zlib.crc32(test.encode()):08x}"


def _one_line(failure: BaseException) -> str:
    return " ".join(str(failure).split())[:600] or type(failure).__name__

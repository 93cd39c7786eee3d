"""Run tests with a fault in place, in a fork of a process that has loaded the libraries and none of oilsim."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from tests.mutants.mutations import Mutant
from tests.mutants.nearness import PACKAGES

LIBRARIES = (
    "numpy", "numba", "scipy.spatial", "scipy.sparse.linalg", "scipy.optimize", "trimesh", "rerun", "pyarrow", "matplotlib.pyplot",
    "pytest", "cattrs", "rich.console", "rich.table", "jinja2", "pybullet",
)  # fmt: skip
LONGEST = 200  # [s] of processor time of one test; a fault that makes it longer is noticed, because tests are quick
WAITED = 1500.0  # [s] of a trial, by the clock: a test that sleeps so long is a fault that is noticed


class Outcome(NamedTuple):
    """The end of a trial: the test that failed, or "" if none did; seconds of processor time; and seconds by file of tests."""

    failed: str
    seconds: float
    durations: dict[str, float]


class Watch:
    """A plugin of pytest: notes the first failure and the time of each file, and ends the session when its time is over."""

    def __init__(self, report: Path, limit: float) -> None:
        self._report, self._limit, self._durations = report, limit, dict[str, float]()
        self.failed, self.test = "", ""

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.test, self._begun = nodeid, _processor_time()
        signal.setitimer(signal.ITIMER_PROF, LONGEST)  # its signal ends the process, in a compiled loop, too
        self.write()

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.failed = self.failed or report.nodeid

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed:
            self.failed = self.failed or str(report.nodeid)

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        file = nodeid.partition("::")[0]
        self._durations[file] = self._durations.get(file, 0.0) + _processor_time() - self._begun
        self.test = ""
        self.write()

    def pytest_runtest_protocol(self, item: Any) -> None:
        if _processor_time() > self._limit:
            item.session.shouldstop = "the trial's time is over"

    def write(self) -> None:
        """Leave what is known where the parent finds it, should this process be ended."""
        self._report.write_text(json.dumps([self.failed, self.test, self._durations]))


def preload() -> None:
    """Import the libraries once for all trials."""
    for name in LIBRARIES:
        __import__(name)


@contextmanager
def fault_in_place(fault: Mutant, stale: set[Path], cache: Path) -> Iterator[Path]:
    """Put a fault into its file, and yield a cache without the kernels that it may change; kernels of others are kept for later trials."""
    before, trial_cache = fault.file.read_bytes(), cache.with_name("trial-cache")
    stems = {file.stem for file in stale}
    shutil.rmtree(trial_cache, ignore_errors=True)
    shutil.copytree(
        cache, trial_cache, copy_function=os.link,
        ignore=lambda _, names: [name for name in names if name.partition(".")[0] in stems],
    )  # fmt: skip
    try:
        fault.file.write_text(fault.apply())
        yield trial_cache
    finally:
        stamp = fault.file.stat()
        fault.file.write_bytes(before)
        os.utime(fault.file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns + 10**9))
        _keep(trial_cache, cache, stems)


def _keep(trial_cache: Path, cache: Path, stems: set[str]) -> None:
    """Move new kernels of sound files to the cache that trials share."""
    for file in trial_cache.rglob("*.nb?"):
        kept = cache / file.relative_to(trial_cache)
        if file.name.partition(".")[0] not in stems and not (kept.exists() and kept.samefile(file)):
            kept.parent.mkdir(parents=True, exist_ok=True)
            file.replace(kept)


def run_tests(tests: list[str], cache: Path, seconds: float, first_failure: bool = True) -> Outcome:
    """Run tests in a fork until one fails or `seconds` of processor time are over."""
    with tempfile.TemporaryDirectory(prefix="oilsim-mutant-") as folder:
        report = Path(folder, "report.json")
        begun, before = time.monotonic(), os.times()
        child = os.fork()
        if child == 0:
            _run(tests, cache, report, seconds, first_failure)
        status = _ended(child, begun + WAITED)
        after = os.times()
        spent = after.children_user + after.children_system - before.children_user - before.children_system
        failed, test, durations = json.loads(report.read_text()) if report.exists() else ("", "", {})
    if not failed and status not in (0, 1, 2, 5):  # 2: its time was over; 5: no test was collected
        failed = test or "pytest itself"
    return Outcome(failed, spent, durations)


def _run(tests: list[str], cache: Path, report: Path, seconds: float, first_failure: bool) -> NoReturn:
    """Run pytest in the child, on the modules of the present folder."""
    import numba
    import pytest

    os.setpgid(0, 0)
    silence = os.open(os.environ.get("MUTANTS_LOG", os.devnull), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    os.environ |= {"PYTHONPATH": str(Path.cwd()), "NUMBA_CACHE_DIR": str(cache), "TMPDIR": str(report.parent)}
    tempfile.tempdir = str(report.parent)
    numba.config.CACHE_DIR = str(cache)
    for name in [name for name in sys.modules if name.partition(".")[0] in (*PACKAGES, "tests")]:
        del sys.modules[name]
    sys.path[:] = [str(Path.cwd()), *(place for place in sys.path if not Path(place, "oilsim").is_dir())]
    watch, code = Watch(report, seconds), 3
    try:
        quick = [
            "-q",
            "-p",
            "no:cacheprovider",
            "-p",
            "no:xdist",
            "-o",
            "timeout=0",
            *(["-x"] if first_failure else []),
        ]
        code = pytest.main([*quick, *tests], plugins=[watch])
    finally:
        watch.write()
        os._exit(code)


def _ended(child: int, until: float) -> int:
    """Wait for the child, and end it and what it started if its time is over; return its exit code, minus a signal's number."""
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > until:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return -signal.SIGKILL
        time.sleep(0.05)


def _processor_time() -> float:
    """Return the processor time [s] of this process and of those it started and waited for."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system

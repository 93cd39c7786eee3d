"""Run tests with a fault in its file, in a fork of a process that has loaded the libraries and none of oilsim."""

from __future__ import annotations

import json
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from tests.mutants.mutations import Mutant
from tests.mutants.nearness import PACKAGES

LIBRARIES = (
    "numpy", "numba", "scipy.spatial", "scipy.sparse.linalg", "scipy.optimize", "trimesh", "pyarrow", "matplotlib.pyplot",
    "pytest", "cattrs", "rich.console", "rich.table", "jinja2", "pybullet",
)  # fmt: skip
QUIET = ("-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-o", "timeout=0")
LONGEST = 200  # [s] of processor time of one test; a fault that makes it longer is noticed, because tests are quick
STILL = 30.0  # [s] with less than a second of processor time, after which a fork stands: it lacks a library's threads
WAITED = 1500.0  # [s] of a trial, by the clock: a test that sleeps so long is a fault that is noticed


class Outcome(NamedTuple):
    """The end of a trial: the test that failed, or "" if none did, how many ran, and seconds of processor time."""

    failed: str
    tests: int
    seconds: float


class Watch:
    """A plugin of pytest: notes the first failure, and leaves it where the parent finds it should this process be ended."""

    def __init__(self, report: Path, limit: float) -> None:
        self._report, self._limit, self._tests = report, limit, 0
        self.failed, self.running = "", ""

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.running, self._tests = nodeid, self._tests + 1
        signal.setitimer(signal.ITIMER_PROF, LONGEST)  # its signal ends the process, in a compiled loop, too
        self.write()

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.failed = self.failed or report.nodeid

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed:
            self.failed = self.failed or str(report.nodeid)

    def pytest_runtest_logfinish(self) -> None:
        self.running = ""
        self.write()

    def pytest_runtest_protocol(self, item: Any) -> None:
        if processor_time() > self._limit:
            item.session.shouldstop = "the trial's time is over"

    def write(self) -> None:
        self._report.write_text(json.dumps([self.failed, self.running, self._tests]))


def preload() -> None:
    """Import the libraries once for all trials, with linear algebra on one thread, as tests have it."""
    for library in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    for name in LIBRARIES:
        __import__(name)


@contextmanager
def fault_in_place(fault: Mutant, stale: set[Path], cache: Path) -> Iterator[Path]:
    """Put a fault into its file, and yield a cache without the kernels that it may change; kernels of others are kept for later trials."""
    before, stamp, trial_cache = fault.file.read_bytes(), fault.file.stat(), cache.with_name("trial-cache")
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
        fault.file.write_bytes(before)
        os.utime(fault.file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
        _keep(trial_cache, cache, stems)


def _keep(trial_cache: Path, cache: Path, stems: set[str]) -> None:
    """Move new kernels of sound files to the cache that trials share."""
    for file in trial_cache.rglob("*.nb?"):
        kept = cache / file.relative_to(trial_cache)
        if file.name.partition(".")[0] not in stems and not (kept.exists() and kept.samefile(file)):
            kept.parent.mkdir(parents=True, exist_ok=True)
            file.replace(kept)


def run_tests(tests: list[str], cache: Path, seconds: float) -> Outcome:
    """Run tests in a fork until one fails or `seconds` of processor time are over."""
    with tempfile.TemporaryDirectory(prefix="oilsim-mutant-") as folder:
        report = Path(folder, "report.json")

        def call() -> None:
            import pytest

            enter(cache, Path(folder))
            watch = Watch(report, processor_time() + seconds)
            pytest.main([*QUIET, "-x", *tests], plugins=[watch])
            watch.write()

        status, spent = forked(call)
        failed, running, count = json.loads(report.read_text()) if report.exists() else ("", "pytest", 0)
    return Outcome(failed or (running if status else ""), count, spent)


def forked(call: Callable[[], None]) -> tuple[int, float]:
    """Call in a fork of this process; return its exit code, minus a signal's number, and the processor time [s] it took."""
    before, until, used, moved = processor_time(), time.monotonic() + WAITED, 0, time.monotonic()
    child = os.fork()
    if child == 0:
        try:
            os.setpgid(0, 0)
            call()
            os._exit(0)
        finally:
            os._exit(1)
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status), processor_time() - before
        if abs((now := _ticks(child)) - used) > os.sysconf("SC_CLK_TCK"):
            used, moved = now, time.monotonic()
        if time.monotonic() > min(until, moved + STILL):
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return -signal.SIGKILL, processor_time() - before
        time.sleep(0.1)


def _ticks(group: int) -> int:
    """Count the clock ticks of processor time that the living processes of a group have had."""
    total = 0
    for file in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended
            told = file.read_text().rpartition(")")[2].split()
            total += int(told[11]) + int(told[12]) if int(told[2]) == group else 0
    return total


def enter(cache: Path, folder: Path) -> None:
    """Make this process, a fork, see the modules of the present folder only, a cache of kernels, and a folder for temporary files."""
    import numba

    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    os.environ |= {"PYTHONPATH": str(Path.cwd()), "NUMBA_CACHE_DIR": str(cache), "TMPDIR": str(folder)}
    tempfile.tempdir, numba.config.CACHE_DIR = str(folder), str(cache)
    for name in [name for name in sys.modules if name.partition(".")[0] in (*PACKAGES, "tests")]:
        del sys.modules[name]
    sys.path[:] = [str(Path.cwd()), *(place for place in sys.path if not Path(place, "oilsim").is_dir())]


def processor_time() -> float:
    """Return the processor time [s] of this process and of those it started and waited for."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system

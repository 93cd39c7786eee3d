"""One trial: a call of oilsim in a copy of this process, in an empty folder, with a limit of time and of memory."""

from __future__ import annotations

import faulthandler
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

LONGEST = 10  # s of processor time of a trial; a busy machine may let it wait longer
WAITED = 90.0  # s after which a trial that sleeps is ended
LARGEST = 1 << 30  # bytes that a trial may take beside those of this process
SHOWN = 600  # characters of what a failed trial said last


@dataclass(frozen=True)
class Outcome:
    """The end of a trial: its exit code, the time [s] it took, what it said, and the fault in words; "" if there is none."""

    code: int
    seconds: float
    said: str
    fault: str = ""


def tried(call: Callable[[], int]) -> Outcome:
    """Run `call`, which returns an exit code, in a copy of this process whose folder and temporary files are its own."""
    place = Path(tempfile.mkdtemp(prefix="oilsim-fuzz-"))
    (place / "work").mkdir()
    (place / "tmp").mkdir()
    reading, writing = os.pipe()
    begun = time.monotonic()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _run(call, place, writing)
    os.close(writing)
    said = _said(reading, begun + WAITED)
    status = _ended(child, begun + WAITED)
    seconds = time.monotonic() - begun
    runtime = place / "tmp" / f"oilsim-{os.getuid()}"  # of orders to runs: it outlives them, empty
    if runtime.is_dir() and not any(runtime.iterdir()):
        runtime.rmdir()
    left = sorted(str(path.relative_to(place)) for folder in ("work", "tmp") for path in (place / folder).rglob("*"))
    shutil.rmtree(place, ignore_errors=True)
    return Outcome(-1 if status is None else status, seconds, said, _fault(status, said, left))


def _run(call: Callable[[], int], place: Path, writing: int) -> NoReturn:
    """Run the call in the child; nothing comes back but its exit code, and its messages through the pipe."""
    code = 99
    try:
        faulthandler.disable()  # a crash is told by its signal
        os.setpgid(0, 0)  # so that it can be ended with its own children
        os.dup2(writing, 1)
        os.dup2(writing, 2)
        sys.stdout, sys.stderr = (
            os.fdopen(1, "w", buffering=1),
            os.fdopen(2, "w", buffering=1, errors="backslashreplace"),
        )
        os.chdir(place / "work")
        os.environ["TMPDIR"] = tempfile.tempdir = str(place / "tmp")
        size = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * os.sysconf("SC_PAGE_SIZE")
        resource.setrlimit(resource.RLIMIT_AS, (size + LARGEST, size + LARGEST))
        used = int(time.process_time()) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (used + LONGEST, used + LONGEST))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        code = call()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 2
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _said(reading: int, until: float) -> str:
    """Read what the child says until it closes the pipe or its time is over."""
    parts = []
    while (left := until - time.monotonic()) > 0.0 and select.select([reading], [], [], left)[0]:
        part = os.read(reading, 1 << 16)
        if not part:
            break
        parts.append(part)
    os.close(reading)
    return b"".join(parts).decode("utf-8", "replace")


def _ended(child: int, until: float) -> int | None:
    """Wait for the child, and end it if its time is over; returns its exit code, minus a signal's number, or None if it was ended."""
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > until:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return None
        time.sleep(0.001)


def _fault(status: int | None, said: str, left: list[str]) -> str:
    """Say what is wrong with the end of a trial."""
    if status is None:
        return f"slept for {WAITED:g} s"
    if status in (-signal.SIGXCPU, -signal.SIGKILL):
        return f"took more than {LONGEST:g} s"
    if status < 0:
        return f"was ended by {signal.Signals(-status).name}: {said[-SHOWN:]}"
    if "Traceback" in said:
        return f"ended in a traceback: {said[-SHOWN:]}"
    if status not in (0, 1, 2):
        return f"ended with exit code {status}: {said[-SHOWN:]}"
    if status and not said.strip():
        return f"ended with exit code {status} and no word"
    return f"left {', '.join(left[:5])}" if left else ""

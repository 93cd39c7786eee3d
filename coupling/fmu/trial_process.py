"""Tries a program out in a separate process, so that a crash or a hang becomes an error and does not end this process.

Folders of unpacked FMUs, which do not outlive the processes that made them for long.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from pathlib import Path

from recordings.files.writing import module_command, module_environment

FOLDER = re.compile(r"oilsim-(?:fmu|trial)-(\d+)-\w+")


def temporary_folder(kind: str) -> tempfile.TemporaryDirectory[str]:
    """Make a folder, named after this process, that goes with the object returned; `kind` is "fmu" or "trial".

    A process that is killed leaves its folders behind. The next call, by any process of the same user, removes them.
    """
    place = Path(tempfile.gettempdir())
    for left in place.glob("oilsim-*"):
        named = FOLDER.fullmatch(left.name)
        if named and _is_own_folder(left) and not _runs(int(named[1])):
            shutil.rmtree(left, ignore_errors=True)
    return tempfile.TemporaryDirectory(prefix=f"oilsim-{kind}-{os.getpid()}-", ignore_cleanup_errors=True)


def _is_own_folder(path: Path) -> bool:
    """Tell whether a path is a folder of this user, not a link; false if another process has removed it since it was listed."""
    try:
        found = path.lstat()
    except FileNotFoundError:
        return False
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()


def _runs(process: int) -> bool:
    """Tell whether a process of that number runs."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


STOPPING = (
    threading.Event()
)  # set by whoever takes signals: the run was asked to stop, and nothing is waited for any more
PATIENCE = 120.0  # s until a program counts as hanging: far above what an exercise takes to be built


def is_own_process() -> bool:
    """Tell whether this Python was started as a program, and so can be started again; false if another program embeds it."""
    return bool(sys.executable and sys.orig_argv)


def try_out(module: str, arguments: Sequence[str]) -> str:
    """Run `python -m module arguments`; return the last line of its error output if it fails, crashes or hangs, else an empty text.

    Its temporary files are removed, however it ends.
    """
    with temporary_folder("trial") as folder:
        try:
            done = subprocess.run(
                module_command(module, *arguments),
                env=module_environment() | {"TMPDIR": folder},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=PATIENCE,
            )
        except subprocess.TimeoutExpired as late:
            said = late.stderr.decode("utf-8", "replace") if isinstance(late.stderr, bytes) else late.stderr or ""
            return f"it does not come back within {PATIENCE:g} s{_last_words(said)}"
    if done.returncode < 0:
        return f"it crashes ({signal.Signals(-done.returncode).name}){_last_words(done.stderr)}"
    return "" if done.returncode == 0 else _last_words(done.stderr).removeprefix(": ")


def suspected_folder() -> str:
    """Name characters in the path of temporary files that make PythonFMU's binary (0.7) crash, as a possible cause of a failure.

    Returns an empty text if there are none.
    """
    folder = tempfile.gettempdir()
    odd = "".join(sorted(set(re.findall(r"[^\w/\\:. ~-]", folder, re.ASCII))))
    allowed = "a TMPDIR of letters a to z, digits, blanks and . _ -"
    return f"; perhaps for the {odd!r} in the path of temporary files {folder!r}, allowed: {allowed}" if odd else ""


def _last_words(said: str) -> str:
    lines = said.strip().splitlines()
    return f": {lines[-1].strip()}" if lines else ""

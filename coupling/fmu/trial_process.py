"""Tries a program out in a separate process, so that a crash or a hang becomes an error and does not end this process."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence

from coupling.fmu.temporary_folder import temporary_folder
from recordings.files.own_programs import module_command, module_environment

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

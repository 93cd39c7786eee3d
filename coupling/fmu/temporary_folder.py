"""Folders of unpacked FMUs, which do not outlive the processes that made them for long."""

from __future__ import annotations

import os
import re
import shutil
import stat
import tempfile
from pathlib import Path

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

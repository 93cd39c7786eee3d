"""Checks of files: paths that must differ, and files that only one program at a time may write.

The error that recordings raise.

Programs of our own that run beside this one: found where this one was found, and never in the folder that happens to be current.

`python -m` puts the current folder first on the path of modules, so that a `numpy.py` there, from an archive that somebody unpacked, would
be run. `-P` leaves it out.
"""

from __future__ import annotations

import fcntl
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path


class RecordingError(RuntimeError):
    """A recording that cannot be written or read; ``path`` is its file, and the text gives the reason."""

    def __init__(self, path: str | Path, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"recording {self.path}: {reason}")


def absence(path: Path) -> str:
    """Say why there is no file to read at a path: a folder is there, or nothing; empty if there is a file."""
    if path.is_file():
        return ""
    return "is a folder, allowed: the file of a recording (.rrd)" if path.is_dir() else "does not exist"


def module_command(module: str, *arguments: str) -> list[str]:
    """Make the command that runs a module as a program; the current folder is not on its path."""
    return [sys.executable, "-P", "-m", module, *arguments]


def module_environment(search: Iterable[str] | None = None) -> dict[str, str]:
    """Copy the environment, with ``search`` as the places of modules: by default those of this program, in that order.

    An empty entry would be the current folder, whichever it is, and is left out.
    """
    places = sys.path if search is None else search
    return os.environ | {"PYTHONPATH": os.pathsep.join(place for place in places if place)}


RECORDING_ENDING = ".rrd"  # the file ending of Rerun


def is_same_file(first: Path, second: Path) -> bool:
    """Tell whether two paths lead to one file or folder, through links as well."""
    if first.resolve() == second.resolve():
        return True
    return first.exists() and second.exists() and first.samefile(second)


def why_unwritable(path: Path) -> str:
    """Give the reason why no file can be written at `path`, without leaving a trace; empty if there is none that can be known now."""
    existed = path.exists()
    if existed and not path.is_file():
        return "is a folder" if path.is_dir() else ""
    try:
        with path.open("ab"):
            pass
    except OSError as error:
        return error.strerror or str(error)
    if not existed:
        path.unlink()
    return ""


def why_no_folder(path: Path) -> str:
    """Give the reason why no files can be written into a folder, or why it cannot be made, without leaving a trace; empty if they can."""
    if path.is_dir():
        return "" if os.access(path, os.W_OK | os.X_OK) else "Permission denied"
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        path.mkdir(parents=True)
    except OSError as error:
        return error.strerror or str(error)
    finally:
        for folder in missing:
            if folder.is_dir():
                folder.rmdir()
    return ""


def write_whole(path: Path, text: str) -> None:
    """Write a text file whole or not at all: whoever reads it meanwhile, or after the power failed, finds the old one or the new.

    What is no plain file, a pipe or a terminal, is written to as it is. OSError if it cannot be written.
    """
    target = path.resolve()
    if target.exists() and not target.is_file():
        path.write_text(text, encoding="utf-8")
        return
    unfinished = target.with_name(f".{os.getpid()}-{target.name}")
    try:
        with unfinished.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(target)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def held(path: Path) -> Iterator[None]:
    """Reserve `path`, a recording or a folder of checkpoints, for this run; RecordingError if another run writes it.

    The lock is advisory and ends with the program, however the program ends. A file that did not exist is created, and removed again if
    nothing was written.
    """
    existed = path.exists()
    try:
        handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise RecordingError(path, f"cannot be written: {error.strerror or error}") from error
    try:
        _lock(path, handle)
        try:
            yield
        finally:
            if not existed and os.fstat(handle).st_size == 0:
                path.unlink(missing_ok=True)
    finally:
        os.close(handle)


def _lock(path: Path, handle: int) -> None:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise RecordingError(path, "is being written by another run, allowed: another file for this run") from error
    except OSError:
        return  # some network drives have no locks

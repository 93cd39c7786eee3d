"""Repair of recordings that were cut off while they were written."""

from __future__ import annotations

import os
import subprocess
import warnings
from pathlib import Path

from rerun.chunk import RrdReader

from recordings.errors import RecordingError
from recordings.files import is_same_file
from recordings.sink.viewer import viewer_environment, viewer_executable

_REPAIR_SECONDS = 600.0
_HEAD = b"RRF2"


def open_reader(path: Path) -> RrdReader:
    """Open a file that is complete, with or without a footer; RecordingError for a file that was cut off."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a killed run leaves no footer, and the user knows that
            reader = RrdReader(path)
            recordings = reader.recordings()
    except RuntimeError as error:
        raise RecordingError(path, f"cannot be read: {error}") from error
    if not recordings:
        raise RecordingError(path, "has no run")
    return reader


def is_whole(path: Path) -> bool:
    """Tell whether the file can be read to its end."""
    try:
        open_reader(path)
    except RecordingError:
        return False
    return True


def has_footer(path: Path) -> bool:
    """Tell whether the file was closed properly and so is complete; without a footer it loads slowly."""
    try:
        open_reader(path).store()
    except (RecordingError, ValueError, RuntimeError):
        return False
    return True


def repaired_path(path: Path) -> Path:
    """Return the path for the repaired copy of a recording."""
    return path.with_name(f"{path.stem}.repaired{path.suffix}")


def repair(path: str | Path, target: str | Path | None = None) -> Path:
    """Write a complete copy, with a footer, of a recording that was cut off; the original is not changed.

    Everything up to the last complete chunk is kept, so at most the last second before the run was killed is lost. Raises RecordingError if
    the file is not a recording or cannot be repaired.

    Returns:
        The copy: ``target``, or the original's name with ".repaired" before its ending.
    """
    source = Path(path)
    if not source.is_file():
        raise RecordingError(source, "does not exist")
    with source.open("rb") as file:
        if file.read(len(_HEAD)) != _HEAD:
            raise RecordingError(source, "is not a Rerun recording, or was cut off before anything was written")
    copy = repaired_path(source) if target is None else Path(target)
    if is_same_file(source, copy):
        raise RecordingError(source, "is the recording to repair itself, allowed: another file for the copy")
    unfinished = copy.with_name(f".{os.getpid()}-{copy.name}")
    command = [viewer_executable(), "rrd", "optimize", str(source), "-o", str(unfinished)]
    done = subprocess.run(
        command, env=viewer_environment(), capture_output=True, text=True, timeout=_REPAIR_SECONDS, check=False
    )
    if done.returncode != 0 or not unfinished.is_file():
        unfinished.unlink(missing_ok=True)
        raise RecordingError(source, f"cannot be repaired: {done.stderr.strip()[-300:]}")
    unfinished.replace(copy)
    return copy

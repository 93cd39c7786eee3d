"""Mends recordings that were cut off in the middle of a write, or damaged: what can be read of them goes into a whole copy."""

from __future__ import annotations

import os
import tempfile
import warnings
from pathlib import Path

from rerun.chunk import RrdReader

from recordings.files.messages import Damage, damage
from recordings.files.writing import RecordingError, absence, is_same_file
from recordings.sink.stream_file import put_in_order

_REPAIR_SECONDS = 600.0


def open_reader(path: Path) -> RrdReader:
    """Open a file that is complete, with or without a footer; RecordingError for a file that was cut off."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a killed run leaves no footer, and the user knows that
            reader = RrdReader(path)
            recordings = reader.recordings()
    except (RuntimeError, ValueError, OSError) as error:
        raise RecordingError(path, f"cannot be read: {error}") from error
    if not recordings:
        raise RecordingError(path, "holds no run of oilsim, or was cut off before one began")
    return reader


def damage_of(path: Path) -> Damage:
    """Find the damage of a recording; RecordingError for one that cannot be opened, or in which nothing can be read."""
    try:
        found = damage(path)
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror or error}") from error
    if not found.sound:
        raise RecordingError(path, "is not a Rerun recording, or was cut off before anything was written")
    return found


def has_footer(path: Path) -> bool:
    """Tell whether the file was closed properly and so is complete; without a footer it loads slowly."""
    try:
        open_reader(path).store()
    except (RecordingError, ValueError, RuntimeError):
        return False
    return True


def is_whole(path: Path) -> bool:
    """Tell whether the file can be read to its end."""
    found = damage_of(path)
    return not found.keeps_from_reading and (has_footer(path) or not found.has_end)


def repaired_path(path: Path) -> Path:
    """Return the path for the repaired copy of a recording."""
    return path.with_name(f"{path.stem}.repaired{path.suffix}")


def repair(path: str | Path, target: str | Path | None = None) -> Path:
    """Write a whole copy of a recording that was cut off or damaged, with a footer; the original stays as it is.

    Every message that can be decoded is kept. Of a file that was cut off at most a second is lost, that in which the run was killed.

    Returns:
        The copy: ``target``, or the original's name with ".repaired" before its ending.

    Raises:
        RecordingError: the recording does not exist, holds nothing that can be read, is itself the target, or cannot be repaired.
    """
    source = Path(path)
    why = absence(source)
    if why:
        raise RecordingError(source, why)
    damage_of(source)
    copy = repaired_path(source) if target is None else Path(target)
    if is_same_file(source, copy):
        raise RecordingError(source, "is the recording to repair itself, allowed: another file for the copy")
    unfinished = copy.with_name(f".{os.getpid()}-{copy.name}")
    try:
        with tempfile.TemporaryDirectory(prefix="oilsim-") as folder:
            sound = Path(folder) / "sound.rrd"
            with sound.open("wb") as file:
                damage(source, file)
            put_in_order(sound, unfinished, _REPAIR_SECONDS)
        unfinished.replace(copy)
    except (OSError, RecordingError) as error:
        why = error.reason if isinstance(error, RecordingError) else str(error.strerror or error)
        raise RecordingError(source, f"cannot be repaired: {why}") from error
    finally:
        unfinished.unlink(missing_ok=True)
    return copy

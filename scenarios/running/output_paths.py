"""Paths that a command writes: apart from what it reads and from each other, over nothing that is there, and names that are free."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping
from pathlib import Path
from types import MappingProxyType

from recordings.files.writing import is_same_file, why_no_folder, why_unwritable
from scenarios.text.problems import Problem, ScenarioError

CHECKPOINTS_ENDING = ".checkpoints"


def checkpoint_folder(recording: Path) -> Path:
    """Return the folder for a recording's checkpoints; it is that of no other recording, since all end in ``.rrd``."""
    return recording.with_suffix(CHECKPOINTS_ENDING)


def free_recording(stem: str | Path, taken: Collection[str] = ()) -> Path:
    """Choose a name that no recording or folder of checkpoints has: ``stem.rrd``, ``stem-2.rrd``, ``stem-3.rrd``, ...; none of `taken`."""
    suffixes = itertools.chain([""], (f"-{number}" for number in itertools.count(2)))
    names = (Path(f"{stem}{suffix}.rrd") for suffix in suffixes)
    free = (name for name in names if not name.exists() and not checkpoint_folder(name).exists())
    return next(name for name in free if name.name not in taken)


def already_there(written: Mapping[str, Path | None]) -> list[Problem]:
    """Find the files, by the name of their option, that are there already; None for an option that is not given, an empty file is none."""
    return [
        Problem(name, f"is {str(path)!r}, which is there already; allowed: another name, or --overwrite to replace it")
        for name, path in written.items()
        if path is not None and path.is_file() and path.stat().st_size > 0  # `held` makes an empty one
    ]


def unwritable(files: Mapping[str, Path | None], folders: Mapping[str, Path | None]) -> list[Problem]:
    """Find the files and folders, by the name of their option, that cannot be written; None for an option that is not given."""
    looks = (
        (files, why_unwritable, "a file in an existing folder"),
        (folders, why_no_folder, "a folder that can be written"),
    )
    return [
        Problem(name, f"is {str(path)!r}, which cannot be written: {reason}; allowed: {allowed}")
        for written, why, allowed in looks
        for name, path in written.items()
        if path is not None and (reason := why(path))
    ]


def require_writable(
    files: Mapping[str, Path | None], folders: Mapping[str, Path | None] = MappingProxyType({})
) -> None:
    """Raise ScenarioError before any work with each file and folder that cannot be written, as `unwritable` finds them."""
    problems = unwritable(files, folders)
    if problems:
        raise ScenarioError(problems, "oilsim")


def require_apart(read: Mapping[str, Path], written: Mapping[str, Path | None]) -> None:
    """Raise ScenarioError unless each file and folder that is written differs from all others; both mappings are by name, None for none."""
    taken = dict(read)
    problems = []
    for name, path in written.items():
        if path is None:
            continue
        other = next((other for other, there in taken.items() if is_same_file(path, there)), None)
        if other is not None:
            problems.append(Problem(name, f"is {str(path)!r}, the same as {other}; allowed: another file or folder"))
        taken[name] = path
    if problems:
        raise ScenarioError(problems, "oilsim")

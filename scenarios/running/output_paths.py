"""Checks that a command writes over nothing that it reads, and into each file and folder once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from recordings.files import is_same_file
from scenarios.problems import Problem, ScenarioError


def require_apart(read: Mapping[str, Path], written: Mapping[str, Path | None]) -> None:
    """ScenarioError unless every file and folder that is written is its own; both by what they are called, None for none."""
    taken = dict(read)
    problems = []
    for name, path in written.items():
        if path is None:
            continue
        other = next((other for other, there in taken.items() if is_same_file(path, there)), None)
        if other is not None:
            problems.append(
                Problem(name, f"is {str(path)!r}, the same as {other}, allowed: a file or folder of its own")
            )
        taken[name] = path
    if problems:
        raise ScenarioError(problems, "oilsim")

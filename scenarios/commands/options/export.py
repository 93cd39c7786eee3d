"""Open a recording for a subcommand, and check the options that such subcommands share."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.text.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from recordings.replay.joined import JoinedReplay

LARGEST_ID = 2**32 - 1


def whole_run(recording: Path) -> JoinedReplay:
    """Open a recording with all those that it goes on from; say so if one of them cannot be read. RecordingError as `Replay`."""
    from recordings.replay.joined import JoinedReplay

    replay = JoinedReplay(recording)
    if replay.missing:
        print(f"oilsim: {recording.name} does not begin at the start of its run: {replay.missing}", file=sys.stderr)
    return replay


def require_some(options: argparse.Namespace, *names: str) -> None:
    """Raise ScenarioError for a call that asks for none of these outputs."""
    if all(getattr(options, name) is None for name in names):
        listed = ", ".join(f"--{name}" for name in names)
        raise ScenarioError([Problem("output", f"is missing, allowed: one or more of {listed}")], "oilsim")


def require_used(options: argparse.Namespace, needs: Mapping[str, Sequence[str]]) -> None:
    """Raise ScenarioError for options that change nothing without others; `needs` names, by option, those of which it needs one."""
    problems = [
        Problem(_spelled(name), f"is given, allowed: only with {' or '.join(map(_spelled, others))}")
        for name, others in needs.items()
        if _is_given(options, name) and not any(_is_given(options, other) for other in others)
    ]
    if problems:
        raise ScenarioError(problems, "oilsim")


def _is_given(options: argparse.Namespace, name: str) -> bool:
    value = getattr(options, name)
    return value is not None and value is not False and value not in ("", [])  # 0 is given


def _spelled(name: str) -> str:
    if name == "scenario":  # which is no option
        return "NAME-or-FILE"
    return f"--{name.replace('_', '-')}"


@contextmanager
def file_errors() -> Iterator[None]:
    """Turn the failure to write a file or folder into a ScenarioError."""
    try:
        yield
    except OSError as error:
        where = str(error.filename or "output")
        raise ScenarioError([Problem(where, f"cannot be written: {error.strerror or error}")], "oilsim") from error


def interval(options: argparse.Namespace) -> float | None:
    """Return the option --every [s]; ScenarioError unless it is above 0."""
    seconds: float | None = options.every
    if seconds is not None and not (math.isfinite(seconds) and seconds > 0.0):
        raise ScenarioError([Problem("--every", f"is {seconds} s, allowed: above 0 s")], "oilsim")
    return seconds


def particle_ids(option: str, text: str) -> tuple[int, ...]:
    """Read the ids of particles, separated by commas; ScenarioError for what is none."""
    try:
        ids = tuple(int(part) for part in text.split(",") if part)
    except ValueError:
        raise ScenarioError(
            [Problem(option, f"is {text!r}, allowed: whole numbers separated by commas")], "oilsim"
        ) from None
    for number in ids:
        if not 0 <= number <= LARGEST_ID:
            raise ScenarioError([Problem(option, f"has {number}, allowed: 0 to {LARGEST_ID}")], "oilsim")
    return ids

"""The command-line arguments that choose a scenario and change it.

Open a recording for a subcommand, and check the options that such subcommands share.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from oilsim.core.quantity import quantities
from scenarios.schema.parsing.structuring import spellings
from scenarios.schema.run_settings import RunSettings
from scenarios.text.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from recordings.replay.joined import JoinedReplay


# Options that change an entry, which --set could change too.
_ENTRIES: Mapping[str, str] = {
    "threads": "run.threads",
    "until": "run.duration",
    "level": "level",
    "fidelity": "fidelity",
    "seed": "run.seed",
}


def add_scenario(parser: argparse.ArgumentParser, *, required: bool = True, seeded: bool = True) -> None:
    """Add the scenario's name, and the options that change it, to a parser; `seeded`: --seed is among them."""
    text = "name of a shipped scenario, or a .toml file"
    parser.add_argument("scenario", metavar="NAME-or-FILE", nargs=None if required else "?", help=text)
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change an entry, for example fluid.particle_spacing=0.06 or phases.oil.dynamic_viscosity=0.1; may be repeated",
    )
    parser.add_argument("--demo", action="store_true", help="shorten the run as the scenario's [demo] table says")
    parser.add_argument(
        "--level", choices=("easy", "normal", "hard"), help="variant of an exercise that has an easy and a hard one"
    )
    parser.add_argument(
        "--fidelity",
        choices=("live", "fine", "none"),
        help="particles in real time, as fine as the exercise has them, or none, of those that it offers",
    )
    if seeded:
        parser.add_argument(
            "--seed", type=int, metavar="N", help="of everything random: gusts, waves, and when injects come (run.seed)"
        )
    parser.add_argument("--threads", type=int, metavar="N", help="number of threads (default: all cores)")
    parser.add_argument(
        "--until", type=float, metavar="S", help="simulated time [s] at which the run ends (default: the scenario's)"
    )


def overrides(options: argparse.Namespace) -> tuple[str, ...]:
    """Collect the texts of --set, and the entries that --threads, --until, --level, --fidelity and --seed change.

    An entry that is changed twice is told. Raises ScenarioError, with the option as the place, for a value that cannot be.
    """
    own = require_run_options(options)
    for text in _twice(options.set, own) if not getattr(options, "told", False) else ():
        print(f"oilsim: {text}", file=sys.stderr)
    options.told = True
    return (*options.set, *(f"{_ENTRIES[option]}={_written(value)}" for option, value in own.items()))


def require_run_options(options: argparse.Namespace) -> dict[str, Any]:
    """Return the options that change an entry of [run]; ScenarioError, with the option as the place, for a value that cannot be."""
    given = {option: getattr(options, option, None) for option in _ENTRIES}
    if not getattr(options, "seeds_run", True):
        given["seed"] = None
    own = {option: value for option, value in given.items() if value is not None}
    problems = list(_impossible(own))
    if problems:
        raise ScenarioError(problems, "oilsim")
    return own


def _written(value: object) -> str:
    return value if isinstance(value, str) else repr(value)


def _impossible(own: Mapping[str, Any]) -> Iterator[Problem]:
    """Yield the options whose number the entry of [run] does not take."""
    limits = quantities(RunSettings)
    for option, value in own.items():
        declared = limits.get(_ENTRIES[option].removeprefix("run."))
        fault = None if declared is None else declared.fault(value)
        if fault:
            yield Problem(f"--{option}", fault)


def _twice(settings: Sequence[str], own: Mapping[str, Any]) -> Iterator[str]:
    """Yield the entries that several settings change, or a setting and an option of its own, however their keys are spelled."""
    written = [*(setting.partition("=")[0].strip() for setting in settings), *(f"--{option}" for option in own)]
    names = {f"--{option}": _ENTRIES[option] for option in own}
    last: dict[str, str] = {}
    for key in written:
        entry = names.get(key) or ".".join(spellings(part.strip())[0] for part in key.split("."))
        if entry in last:
            yield (
                f"{last[entry]} is given twice, the last counts"
                if last[entry] == key
                else f"{key} counts, not {last[entry]}"
            )
        last[entry] = key


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


def particle_ids(text: str) -> tuple[int, ...]:
    """Read the ids of particles, separated by commas; ScenarioError for what is none."""
    try:
        ids = tuple(int(part) for part in text.split(",") if part)
    except ValueError:
        raise ScenarioError(
            [Problem("--ids", f"is {text!r}, allowed: whole numbers separated by commas")], "oilsim"
        ) from None
    for number in ids:
        if not 0 <= number <= LARGEST_ID:
            raise ScenarioError([Problem("--ids", f"has {number}, allowed: 0 to {LARGEST_ID}")], "oilsim")
    return ids

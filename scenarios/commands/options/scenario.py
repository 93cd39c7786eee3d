"""The command-line arguments that choose a scenario and change it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from oilsim.core.quantity import quantities
from scenarios.schema.parsing.structuring import spellings
from scenarios.schema.run_settings import RunSettings
from scenarios.text.problems import Problem, ScenarioError

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

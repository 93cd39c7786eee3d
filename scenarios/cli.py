"""The `oilsim` command: list, check, run and replay scenarios.

Exit codes: 0 done, 2 bad input (what, where, what is allowed), 1 failed run (the recording so far is kept).
What a subcommand needs is imported when it runs, so that listing and checking start fast.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from recordings.errors import RecordingError
from scenarios.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from rich.console import Console

    from scenarios.cost import Cost
    from scenarios.scenario import Scenario

DONE, FAILED, BAD_INPUT = 0, 1, 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    for library in ("OPENBLAS", "OMP", "MKL"):
        # The matrices here are small; a linear algebra library that spins threads of its own takes the cores from the fluid.
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    options = _parser().parse_args(arguments)
    try:
        return int(options.command(options))
    except ScenarioError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except RecordingError as error:
        print(f"oilsim: {error}", file=sys.stderr)
        return BAD_INPUT


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="oilsim",
        description="Oil and sea water around rocks, booms and vessels: scenario files in, recordings out.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    listing = commands.add_parser("list", help="the scenarios that come with the program, and the oils they may name")
    listing.set_defaults(command=_list)
    check = commands.add_parser("check", help="read a scenario and say what a run of it would cost")
    _add_scenario(check)
    check.set_defaults(command=_check)
    run = commands.add_parser("run", help="run a scenario and record it")
    _add_scenario(run)
    _add_run_options(run)
    run.set_defaults(command=_run)
    replay = commands.add_parser("replay", help="open a recording in the viewer")
    replay.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd)")
    replay.set_defaults(command=_replay)
    return parser


def _add_scenario(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scenario", metavar="NAME-or-FILE", help="a shipped scenario's name, or a .toml file")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change an entry, as in fluid.particle_spacing=0.06 or phases.oil.dynamic_viscosity=0.1; may be repeated",
    )
    parser.add_argument("--demo", action="store_true", help="shorten the scenario by its [demo] table first")
    parser.add_argument("--threads", type=int, metavar="N", help="threads of the fluid; all cores by default")
    parser.add_argument("--until", type=float, metavar="S", help="simulated seconds, instead of the scenario's")


def _add_run_options(parser: argparse.ArgumentParser) -> None:
    recording = parser.add_mutually_exclusive_group()
    recording.add_argument("--record", type=Path, metavar="FILE", help="recording to write; NAME.rrd by default")
    recording.add_argument("--no-record", action="store_true", help="record nothing")
    parser.add_argument("--summary", type=Path, metavar="FILE.json", help="write what the run came to")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="draw a picture from the recording")
    parser.add_argument("--live", action="store_true", help="show the run in the viewer while it goes on")


def _overrides(options: argparse.Namespace) -> tuple[str, ...]:
    """The --set texts and those that --threads and --until stand for."""
    extra = []
    if options.threads is not None:
        extra.append(f"run.threads={options.threads}")
    if options.until is not None:
        extra.append(f"run.duration={options.until!r}")
    return (*options.set, *extra)


def _list(_: argparse.Namespace) -> int:
    from rich.console import Console
    from rich.table import Table

    from scenarios.load import library_paths, load_scenario
    from scenarios.oils import OILS

    console = Console()
    console.print("[bold]Scenarios[/bold]: oilsim run NAME")
    table = Table("name", "what it shows", "simulated")
    for name in library_paths():
        scenario = load_scenario(name).scenario
        table.add_row(name, scenario.title, f"{scenario.run.duration:g} s")
    console.print(table)
    console.print('[bold]Oils[/bold] at 15 C: oil = "NAME" in a phase; figures from the ADIOS oil library')
    oils = Table("name", "kg/m3", "Pa s", "what it is")
    for name, oil in OILS.items():
        oils.add_row(name, f"{oil.density:g}", f"{oil.dynamic_viscosity:g}", oil.description)
    console.print(oils)
    return DONE


def _check(options: argparse.Namespace) -> int:
    from rich.console import Console

    from scenarios.cost import estimate
    from scenarios.load import load_scenario

    loaded = load_scenario(options.scenario, overrides=_overrides(options), demo=options.demo)
    _print_cost(Console(), loaded.scenario, estimate(loaded.scenario))
    return DONE


def _print_cost(console: Console, scenario: Scenario, cost: Cost) -> None:
    from rich.table import Table

    console.print(f"[bold]{scenario.name}[/bold]: {scenario.title}")
    table = Table(show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    for phase, count in cost.particles.items():
        poured = cost.emitted.get(phase, 0)
        volume = f" ({_volume(count * scenario.fluid.particle_spacing**3)})" if scenario.fluid.dimension == 3 else ""
        table.add_row(f"{phase} particles", f"{count:,}{volume}" + (f", up to {poured:,} from pipes" if poured else ""))
    for name, count in cost.boundary.items():
        table.add_row(f"{name} surface particles", f"about {count:,}")
    table.add_row("simulated", f"{scenario.run.duration:g} s in about {cost.steps:,} steps")
    table.add_row("memory", f"about {cost.memory / 1e9:.1f} GB")
    table.add_row(f"time on {cost.threads} threads", f"about {_duration(cost.seconds)}")
    console.print(table)
    console.print(
        "Estimated from the cost per particle and step measured on two x86 cores; splashing takes longer.", style="dim"
    )


def _volume(volume: float) -> str:
    """A volume [m3] in words, to three figures."""
    return f"{volume:.3g} m3" if volume >= 1.0 or volume == 0.0 else f"{1e3 * volume:.3g} l"


def _duration(seconds: float) -> str:
    """A time in words, to two figures."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = seconds / 60.0
    return f"{minutes:.0f} min" if minutes < 90.0 else f"{minutes / 60.0:.1f} h"


def _run(options: argparse.Namespace) -> int:
    if options.picture is not None and options.no_record:
        raise ScenarioError(
            [Problem("--picture", "is drawn from the recording, allowed: without --no-record")], "oilsim"
        )
    if options.live and options.no_record:
        raise ScenarioError([Problem("--live", "shows what is recorded, allowed: without --no-record")], "oilsim")
    if options.until is not None and not (math.isfinite(options.until) and options.until > 0.0):
        raise ScenarioError([Problem("--until", f"is {options.until}, allowed: above 0 s")], "oilsim")
    from scenarios.load import load_scenario
    from scenarios.run import RunOptions, run_scenario

    loaded = load_scenario(options.scenario, overrides=_overrides(options), demo=options.demo)
    record = None if options.no_record else options.record or Path(f"{loaded.scenario.name}.rrd")
    return run_scenario(
        loaded.scenario,
        text=loaded.text,
        options=RunOptions(
            record=record,
            summary=options.summary,
            picture=options.picture,
            live=options.live,
            overrides=_overrides(options),
        ),
    )


def _replay(options: argparse.Namespace) -> int:
    from recordings.repair import is_whole, repair
    from recordings.viewer import ViewerError, open_viewer

    recording: Path = options.recording
    if recording.is_file() and not is_whole(recording):
        recording = repair(recording)
        print(f"oilsim: {options.recording} was cut off; what could be saved is in {recording}", file=sys.stderr)
    try:
        open_viewer(recording)
    except ViewerError as error:
        print(f"oilsim: {error}", file=sys.stderr)
        return FAILED
    return DONE


if __name__ == "__main__":
    sys.exit(main())

"""`oilsim run`: run a scenario and record it, or continue a run from a checkpoint."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from recordings.files.writing import RECORDING_ENDING
from scenarios.commands.options import add_scenario, overrides
from scenarios.running.output_paths import free_recording
from scenarios.text.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from scenarios.running.run import RunOptions


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("run", help="run a scenario and record it, or continue a recorded run")
    add_scenario(parser, required=False)
    _add_run_options(parser)
    _add_resume_options(parser)
    parser.set_defaults(command=_run)


def _add_run_options(parser: argparse.ArgumentParser) -> None:
    recording = parser.add_mutually_exclusive_group()
    recording.add_argument(
        "--record",
        type=Path,
        metavar="FILE.rrd",
        help="recording to write (default: NAME.rrd, or NAME-2.rrd if that is there)",
    )
    recording.add_argument("--no-record", action="store_true", help="run without a recording")
    parser.add_argument("--summary", type=Path, metavar="FILE.json", help="write a summary of the results")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="draw a picture of the run")
    parser.add_argument("--live", action="store_true", help="show the run in the viewer while it runs")
    parser.add_argument(
        "--overwrite",
        action="store_true",
        help="let this run replace the recording, summary or picture of an earlier one",
    )
    parser.add_argument(
        "--pace",
        type=float,
        metavar="X",
        help="keep to the clock: X simulated seconds a second (default: as fast as it can)",
    )
    parser.add_argument(
        "--checkpoints", type=Path, metavar="FOLDER", help="folder for saved states (default: FILE.checkpoints)"
    )


def _add_resume_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--resume",
        type=Path,
        metavar="FILE",
        help="continue a recorded run from its last checkpoint, or from this checkpoint file",
    )
    parser.add_argument(
        "--at",
        type=float,
        metavar="S",
        help="with --resume: go back to simulated time S [s]; --set then gives orders from that time on",
    )
    parser.add_argument(
        "--keep-orders",
        action="store_true",
        help="with --at: give all later orders of instructor and crews again, as in the recorded run: what if --set had been ordered?",
    )


def _run(options: argparse.Namespace) -> int:
    problems = list(_contradictions(options))
    if problems:
        raise ScenarioError(problems, "oilsim")
    if options.resume is not None:
        return _resume(options)
    from scenarios.running.run import run_scenario
    from scenarios.spec.load import load_scenario

    loaded = load_scenario(options.scenario, overrides=overrides(options), demo=options.demo)
    record = None if options.no_record else options.record or free_recording(loaded.scenario.name)
    return run_scenario(
        loaded.scenario,
        text=loaded.text,
        overrides=overrides(options),
        options=_run_options(options, record, loaded.path),
    )


def _resume(options: argparse.Namespace) -> int:
    from scenarios.running.checkpoints import find_restart
    from scenarios.running.plan import Plan
    from scenarios.running.run import resume
    from scenarios.spec.load import load_scenario

    named = source = None
    if options.scenario is not None:
        loaded = load_scenario(options.scenario, demo=options.demo)
        named, source = Plan(scenario=loaded.scenario).fingerprint(0), loaded.path
    restart = find_restart(options.resume, options.at, named)
    orders_of = options.resume if options.keep_orders else None
    restart = restart.with_settings(overrides(options), options.at, orders_of)
    record = None
    if not options.no_record:
        record = options.record or _branch(options.resume, restart.time if options.at is None else options.at)
    return resume(restart, options=_run_options(options, record, source))


def _branch(source: Path, at: float) -> Path:
    """Choose a free name for the recording of a continued run: ``sweep-from-12s.rrd``, ``sweep-from-12s-2.rrd``, ..."""
    stem = source.parent.stem if source.suffix == ".npz" else source.stem
    return free_recording(f"{stem}-from-{at:g}s")


def _run_options(options: argparse.Namespace, record: Path | None, source: Path | None) -> RunOptions:
    from scenarios.running.run import RunOptions

    return RunOptions(
        record=record,
        checkpoints=options.checkpoints,
        summary=options.summary,
        picture=options.picture,
        live=options.live,
        overwrite=options.overwrite,
        source=source,
        takes_orders=True,
        pace=options.pace,
    )


def _contradictions(options: argparse.Namespace) -> Iterator[Problem]:
    """Find options that cannot be asked for together, or at all."""
    if options.no_record:
        for name, what in (("picture", "needs a recording"), ("live", "needs a recording")):
            if getattr(options, name):
                yield Problem(f"--{name}", f"{what}, allowed: only without --no-record")
    if options.at is not None and not (math.isfinite(options.at) and options.at > 0.0):
        yield Problem("--at", f"is {options.at} s, allowed: above 0 s")
    if options.pace is not None and not (math.isfinite(options.pace) and options.pace > 0.0):
        yield Problem("--pace", f"is {options.pace}, allowed: above 0, for example 1 for real time")
    if options.resume is None and options.scenario is None:
        yield Problem("NAME-or-FILE", "is missing, allowed: a scenario's name or file, or --resume FILE")
    if options.demo and options.resume is not None and options.scenario is None:
        yield Problem("--demo", "needs a scenario, allowed: with --resume FILE only if the scenario is named too")
    if options.resume is None and options.at is not None:
        yield Problem("--at", "needs --resume, allowed: --resume FILE --at S")
    if options.keep_orders and (
        options.resume is None or options.at is None or options.resume.suffix != RECORDING_ENDING
    ):
        yield Problem("--keep-orders", "needs --resume and --at, allowed: --resume RECORDING.rrd --at S --keep-orders")

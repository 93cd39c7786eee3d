"""`oilsim run`: run a scenario and record it."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from scenarios.commands.scenario_options import add_scenario, overrides
from scenarios.problems import Problem, ScenarioError


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = commands.add_parser("run", help="run a scenario and record it")
    add_scenario(parser)
    _add_run_options(parser)
    parser.set_defaults(command=_run)


def _add_run_options(parser: argparse.ArgumentParser) -> None:
    recording = parser.add_mutually_exclusive_group()
    recording.add_argument("--record", type=Path, metavar="FILE", help="recording to write; NAME.rrd by default")
    recording.add_argument("--no-record", action="store_true", help="record nothing")
    parser.add_argument("--summary", type=Path, metavar="FILE.json", help="write what the run came to")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="draw a picture from the recording")
    parser.add_argument("--live", action="store_true", help="show the run in the viewer while it goes on")


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

    loaded = load_scenario(options.scenario, overrides=overrides(options), demo=options.demo)
    record = None if options.no_record else options.record or Path(f"{loaded.scenario.name}.rrd")
    return run_scenario(
        loaded.scenario,
        text=loaded.text,
        options=RunOptions(
            record=record,
            summary=options.summary,
            picture=options.picture,
            live=options.live,
            overrides=overrides(options),
        ),
    )

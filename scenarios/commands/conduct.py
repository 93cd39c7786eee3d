"""`oilsim conduct`: run an exercise with a console for its instructor and crews, a page in the browser."""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.commands.options import add_scenario, overrides
from scenarios.running.output_paths import free_recording, unwritable
from scenarios.spec.scenario import rest_settings
from scenarios.text.problems import Problem, ScenarioError, reason_of

if TYPE_CHECKING:
    from scenarios.conduct.conducted_run import Errand


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("conduct", help="run an exercise live, with pages for instructor, crews and observers")
    add_scenario(parser, required=False)
    parser.add_argument(
        "--resume",
        type=Path,
        metavar="FILE.rrd",
        help="go on with a recorded run where it ended, after a crash for example; --set then gives orders there",
    )
    parser.add_argument("--at", type=float, metavar="S", help="with --resume: go on from simulated time S [s]")
    parser.add_argument(
        "--record", type=Path, metavar="FILE.rrd", help="recording to write (default: NAME.rrd, or NAME-2.rrd)"
    )
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen at, only with --password (default: 127.0.0.1)"
    )
    parser.add_argument("--port", type=int, default=0, help="port to listen at (default: a free one)")
    parser.add_argument(
        "--password",
        metavar="FILE",
        type=Path,
        help="file whose first line is a password that pages ask for besides the address",
    )
    parser.add_argument(
        "--pace", type=float, default=1.0, metavar="X", help="simulated seconds a second at the start (default: 1)"
    )
    parser.add_argument(
        "--plan",
        action="store_true",
        help="let vessels and skimmers follow the exercise's own orders, not begin at rest",
    )
    parser.add_argument("--no-browser", action="store_true", help="only print the addresses of the pages")
    parser.add_argument(
        "--no-scene", action="store_true", help="leave out the 3-D view, which costs a slow machine time"
    )
    parser.set_defaults(command=_conduct)


def _conduct(options: argparse.Namespace) -> int:
    password = _password(options)
    _require_possible(options)
    from scenarios.conduct.console import ConsoleOptions, conduct

    errand, vessels = _new(options) if options.resume is None else _resumed(options)
    console = ConsoleOptions(
        host=options.host,
        port=options.port,
        password=password,
        opens=not options.no_browser and sys.stdout.isatty(),
        shows_scene=not options.no_scene,
    )
    try:
        return conduct(errand, vessels, console)
    except OSError as error:
        text = f"cannot be served at {options.host}:{options.port}: {error.strerror or error}; allowed: a free port of this machine"
        raise ScenarioError([Problem("the console", text)], "oilsim") from error


def _new(options: argparse.Namespace) -> tuple[Errand, list[str]]:
    """Return the errand of a run from its start, and the names of its vessels."""
    from scenarios.conduct.conducted_run import Errand
    from scenarios.spec.load import load_scenario

    chosen = overrides(options)
    loaded = load_scenario(options.scenario, overrides=chosen, demo=options.demo)
    if not options.plan:
        chosen = (*rest_settings(loaded.scenario), *chosen)
    record = options.record or free_recording(loaded.scenario.name)
    errand = Errand(scenario=options.scenario, record=record, overrides=chosen, demo=options.demo, pace=options.pace)
    return errand, list(loaded.scenario.vessels)


def _resumed(options: argparse.Namespace) -> tuple[Errand, list[str]]:
    """Return the errand that resumes a recorded run, and the names of its vessels; ScenarioError where it cannot go on."""
    from scenarios.conduct.conducted_run import Errand, end_and_names, restart_of

    end, taken = end_and_names(options.resume)
    at = end if options.at is None else options.at
    record = options.record or free_recording(f"{options.resume.stem.partition('-from-')[0]}-from-{at:g}s", taken)
    if record.name in taken:  # branches are known by the names of their recordings
        raise ScenarioError(
            [Problem("--record", f"is {record.name}, a recording of the run that is resumed, allowed: another name")],
            "oilsim",
        )
    name, settings = options.resume.stem, overrides(options)
    errand = Errand(scenario=name, record=record, source=options.resume, at=at, settings=settings, pace=options.pace)
    scenario = restart_of(errand).plan.scenario
    return replace(errand, scenario=scenario.name), list(scenario.vessels)


def _password(options: argparse.Namespace) -> str | None:
    """Read the password; ScenarioError where there is none and one is needed."""
    if options.password is None:
        return None
    try:
        lines = options.password.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError as error:
        text = f"is {str(options.password)!r}, which is not text in UTF-8, allowed: save it as UTF-8"
        raise ScenarioError([Problem("--password", text)], "oilsim") from error
    except OSError as error:
        raise ScenarioError([Problem("--password", f"cannot be read: {reason_of(error)}")], "oilsim") from error
    if not lines or len(lines[0]) < 8:
        raise ScenarioError(
            [Problem("--password", "is shorter than 8 letters, allowed: 8 or more, on the first line")], "oilsim"
        )
    return str(lines[0])


def _require_possible(options: argparse.Namespace) -> None:
    """Raise ScenarioError with every option that cannot be."""
    problems = []
    if (options.scenario is None) == (options.resume is None):
        text = "is missing, allowed: a scenario's name or file, or --resume FILE.rrd"
        again = "is given beside --resume, allowed: one of them"
        problems.append(Problem("NAME-or-FILE", text if options.resume is None else again))
    if options.at is not None and not (options.resume is not None and math.isfinite(options.at) and options.at > 0.0):
        problems.append(Problem("--at", f"is {options.at:g} s, allowed: with --resume FILE.rrd, above 0 s"))
    if options.host not in ("127.0.0.1", "localhost", "::1") and options.password is None:
        text = f"is {options.host!r}, which others can reach; allowed: with --password FILE only"
        problems.append(Problem("--host", text))
    if not 0 <= options.port <= 65535:
        problems.append(Problem("--port", f"is {options.port}, allowed: 0 to 65535"))
    if not 0.1 <= options.pace <= 10.0:
        problems.append(Problem("--pace", f"is {options.pace:g}, allowed: 0.1 to 10"))
    problems += unwritable({"--record": options.record}, {})
    if problems:
        raise ScenarioError(problems, "oilsim")

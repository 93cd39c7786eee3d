"""`oilsim conduct`: run an exercise with a console for its instructor and crews, a page in the browser."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from scenarios.commands.options import add_scenario, overrides
from scenarios.running.output_paths import free_recording, unwritable
from scenarios.spec.at_rest import rest_settings
from scenarios.text.problems import Problem, ScenarioError, reason_of


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("conduct", help="run an exercise live, with pages for instructor, crews and observers")
    add_scenario(parser)
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
    from scenarios.spec.load import load_scenario

    chosen = overrides(options)
    loaded = load_scenario(options.scenario, overrides=chosen, demo=options.demo)
    if not options.plan:
        chosen = (*rest_settings(loaded.scenario), *chosen)
    from scenarios.conduct.conducted_run import Errand
    from scenarios.conduct.console import ConsoleOptions, conduct

    errand = Errand(
        scenario=options.scenario,
        record=options.record or free_recording(loaded.scenario.name),
        overrides=chosen,
        demo=options.demo,
        pace=options.pace,
    )
    console = ConsoleOptions(
        host=options.host,
        port=options.port,
        password=password,
        opens=not options.no_browser and sys.stdout.isatty(),
        shows_scene=not options.no_scene,
    )
    try:
        return conduct(errand, list(loaded.scenario.vessels), console)
    except OSError as error:
        text = f"cannot be served at {options.host}:{options.port}: {error.strerror or error}; allowed: a free port of this machine"
        raise ScenarioError([Problem("the console", text)], "oilsim") from error


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

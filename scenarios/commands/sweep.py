"""`oilsim sweep`: run a scenario once for every combination of some entries' values."""

from __future__ import annotations

import argparse
from pathlib import Path

from scenarios.commands.options.scenario import add_scenario, overrides


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "sweep", help="run a scenario once for every combination of values, and compare the runs"
    )
    add_scenario(parser)
    parser.add_argument(
        "--vary",
        action="append",
        required=True,
        metavar="KEY=VALUE,VALUE,...",
        help="values for an entry, for example tow.speed_kn=0.3,0.5,0.7; may be repeated",
    )
    parser.add_argument(
        "--to",
        type=Path,
        metavar="FOLDER",
        help="folder for the results (default: NAME-sweep); complete runs in it are not repeated",
    )
    parser.add_argument("--record", action="store_true", help="record each run, too")
    parser.set_defaults(command=_sweep)


def _sweep(options: argparse.Namespace) -> int:
    from scenarios.sweeps.sweep import run_sweep
    from scenarios.sweeps.variants import parse_variation, variants

    variations = [parse_variation(text) for text in options.vary]
    chosen = variants(options.scenario, variations, overrides=overrides(options), demo=options.demo)
    folder = options.to or Path(f"{chosen[0].plan.scenario.name}-sweep")
    return run_sweep(chosen, folder, recorded=options.record)

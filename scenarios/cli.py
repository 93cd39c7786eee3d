"""The `oilsim` command: list, check, run and sweep scenarios; replay, debrief, compare, verify, export and repair recordings.

Exit codes: 0 done, 2 bad input (what, where, what is allowed), 1 failed run (the recording so far is kept) or difference found.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence

from recordings.errors import RecordingError
from scenarios.commands import (
    build_fmu,
    check,
    compare,
    debrief,
    export,
    export_fmu,
    list,
    repair,
    replay,
    report,
    run,
    signals,
    sweep,
    verify,
)  # fmt: skip
from scenarios.exit_codes import BAD_INPUT, INTERRUPTED
from scenarios.problems import ScenarioError

COMMANDS = (
    list, check, run, sweep, replay, debrief, compare, verify, report, export, repair, signals, build_fmu, export_fmu,
)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    for library in ("OPENBLAS", "OMP", "MKL"):
        # The matrices here are small; a linear algebra library that spins threads of its own takes the cores from the fluid.
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    options = command_parser().parse_args(arguments)
    try:
        return int(options.command(options))
    except ScenarioError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT
    except RecordingError as error:
        print(f"oilsim: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED


def command_parser() -> argparse.ArgumentParser:
    """The parser of the command, with one subparser for each subcommand."""
    parser = argparse.ArgumentParser(
        prog="oilsim",
        description="Oil and sea water around rocks, booms and vessels: scenario files in, recordings out.",
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.register(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())

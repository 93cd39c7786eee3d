"""`oilsim verify`: run the scenario of a recording again and compare the frames."""

from __future__ import annotations

import argparse
from pathlib import Path

from scenarios.exit_codes import DONE, FAILED


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "verify", help="run the scenario of a recording again, and report the first frame that differs"
    )
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd)")
    parser.add_argument("--threads", type=int, metavar="N", help="number of threads (default: the recording's)")
    parser.add_argument(
        "--until", type=float, metavar="S", help="simulated time [s] to compare (default: the whole recording)"
    )
    parser.set_defaults(command=_verify)


def _verify(options: argparse.Namespace) -> int:
    from scenarios.commands.options.scenario import require_run_options

    require_run_options(options)
    from scenarios.running.verify import verify
    from scenarios.text.terminal import terminal

    verdict = verify(options.recording, threads=options.threads, until=options.until, console=terminal(stderr=True))
    if verdict.versions:
        print(f"software versions differ: {verdict.versions}")
    if verdict.difference:
        print(f"the runs differ after {verdict.equal_frames} equal frames: {verdict.difference}")
        return FAILED
    told = f"0 frames differ: all {verdict.equal_frames} are equal bit for bit"
    grid = verdict.precision
    print(
        told if grid is None else f"{told}; particle positions are compared on the recorded grid of 1/{1.0 / grid:g} m"
    )
    return DONE

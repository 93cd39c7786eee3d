"""`oilsim verify`: run a recording's scenario again and compare."""

from __future__ import annotations

import argparse
from pathlib import Path

from scenarios.exit_codes import DONE, FAILED


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = commands.add_parser(
        "verify", help="run the scenario in a recording again and find the first frame that differs"
    )
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd)")
    parser.add_argument("--threads", type=int, metavar="N", help="threads of the fluid, instead of the recording's")
    parser.add_argument("--until", type=float, metavar="S", help="simulated seconds to compare, instead of all")
    parser.set_defaults(command=_verify)


def _verify(options: argparse.Namespace) -> int:
    from scenarios.running.verify import verify
    from scenarios.text.terminal import terminal

    verdict = verify(options.recording, threads=options.threads, until=options.until, console=terminal(stderr=True))
    if verdict.versions:
        print(f"versions differ: {verdict.versions}")
    if verdict.difference:
        print(f"differs after {verdict.equal_frames} equal frames: {verdict.difference}")
        return FAILED
    told = f"0 frames differ, {verdict.equal_frames} are equal bit for bit"
    grid = verdict.precision
    print(told if grid is None else f"{told}, particles on the recorded grid of 1/{1.0 / grid:g} m")
    return DONE

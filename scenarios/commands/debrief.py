"""`oilsim debrief`: write a page that debriefs an exercise, from its recording alone."""

from __future__ import annotations

import argparse
from pathlib import Path

from scenarios.exit_codes import DONE


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "debrief", help="write the debrief of a recorded exercise as one page: grade, key moments, map, diagrams"
    )
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd)")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for the page and its pictures (default: FILE-debrief)"
    )
    parser.add_argument("--criteria", type=Path, metavar="FILE.toml", help="your own limits and weights for the grade")
    parser.set_defaults(command=_debrief)


def _debrief(options: argparse.Namespace) -> int:
    from scenarios.commands.options.export import file_errors
    from scenarios.debrief.grade import read_criteria
    from scenarios.debrief.page import write_debrief

    criteria = None if options.criteria is None else read_criteria(options.criteria)
    folder = options.out or Path(f"{options.recording.stem}-debrief")
    with file_errors():
        print(write_debrief(options.recording, folder, criteria))
    return DONE

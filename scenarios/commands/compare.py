"""`oilsim compare`: compare two recordings of one exercise."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.exit_codes import DONE, FAILED
from scenarios.problems import Problem, ScenarioError
from scenarios.running.output_paths import already_there, free_recording, require_apart

if TYPE_CHECKING:
    from recordings.replay.recording import Replay


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "compare", help="compare two recordings: a table of scores, the orders, and both runs in one viewer"
    )
    parser.add_argument("first", type=Path, metavar="A", help="a recording (.rrd)")
    parser.add_argument(
        "second", type=Path, metavar="B", help="another recording, for example of the same run with other orders"
    )
    showing = parser.add_mutually_exclusive_group()
    showing.add_argument(
        "--to",
        type=Path,
        metavar="BOTH",
        help="recording to write with both runs (default: A-and-B.rrd, or A-and-B-2.rrd if that is there)",
    )
    showing.add_argument("--table", action="store_true", help="only print the tables")
    parser.add_argument("--overwrite", action="store_true", help="with --to: replace the file if it is there")
    parser.set_defaults(command=_compare)


def _compare(options: argparse.Namespace) -> int:
    from recordings.replay.comparison import write_side_by_side
    from recordings.sink.viewer import ViewerError, open_viewer
    from scenarios.commands.options.export import whole_run

    target = options.to or free_recording(f"{options.first.stem}-and-{options.second.stem}")
    require_apart({"A": options.first, "B": options.second}, {"--to": target})
    _require_new(options)
    first, second = whole_run(options.first), whole_run(options.second)
    require_apart({"A as repaired": first.path, "B as repaired": second.path}, {"--to": target})
    _print_scores(first, second)
    _print_events(first, second)
    if options.table:
        return DONE
    write_side_by_side(first, second, target)
    print(f"both runs: {target}")
    if options.to is not None:
        return DONE
    try:
        open_viewer(target)
    except ViewerError as error:
        print(f"oilsim: {error}")
        return FAILED
    return DONE


def _require_new(options: argparse.Namespace) -> None:
    """Raise ScenarioError unless the file to write is new, or may be replaced."""
    problems = [] if options.overwrite else already_there({"--to": options.to})
    if options.overwrite and options.to is None:
        problems = [Problem("--overwrite", "is given, allowed: only with --to")]
    if problems:
        raise ScenarioError(problems, "oilsim")


def _print_scores(first: Replay, second: Replay) -> None:
    from rich.table import Table

    from recordings.replay.comparison import common_time, scores
    from scenarios.text.terminal import terminal

    begin, end = common_time(first, second)
    found = list(scores(first, second))
    if not found:
        print(
            f"{first.path.name} ({first.run.name}) and {second.path.name} ({second.run.name}) have no score in common"
        )
        return
    table = Table(
        "score", "unit", title=f"from {begin:g} s to {end:g} s, the time that both runs cover", title_justify="left"
    )
    for name in (f"A: {first.path.stem}", f"B: {second.path.stem}", "B - A"):
        table.add_column(name, justify="right")
    for score in found:
        change = score.second - score.first
        table.add_row(
            score.label, score.unit, f"{score.first:.4g}", f"{score.second:.4g}", f"{change:+.3g}" if change else "="
        )
    terminal().print(table)


def _print_events(first: Replay, second: Replay) -> None:
    """Print the orders and the warnings, in order of time."""
    from rich.table import Table

    from scenarios.text.terminal import terminal

    told = [
        (event.time, side, f"{event.source}: {event.text}" if event.source else event.text)
        for side, replay in (("A", first), ("B", second))
        for event in replay.events
        if event.source == "instructor" or event.level != "info"
    ]
    if not told:
        return
    table = Table("time", "run", "event")
    for time, side, text in sorted(told):
        table.add_row(f"{time:.2f} s", side, text)
    terminal().print(table)

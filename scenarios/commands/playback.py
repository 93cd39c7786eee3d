"""`oilsim replay | debrief | compare | verify | report | repair`: what is done with recordings, beside exporting them."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from scenarios.running.output_paths import already_there, free_recording, require_apart, require_writable, unwritable
from scenarios.text.problems import DONE, FAILED, Problem, ScenarioError

if TYPE_CHECKING:
    from recordings.replay.recording import Replay


def register_replay(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("replay", help="open a recording in the viewer")
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd)")
    parser.set_defaults(command=_replay)


def _replay(options: argparse.Namespace) -> int:
    from recordings.replay.repair import damage_of, is_whole, repair
    from recordings.sink.viewer import ViewerError, open_viewer

    recording: Path = options.recording
    if recording.is_file() and not is_whole(recording):
        recording = repair(recording)
        told = f"{options.recording} {damage_of(options.recording) or 'was damaged at its end'}"
        print(f"oilsim: {told}; what could be saved is in {recording}", file=sys.stderr)
    try:
        open_viewer(recording)
    except ViewerError as error:
        print(f"oilsim: {error}", file=sys.stderr)
        return FAILED
    return DONE


def register_debrief(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser(
        "debrief", help="write the debrief of a recorded exercise as one page: grade, key moments, map, diagrams"
    )
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd)")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for the page and its pictures (default: FILE-debrief)"
    )
    parser.add_argument("--criteria", type=Path, metavar="FILE.toml", help="your own limits and weights for the grade")
    parser.add_argument(
        "--report", action="store_true", help="write report.html, too: POLREP, ICS 209 and cost as forms to print"
    )
    parser.set_defaults(command=_debrief)


def _debrief(options: argparse.Namespace) -> int:
    from scenarios.commands.options import file_errors
    from scenarios.debrief.grade import read_criteria
    from scenarios.debrief.page import REPORT, write_debrief

    criteria = None if options.criteria is None else read_criteria(options.criteria)
    folder = options.out or Path(f"{options.recording.stem}-debrief")
    require_writable({}, {"--out": folder})
    with file_errors():
        print(write_debrief(options.recording, folder, criteria, report=options.report))
    if options.report:
        print(folder / REPORT)
    return DONE


def register_verify(commands: argparse._SubParsersAction) -> None:
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
    from scenarios.commands.options import require_run_options

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


def register_report(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("report", help="write a recording's series, bodies, log and particles as tables")
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd)")
    parser.add_argument("--csv", type=Path, metavar="DIR", help="folder for tables in CSV")
    parser.add_argument("--parquet", type=Path, metavar="DIR", help="folder for tables in Parquet")
    parser.add_argument(
        "--tracks",
        action="append",
        default=[],
        metavar="PHASE",
        help="add the particles of this phase; may be repeated",
    )
    parser.add_argument("--ids", default="", metavar="N,N,...", help="ids of the particles to write (default: all)")
    parser.add_argument(
        "--every", type=float, metavar="S", help="shortest time between frames of particles [s] (default: every frame)"
    )
    parser.set_defaults(command=_report)


def _report(options: argparse.Namespace) -> int:
    from recordings.export.tables import Format, write_tables
    from scenarios.commands.options import (
        file_errors,
        interval,
        particle_ids,
        require_some,
        require_used,
        whole_run,
    )

    require_some(options, "csv", "parquet")
    require_used(options, {"ids": ("tracks",), "every": ("tracks",)})
    require_writable({}, {"--csv": options.csv, "--parquet": options.parquet})
    apart, ids = interval(options), particle_ids(options.ids)
    replay = whole_run(options.recording)
    folders: tuple[tuple[Format, Path | None], ...] = (("csv", options.csv), ("parquet", options.parquet))
    with file_errors():
        for kind, folder in folders:
            if folder is not None:
                for path in write_tables(replay, folder, kind, tracks=options.tracks, ids=ids, interval=apart):
                    print(path)
    return DONE


def register_repair(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("repair", help="write a whole copy of a recording that was cut off or damaged")
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd); it is not changed")
    parser.add_argument(
        "--to", type=Path, metavar="COPY", help="copy to write (default: FILE with .repaired before its ending)"
    )
    parser.set_defaults(command=_repair)


def _repair(options: argparse.Namespace) -> int:
    from recordings.files.writing import RecordingError, absence
    from recordings.replay.recording import Replay
    from recordings.replay.repair import damage_of, is_whole, repair

    source: Path = options.recording
    why = absence(source)
    if why:
        raise RecordingError(source, why)
    found = damage_of(source)
    if found.is_ended and is_whole(source):
        Replay(source)  # it may be whole and no run
        print(f"{source} is complete; there is nothing to repair")
        return DONE
    require_writable({"--to": options.to})
    copy = repair(source, options.to)
    try:
        replay = Replay(copy)
        counts = {phase.name: len(replay.phase_times(phase.name).index) for phase in replay.run.phases}
        last = max((float(series.time[-1]) for series in replay.scalars.values() if len(series.time)), default=0.0)
    except RecordingError as error:
        copy.unlink(missing_ok=True)
        raise RecordingError(source, f"cannot be repaired: {error.reason}") from error
    frames = ", ".join(f"{count} frames of {name}" for name, count in counts.items())
    print(f"{source} {found or 'was damaged at its end'}; saved in {copy}: {frames}, up to {last:g} s")
    return DONE


def register_compare(commands: argparse._SubParsersAction) -> None:
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
    from scenarios.commands.options import whole_run

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
    problems = unwritable({"--to": options.to}, {})
    problems += [] if options.overwrite else already_there({"--to": options.to})
    if options.overwrite and options.to is None:
        problems = [Problem("--overwrite", "is given, allowed: only with --to")]
    if problems:
        raise ScenarioError(problems, "oilsim")


def _print_scores(first: Replay, second: Replay) -> None:
    from rich.table import Table

    from recordings.replay.comparison import common_time, parting, scores
    from scenarios.text.terminal import terminal

    begin, end = common_time(first, second)
    found = list(scores(first, second))
    if not found:
        print(
            f"{first.path.name} ({first.run.name}) and {second.path.name} ({second.run.name}) have no score in common"
        )
        return
    apart = parting(first, second)
    print("both runs are the same, frame for frame" if apart is None else f"the runs differ from {apart:g} s on")
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

"""`oilsim report`: every series of a recording as tables."""

from __future__ import annotations

import argparse
from pathlib import Path

from scenarios.exit_codes import DONE


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand."""
    parser = commands.add_parser("report", help="write a recording's series, bodies, log and particles as tables")
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd)")
    parser.add_argument("--csv", type=Path, metavar="DIR", help="folder for CSV tables")
    parser.add_argument("--parquet", type=Path, metavar="DIR", help="folder for Parquet tables")
    parser.add_argument(
        "--tracks", action="append", default=[], metavar="PHASE", help="particles of this phase too; may be repeated"
    )
    parser.add_argument("--ids", default="", metavar="N,N,...", help="only these particles; all by default")
    parser.add_argument(
        "--every", type=float, metavar="S", help="particles at most so often [s]; every frame by default"
    )
    parser.set_defaults(command=_report)


def _report(options: argparse.Namespace) -> int:
    from recordings.export.tables import Format, write_tables
    from recordings.replay.recording import Replay
    from scenarios.commands.export_options import file_errors, interval, particle_ids, require_some

    require_some(options, "csv", "parquet")
    apart, ids = interval(options), particle_ids("--ids", options.ids)
    replay = Replay(options.recording)
    folders: tuple[tuple[Format, Path | None], ...] = (("csv", options.csv), ("parquet", options.parquet))
    with file_errors():
        for kind, folder in folders:
            if folder is not None:
                for path in write_tables(replay, folder, kind, tracks=options.tracks, ids=ids, interval=apart):
                    print(path)
    return DONE

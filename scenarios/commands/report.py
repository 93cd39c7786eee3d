"""`oilsim report`: write every series of a recording as tables."""

from __future__ import annotations

import argparse
from pathlib import Path

from scenarios.exit_codes import DONE


def register(commands: argparse._SubParsersAction) -> None:
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
    from scenarios.commands.options.export import (
        file_errors,
        interval,
        particle_ids,
        require_some,
        require_used,
        whole_run,
    )

    require_some(options, "csv", "parquet")
    require_used(options, {"ids": ("tracks",), "every": ("tracks",)})
    apart, ids = interval(options), particle_ids("--ids", options.ids)
    replay = whole_run(options.recording)
    folders: tuple[tuple[Format, Path | None], ...] = (("csv", options.csv), ("parquet", options.parquet))
    with file_errors():
        for kind, folder in folders:
            if folder is not None:
                for path in write_tables(replay, folder, kind, tracks=options.tracks, ids=ids, interval=apart):
                    print(path)
    return DONE

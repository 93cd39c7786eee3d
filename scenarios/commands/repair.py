"""`oilsim repair`: repair a recording that was cut off."""

from __future__ import annotations

import argparse
from pathlib import Path

from scenarios.exit_codes import DONE


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("repair", help="repair a recording that was cut off: write a complete copy")
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd); it is not changed")
    parser.add_argument(
        "--to", type=Path, metavar="COPY", help="copy to write (default: FILE with .repaired before its ending)"
    )
    parser.set_defaults(command=_repair)


def _repair(options: argparse.Namespace) -> int:
    from recordings.replay.recording import Replay
    from recordings.replay.repair import has_footer, repair

    if options.recording.is_file() and has_footer(options.recording):
        print(f"{options.recording} is complete; there is nothing to repair")
        return DONE
    copy = repair(options.recording, options.to)
    replay = Replay(copy)
    counts = {phase.name: len(replay.phase_times(phase.name).index) for phase in replay.run.phases}
    last = max((float(series.time[-1]) for series in replay.scalars.values() if len(series.time)), default=0.0)
    frames = ", ".join(f"{count} frames of {name}" for name, count in counts.items())
    print(f"{options.recording} was cut off; {copy} has {frames}, up to {last:g} s")
    return DONE

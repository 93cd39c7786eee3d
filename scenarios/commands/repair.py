"""`oilsim repair`: mend a recording that was cut off or damaged."""

from __future__ import annotations

import argparse
from pathlib import Path

from scenarios.exit_codes import DONE


def register(commands: argparse._SubParsersAction) -> None:
    """Add the subcommand's parser to `commands`."""
    parser = commands.add_parser("repair", help="write a whole copy of a recording that was cut off or damaged")
    parser.add_argument("recording", type=Path, metavar="FILE", help="a recording (.rrd); it is not changed")
    parser.add_argument(
        "--to", type=Path, metavar="COPY", help="copy to write (default: FILE with .repaired before its ending)"
    )
    parser.set_defaults(command=_repair)


def _repair(options: argparse.Namespace) -> int:
    from recordings.files.errors import RecordingError, absence
    from recordings.replay.recording import Replay
    from recordings.replay.repair import damage_of, has_footer, repair

    source: Path = options.recording
    why = absence(source)
    if why:
        raise RecordingError(source, why)
    found = damage_of(source)
    if not found.keeps_from_reading and has_footer(source):
        Replay(source)  # it may be whole and no run
        print(f"{source} is complete; there is nothing to repair")
        return DONE
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

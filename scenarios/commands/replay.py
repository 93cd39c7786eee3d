"""`oilsim replay`: open a recording in the viewer."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from scenarios.exit_codes import DONE, FAILED


def register(commands: argparse._SubParsersAction) -> None:
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

"""Recordings of runs: written, replayed, drawn and exported."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from recordings.files.writing import RecordingError
    from recordings.pictures.picture import draw_picture
    from recordings.replay.recording import Replay
    from recordings.sink.recorder import Recorder

__all__ = ["Recorder", "RecordingError", "Replay", "draw_picture"]
_HOMES = {
    "Recorder": "sink.recorder",
    "RecordingError": "files.errors",
    "Replay": "replay.recording",
    "draw_picture": "pictures.picture",
}


def __getattr__(name: str) -> Any:
    """Load a public name when it is asked for: a run that is not recorded must not wait for the recording library."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)

"""Replay: reading, checking, comparing and repairing recordings. `from recordings.replay import Replay` opens one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from recordings.replay.recording import Replay

__all__ = ["Replay"]


def __getattr__(name: str) -> Any:
    """Load `Replay` when it is asked for: a run that is not recorded must not wait for the recording library."""
    if name != "Replay":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from recordings.replay.recording import Replay

    return Replay

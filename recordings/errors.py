"""The one error that a recording raises."""

from __future__ import annotations

from pathlib import Path


class RecordingError(RuntimeError):
    """A recording cannot be written or read; ``path`` says which and the text why."""

    def __init__(self, path: str | Path, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"recording {self.path}: {reason}")

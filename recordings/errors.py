"""The error that recordings raise."""

from __future__ import annotations

from pathlib import Path


class RecordingError(RuntimeError):
    """A recording that cannot be written or read; ``path`` is its file, and the text gives the reason."""

    def __init__(self, path: str | Path, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"recording {self.path}: {reason}")

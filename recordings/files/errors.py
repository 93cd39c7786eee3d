"""The error that recordings raise."""

from __future__ import annotations

from pathlib import Path


class RecordingError(RuntimeError):
    """A recording that cannot be written or read; ``path`` is its file, and the text gives the reason."""

    def __init__(self, path: str | Path, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"recording {self.path}: {reason}")


def absence(path: Path) -> str:
    """Say why there is no file to read at a path: a folder is there, or nothing; empty if there is a file."""
    if path.is_file():
        return ""
    return "is a folder, allowed: the file of a recording (.rrd)" if path.is_dir() else "does not exist"

"""The two ways to write to a recording's stream, for whoever writes a part of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

import rerun as rr

from recordings.sample import Sample


class Static(Protocol):
    """Logs components that do not change."""

    def __call__(self, path: str, *components: rr.AsComponents) -> None:
        """Log them at a path."""


class Changing(Protocol):
    """Sends one chunk, with one row for each sample."""

    def __call__(self, path: str, samples: Sequence[Sample], columns: Iterable[rr.ComponentColumn]) -> None:
        """Send it for a path."""

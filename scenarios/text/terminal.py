"""The terminal as all commands write to it."""

from __future__ import annotations

from rich.console import Console


def terminal(*, stderr: bool = False) -> Console:
    """A console that shows titles, names and messages as they are: rich would read ``[/red]`` and ``:sun:`` in them as its own."""
    return Console(stderr=stderr, markup=False, emoji=False)

"""The terminal to which all commands write."""

from __future__ import annotations

from rich.console import Console


def terminal(*, stderr: bool = False) -> Console:
    """Create a console that shows texts as they are; rich would read ``[/red]`` and ``:sun:`` in titles as its own markup."""
    return Console(stderr=stderr, markup=False, emoji=False)

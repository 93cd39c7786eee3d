"""The terminal to which all commands write."""

from __future__ import annotations

import re

from rich.console import Console


class _Terminal(Console):
    """A console that lets the command end in order when its reader closes the pipe; rich itself would end it as failed."""

    def on_broken_pipe(self) -> None:
        """Raise BrokenPipeError, which the command takes for an end."""
        raise BrokenPipeError


def terminal(*, stderr: bool = False) -> Console:
    """Create a console that shows texts as they are; rich would read ``[/red]`` and ``:sun:`` in titles as its own markup."""
    return _Terminal(stderr=stderr, markup=False, emoji=False)


def flowing(text: str) -> str:
    """Join the lines that a file breaks within a sentence, so that a terminal of any width can wrap them; a stop keeps its line break."""
    return re.sub(r"(?<![.!?:\n])\n(?!\n)", " ", text.strip())

"""The terminal to which all commands write."""

from __future__ import annotations

import re

from rich.console import Console


def terminal(*, stderr: bool = False) -> Console:
    """Create a console that shows texts as they are; rich would read ``[/red]`` and ``:sun:`` in titles as its own markup."""
    return Console(stderr=stderr, markup=False, emoji=False)


def flowing(text: str) -> str:
    """Join the lines that a file breaks within a sentence, so that a terminal of any width can wrap them; a stop keeps its line break."""
    return re.sub(r"(?<![.!?:\n])\n(?!\n)", " ", text.strip())

"""Keep the aligned blocks of docstrings aligned on the site.

The docstrings of this project explain parameters in aligned columns::

    draft  [m] below the still-water level
    within [m] largest error

Markdown would run these lines together. This extension of griffe, which mkdocstrings reads docstrings with, fences each paragraph
that is aligned or indented as plain text, and leaves the others to Markdown.
"""

from __future__ import annotations

import re
import textwrap
from typing import Any

from griffe import Extension, Object

ALIGNED = re.compile(r"\S {2,}\S|^ ")


class DocstringBlocks(Extension):
    """Fences aligned paragraphs of every docstring."""

    def on_instance(self, *, obj: Object, **_: Any) -> None:
        """Called for every module, class, function and attribute that is read."""
        if obj.docstring is not None:
            paragraphs = obj.docstring.value.split("\n\n")
            obj.docstring.value = "\n\n".join(map(fenced, paragraphs))


def fenced(paragraph: str) -> str:
    """The paragraph, in a fence if one of its lines is aligned or indented."""
    lines = paragraph.splitlines()
    if not any(ALIGNED.search(line) for line in lines):
        return paragraph
    return f"```text\n{textwrap.dedent(paragraph)}\n```"

"""Code blocks of a Markdown page, and a way to run them as a reader would."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
FENCE = re.compile(r"^```(\w+)(?: title=\"([^\"]+)\")?\n(.*?)^```$", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A fenced block: its language, the name of the file that it shows, and its text."""

    language: str
    title: str
    text: str


def blocks(page: Path, language: str | None = None) -> list[Block]:
    """The fenced blocks of a page, in order; of one language only if it is given."""
    found = [Block(*match) for match in FENCE.findall(page.read_text(encoding="utf-8"))]
    return [block for block in found if language in (None, block.language)]


def commands(page: Path, program: str = "oilsim") -> list[list[str]]:
    """The arguments of every call of `program` in the page's `sh` blocks, in order."""
    lines = [line for block in blocks(page, "sh") for line in block.text.splitlines()]
    calls = [shlex.split(line, comments=True) for line in lines if line.startswith(f"{program} ")]
    return [arguments for _, *arguments in calls]


def shortened(calls: list[list[str]], shorter: Mapping[str, str]) -> list[list[str]]:
    """The calls with arguments replaced; every replacement must be of use, so that none outlives its command."""
    used = {word for call in calls for word in call}
    unused = shorter.keys() - used
    assert not unused, f"no command of the page has {', '.join(sorted(unused))}"
    return [[shorter.get(word, word) for word in call] for call in calls]


def write_files(page: Path, folder: Path) -> None:
    """Write every block that shows a file."""
    for block in blocks(page):
        if block.title:
            (folder / block.title).write_text(block.text, encoding="utf-8")

"""TOML of any kind, read or refused in plain words: which line, which key, and what is allowed.

JSON objects from strangers, read or refused.

The standard library's reader runs out of stack in deep nesting, and what Python tidies up at that moment fails too. So deep nesting is
refused before anything is read.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

MOST_OPEN = 200  # [1] brackets of a message outside its texts; ours have a dozen, a list of orders one
_TEXT = re.compile(rb'"(?:[^"\\]|\\.)*+"', re.DOTALL)


def read_object(raw: bytes) -> dict[str, Any] | None:
    """Read a JSON object of a few brackets; None for anything else."""
    bare = _TEXT.sub(b"", raw)
    if bare.count(b"[") + bare.count(b"{") > MOST_OPEN:
        return None
    try:
        data = json.loads(raw)
    except ValueError:
        return None
    return data if isinstance(data, dict) else None


_PLACE = re.compile(r" \(at (?:line (\d+), column \d+|end of document)\)$")
DEEPEST = 30  # levels of tables and lists in each other; ours have six
_OPEN_QUOTE = ("Illegal character '\\n'", "Unterminated string", 'Expected "\'"', "Expected \"'''\"")


def read_toml_file(path: Path) -> tuple[str, dict[str, Any]]:
    """Read the text and the tables of a file, with or without a byte-order mark; OSError, or ValueError as `read_toml`."""
    content = path.read_bytes()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError("it is not text in UTF-8, allowed: save it as UTF-8") from error
    if "\0" in text:  # UTF-16 without a mark, or no text at all
        raise ValueError("it is not text in UTF-8, allowed: save it as UTF-8")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text, read_toml(text)


def read_toml(text: str) -> dict[str, Any]:
    """Read the tables of a TOML text; ValueError if it is none, is nested too deeply, or holds a number of thousands of digits."""
    try:
        tables = tomllib.loads(text)
        if _depth(tables) > DEEPEST:
            raise RecursionError
        return tables
    except RecursionError as error:
        raise ValueError("lists or tables are nested too deeply") from error
    except tomllib.TOMLDecodeError as error:
        raise ValueError(_in_words(str(error), text)) from error


def _depth(tables: dict[str, Any]) -> int:
    """Count the levels of tables and lists in each other, up to one more than allowed."""
    depth, level = 0, list[Any]([tables])
    while level and depth <= DEEPEST:
        inner = (entry.values() if isinstance(entry, dict) else entry for entry in level)
        level = [one for entries in inner for one in entries if isinstance(one, dict | list)]
        depth += 1
    return depth


def _in_words(told: str, text: str) -> str:
    """Say what the reader's message means, with its line: a key or table given twice, a quote that is not closed."""
    place = _PLACE.search(told)
    if place is None:
        return told
    number = int(place[1]) if place[1] else None
    if told.startswith(_OPEN_QUOTE):
        return f"line {number or _opened_at(text, told)} opens a quote that is not closed, allowed: a quote at each end of the text"
    if number is not None and told.startswith(("Cannot overwrite", "Cannot declare", "Duplicate inline")):
        twice = re.search(r"Duplicate inline table key '(.*)' \(at", told)
        line = text.splitlines()[number - 1].strip()
        key = f"key {twice[1]!r}" if twice else _named_by(line)
        return f"line {number} gives the {key} a second time, allowed: once"
    return told


def _named_by(line: str) -> str:
    """Name what a line of a file defines: a table or a key."""
    if line.startswith("["):
        return f"table [{line.strip('[').partition(']')[0]}]"
    return f"key {line.partition('=')[0].strip()!r}"


def _opened_at(text: str, told: str) -> int:
    """Find the line whose quote is still open at the end of the text: before it, the text has no such fault."""
    lines = text.splitlines(keepends=True)
    last = len(lines)
    while last > 1:
        try:
            tomllib.loads("".join(lines[: last - 1]))
        except tomllib.TOMLDecodeError as error:
            if str(error) != told:
                break
        else:
            break
        last -= 1
    return last

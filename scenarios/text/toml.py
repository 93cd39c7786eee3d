"""TOML of any kind, read or refused: the standard library's reader runs out of stack in deep nesting."""

from __future__ import annotations

import tomllib
from typing import Any


def read_toml(text: str) -> dict[str, Any]:
    """Read the tables of a TOML text; ValueError if it is none, is nested too deeply, or holds a number of thousands of digits."""
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ValueError("lists or tables are nested too deeply") from error

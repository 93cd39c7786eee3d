"""JSON objects from strangers, read or refused.

The standard library's reader runs out of stack in deep nesting, and what Python tidies up at that moment fails too. So deep nesting is
refused before anything is read.
"""

from __future__ import annotations

import json
import re
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

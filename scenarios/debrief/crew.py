"""The acts of a crew: an exercise that needs orders is not passed by who gives none."""

from __future__ import annotations

import json
import shlex
from fnmatch import fnmatch

from recordings.replay.recording import Replay

# what crews order; engines that fail, lines that part and the weather are the instructor's
ACTS = (
    "tow.*", "vessels.*.legs*", "vessels.*_order=*", "*.hauled=*", "vessels.*.engine=*running*", "booms.*.tow_line=*",
    "booms.*.reel.paid_out=*", "ties.*.made_fast=*", "skimmers.*.running=true", "skimmers.*.place=*",
)  # fmt: skip
_ORDERED = "orders "  # how the text of an order's event begins


def crew_acted(replay: Replay) -> bool:
    """Return False if the recorded exercise needs orders, and nobody gave a vessel, a line or a skimmer one; else True.

    Injects come by themselves: one that lets a skimmer run again is no act of a crew.
    """
    plan = json.loads(str(replay.run.properties.get("plan") or "{}"))
    exercise = plan.get("scenario", {}).get("exercise") or {}
    return not exercise.get("needs_orders", False) or any(
        any(fnmatch(setting, act) for act in ACTS)
        for event in replay.events
        if event.is_by_people and event.text.startswith(_ORDERED)
        for setting in _settings(event.text.removeprefix(_ORDERED))
    )


def _settings(text: str) -> list[str]:
    try:
        return shlex.split(text)
    except ValueError:  # older recordings have texts without quotes
        return text.split(" ")

"""Secrets of a console: injects before they are noticed, faults that the instructor makes, marks and notes.

Crews and observers get an inject's text, without its name and its orders, and of orders those that a crew hears or sees: courses and
speeds, winches, the weather, and all that acts on its own vessel and skimmers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fnmatch import fnmatch
from typing import Any

from recordings.model.frame import INJECTS, INSTRUCTOR
from scenarios.conduct.access import VESSEL, Role
from scenarios.debrief.crew import ACTS
from scenarios.debrief.order_words import order_in_words
from scenarios.running.plan import Action, settings_of

_INJECT = "inject "  # how the source of an inject's text begins
_OF_INSTRUCTOR = ("injects", "notes")  # entries of a scene


def scene_seen(role: Role, scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a role sees of a scene."""
    hidden = () if role.kind == INSTRUCTOR else _OF_INSTRUCTOR
    return {name: value for name, value in scene.items() if name not in hidden}


def summary_seen(role: Role, summary: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a role sees of a session's facts: marks are the instructor's."""
    return dict(summary) if role.kind == INSTRUCTOR else {**summary, "marks": []}


def line_seen(role: Role, line: Mapping[str, Any], scene: Mapping[str, Any] | None) -> Mapping[str, Any] | None:
    """Return a line of the log as a role sees it; None if it does not."""
    if role.kind == INSTRUCTOR or scene is None:
        return line if role.kind == INSTRUCTOR or not _is_secret(line) else None
    if line["source"].startswith(_INJECT):
        return _noticed(role, line, scene)
    settings = settings_of(line["text"]) if line.get("order") else ()
    if not settings:
        return None if line["mark"] else line
    seen = () if line["source"] == INJECTS else tuple(_heard(role, settings, scene))
    words = order_in_words(Action(index=0, settings=seen).text, scene["bearing"])
    return {**line, "text": words, "words": words} if seen else None


def _is_secret(line: Mapping[str, Any]) -> bool:
    """Return whether a line tells of injects, orders or marks."""
    return bool(line.get("order") or line["mark"] or line["source"].startswith(_INJECT))


def _noticed(role: Role, line: Mapping[str, Any], scene: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the text of an inject that has been given, to a crew that notices it; an observer notices all."""
    name = line["source"].removeprefix(_INJECT)
    inject = next((one for one in scene["injects"] if one["name"] == name), None)
    if inject is None or line["text"] != inject["text"]:
        return None  # it has no text, or could not be given
    is_told = role.kind != VESSEL or not inject["to"] or role.vessel in inject["to"]
    return {**line, "source": ""} if is_told else None


def _heard(role: Role, settings: tuple[str, ...], scene: Mapping[str, Any]) -> Iterator[str]:
    """Yield those settings of an order that a crew hears or sees; of an inject given by hand none, its text tells."""
    if any(fnmatch(setting, "injects.*") for setting in settings):
        return
    own = [f"vessels.{one['name']}.*" for one in scene["vessels"] if role.kind != VESSEL or one["name"] == role.vessel]
    own += [f"skimmers.{name}.*" for one in scene["vessels"] if one["name"] == role.vessel for name in one["skimmers"]]
    yield from (setting for setting in settings if any(fnmatch(setting, key) for key in (*ACTS, "sea.*", *own)))

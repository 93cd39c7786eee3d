"""Directions as sailors say them: compass courses in degrees clockwise from north, and winds and waves by where they come from.

`heading_compass` gives a `heading`, `from_compass` the `direction` of wind or waves, `toward_compass` that of a current. North is where the
scenario's `site.bearing` puts it, along +y without one. The mathematical keys, counter-clockwise from +x, stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from oilsim.core.quantity import is_number
from scenarios.schema.parsing.structuring import COMPASS, spellings
from scenarios.text.problems import Problem

_EAST = 90.0  # [degrees], bearing of the x axis without a site
PLACES: Mapping[tuple[str, ...], str] = {
    ("tow",): "heading_compass",
    ("vessels", "*"): "heading_compass",
    ("vessels", "*", "legs", "*"): "heading_compass",
    ("sea", "wind"): "from_compass",
    ("sea", "waves"): "from_compass",
    ("sea", "current"): "toward_compass",
}
"""Sections that take a compass course, by their path; `*` stands for any name. Their classes name the key too (`Section.COMPASS`)."""


def without_compass(data: Mapping[str, Any]) -> tuple[dict[str, Any], list[Problem]]:
    """Copy a scenario's plain data with every compass course turned into the direction [rad] from +x; and what is wrong with them."""
    problems = list[Problem]()
    result = _turned(dict(data), (), _bearing(data), problems)
    return result, problems


def section_without_compass(data: Any, place: tuple[str, ...], bearing: float) -> tuple[Any, list[Problem]]:
    """Copy the plain data of the section at a place of a scenario in the same way; bearing [rad] of the x axis, clockwise from north."""
    problems = list[Problem]()
    return _turned(data, place, math.degrees(bearing), problems), problems


def _bearing(data: Mapping[str, Any]) -> float:
    """Return the bearing [degrees] of the x axis, clockwise from north; wrong ones are found later, where the site is read."""
    site = data.get("site")
    for key, factor in (("bearing", math.degrees(1.0)), ("bearing_deg", 1.0)):
        if isinstance(site, Mapping) and is_number(site.get(key)):
            return factor * float(site[key])
    return _EAST


def _turned(table: Any, path: tuple[str, ...], bearing: float, problems: list[Problem]) -> Any:
    if isinstance(table, list | tuple):
        return [_turned(entry, (*path, str(place)), bearing, problems) for place, entry in enumerate(table)]
    if not isinstance(table, Mapping):
        return table
    result = dict(table)
    for key, value in table.items():
        below = (*path, key)
        if any(_leads_to(below, place) for place in PLACES):
            result[key] = _turned(value, below, bearing, problems)
    alias = next((alias for place, alias in PLACES.items() if _is(path, place) and alias in table), None)
    if alias is not None:
        course = result.pop(alias)
        found = list(_faults(table, alias))
        problems += [problem.below(".".join(path)) for problem in found]
        if not found:
            toward = course + (180.0 if alias == "from_compass" else 0.0)
            result[COMPASS[alias]] = math.radians((bearing - toward + 180.0) % 360.0 - 180.0)
    return result


def _faults(table: Mapping[str, Any], alias: str) -> Iterator[Problem]:
    course = table[alias]
    if not is_number(course) or not 0.0 <= course <= 360.0:
        yield Problem(alias, f"is {course!r}, allowed: a number, 0 to 360 degrees clockwise from north")
    rival = next((key for key in spellings(alias) if key != alias and key in table), None)
    if rival is not None:
        yield Problem(alias, f"is given beside {rival}, allowed: one of the two")


def _is(path: tuple[str, ...], place: tuple[str, ...]) -> bool:
    return len(path) == len(place) and _leads_to(path, place)


def _leads_to(path: tuple[str, ...], place: tuple[str, ...]) -> bool:
    return len(path) <= len(place) and all(part in ("*", step) for step, part in zip(path, place, strict=False))

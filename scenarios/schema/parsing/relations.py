"""Relations between the keys of a section, declared beside its fields: what needs what, what excludes what, what is above what.

A section lists them in `RELATIONS`. Each is looked at once every field is valid by itself. A field counts as given if it differs from its
default. `reference` declares a field that names entries of other tables, which are looked for once all tables are read.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, field, fields
from typing import Any

from oilsim.core.quantity import SHORTEST_DIRECTION, quantities
from scenarios.text.problems import Problem

Relation = Callable[[Any], Iterator[Problem]]
_TABLES = "tables"  # key of a field's metadata


def only_with(names: str, other: str, *values: Any) -> Relation:
    """Refuse the named fields but beside another one, or beside one of these values of it; ``at or when`` is one of several."""

    def relation(section: Any) -> Iterator[Problem]:
        if not _holds(section, other, values):
            for name in filter(lambda one: is_given(section, one), names.split()):
                yield Problem(name, f"{shown(getattr(section, name))}, allowed: only with {_condition(other, values)}")

    return relation


def needed_with(names: str, other: str, *values: Any) -> Relation:
    """Require the named numbers beside another field, or beside these values of it."""

    def relation(section: Any) -> Iterator[Problem]:
        if _holds(section, other, values):
            condition = _condition(other, values and (getattr(section, other),))
            for name in filter(lambda one: getattr(section, one) is None, names.split()):
                unit = quantities(type(section))[name].unit
                yield Problem(name, f"is missing, allowed: a number{f' in {unit}' if unit else ''} with {condition}")

    return relation


def together(*names: str) -> Relation:
    """Require all of these fields or none."""

    def relation(section: Any) -> Iterator[Problem]:
        missing = [name for name in names if not is_given(section, name)]
        if 0 < len(missing) < len(names):
            yield Problem(missing[0], f"is missing, allowed: {' and '.join(names)} together, or none")

    return relation


def at_most_one(*names: str) -> Relation:
    """Refuse more than one of these fields."""

    def relation(section: Any) -> Iterator[Problem]:
        given = [name for name in names if is_given(section, name)]
        for name in given[1:]:
            yield Problem(name, f"is given beside {given[0]}, allowed: one of {' or '.join(names)}")

    return relation


def at_least_one(*names: str) -> Relation:
    """Require at least one of these fields."""

    def relation(section: Any) -> Iterator[Problem]:
        if not any(is_given(section, name) for name in names):
            yield Problem(names[0], f"is missing, allowed: {' or '.join(names)}")

    return relation


def exactly_one(*names: str) -> Relation:
    """Require exactly one of these fields."""

    def relation(section: Any) -> Iterator[Problem]:
        yield from at_least_one(*names)(section)
        yield from at_most_one(*names)(section)

    return relation


def above(name: str, lower: str) -> Relation:
    """Require that a number, or each of a vector, is above another of the section."""

    def relation(section: Any) -> Iterator[Problem]:
        high, low, unit = getattr(section, name), getattr(section, lower), quantities(type(section))[name].unit
        if high is None or low is None:
            return
        if not isinstance(high, tuple):
            if not high > low:
                yield Problem(name, f"is {high:g}, allowed: above {lower} = {low:g} {unit}")
            return
        for axis, one, other in zip("xyz", high, low, strict=True):
            if not one > other:
                yield Problem(name, f"has {axis} = {one:g} {unit}, allowed: above {lower} {axis} = {other:g} {unit}")

    return relation


def directed(section: Any) -> Iterator[Problem]:
    """Require that the vector `direction` (3,) is long enough to give one."""
    if math.hypot(*section.direction) < SHORTEST_DIRECTION:
        yield Problem("direction", f"is {section.direction}, allowed: a direction, not all zero")


def reference(*tables: str, default: Any = MISSING) -> Any:
    """Declare a dataclass field that holds a name, or names in a list, of entries of these tables."""
    return field(default=default, metadata={_TABLES: tables})


def references(section: Any) -> Iterator[tuple[str, tuple[str, ...], list[str]]]:
    """Yield each field of a section that refers to tables, the tables, and the names that it holds."""
    for item in fields(section):
        if _TABLES in item.metadata:
            value = getattr(section, item.name)
            entries = value if isinstance(value, tuple) else (value,)
            yield item.name, item.metadata[_TABLES], [one for one in entries if isinstance(one, str)]


def entries_at(pattern: str, tables: Any) -> Iterator[tuple[str, Any, Any]]:
    """Yield the path, the section and the value of each entry that a key names, which may have ``*`` for a name or a number."""
    found = [("", None, tables)]
    for part in pattern.split("."):
        found = [
            (f"{path}.{name}" if path else name, inner, entry)
            for path, _, inner in found
            for name, entry in entries_of(inner, part)
        ]
    yield from found


def entries_of(section: Any, part: str) -> Iterator[tuple[str, Any]]:
    """Yield the entries of a section, a table of names or a list that a part of a key names."""
    if isinstance(section, Mapping):
        yield from ((name, entry) for name, entry in section.items() if part in ("*", name))
    elif isinstance(section, tuple):
        yield from ((str(index), entry) for index, entry in enumerate(section) if part in ("*", str(index)))
    elif hasattr(section, part):
        yield part, getattr(section, part)


def is_given(section: Any, name: str) -> bool:
    """Tell whether a field differs from its default."""
    item = next(item for item in fields(section) if item.name == name)
    default = item.default_factory() if item.default_factory is not MISSING else item.default
    return default is MISSING or getattr(section, name) != default


def _holds(section: Any, other: str, values: tuple[Any, ...]) -> bool:
    """Tell whether one of the other fields is given, or has one of these values."""
    if values:
        return getattr(section, other) in values
    return any(is_given(section, one) for one in other.split(" or "))


def _condition(other: str, values: tuple[Any, ...]) -> str:
    words = (f'"{value}"' if isinstance(value, str) else f"{value:g}" for value in values)
    return f"{other} = {' or '.join(words)}" if values else other


def shown(value: Any) -> str:
    """Say what a field is: a number or a word as it stands, anything else as given."""
    if isinstance(value, bool):
        return f"is {str(value).lower()}"
    if isinstance(value, str):
        return f'is "{value}"'
    return f"is {value:g}" if isinstance(value, int | float) else "is given"

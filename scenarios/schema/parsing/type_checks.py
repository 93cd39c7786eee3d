"""Checks of values against the types of fields, with texts for values that do not fit."""

from __future__ import annotations

import types
from collections.abc import Mapping
from datetime import date, time
from numbers import Integral, Real
from typing import Any, Literal, Union, get_args, get_origin

from scenarios.text.problems import suggestion


class Misfit(ValueError):
    """A value that cannot be taken; `path` leads to the wrong entry in a list or table, `key` is another spelling of its field's name."""

    def __init__(self, text: str, path: tuple[str, ...] = (), key: str = "") -> None:
        super().__init__(text)
        self.text, self.path, self.key = text, path, key


def taken(value: Any, kind: Any) -> Any:
    """Convert `value` to a `kind`, with numbers as Python's own and lists as tuples; Misfit if it does not fit.

    Nothing is guessed: a number in quotes is not a number, true is not 1, and text is not a list of letters. A date or time of TOML is its
    ISO text.
    """
    origin = get_origin(kind)
    if kind is object:
        return value
    if origin in (Union, types.UnionType):
        return _one_of(value, get_args(kind))
    if origin is tuple:
        return _entries(value, kind)
    if origin is Mapping:
        return _table(value, get_args(kind)[1])
    if origin is Literal:
        return _choice(value, get_args(kind))
    if kind in (int, float):
        return _number(value, kind)
    if kind is str and isinstance(value, date | time):  # what TOML makes of a date or a time without quotes
        return value.isoformat()
    if not isinstance(value, kind):
        raise Misfit(f"is {value!r}, allowed: {shape_of(kind)}")
    return value


def shape_of(kind: Any) -> str:
    """Say in words what values of a type look like."""
    names = {int: "a whole number", float: "a number", str: "text in quotes", bool: "true or false"}
    origin, parts = get_origin(kind), [part for part in get_args(kind) if part is not types.NoneType]
    if origin in (Union, types.UnionType):
        return " or ".join(map(shape_of, parts))
    if origin is Literal:
        return ", ".join(map(repr, parts))
    if origin is Mapping:
        return "a table"
    if origin is not tuple:
        return names.get(kind) or kind.__name__
    inner = shape_of(parts[0])
    count = "" if parts[-1] is Ellipsis else f"{len(parts)} "
    if parts[0] in (int, float):
        return f"a list of {count}{inner.removeprefix('a ')}s"
    return f"a list of {count}entries, each {inner}"


def _one_of(value: Any, kinds: tuple[Any, ...]) -> Any:
    """Convert `value` to the first of the kinds that accepts it."""
    if value is None and types.NoneType in kinds:
        return None
    some = [kind for kind in kinds if kind is not types.NoneType]
    if len(some) == 1:
        return taken(value, some[0])
    for kind in some:
        try:
            return taken(value, kind)
        except Misfit:
            continue
    raise Misfit(f"is {value!r}, allowed: {' or '.join(map(shape_of, some))}")


def _entries(value: Any, kind: Any) -> tuple[Any, ...]:
    """Convert a list or tuple, whose entries are all of the same kind."""
    parts = get_args(kind)
    if not isinstance(value, list | tuple) or (parts[-1] is not Ellipsis and len(value) != len(parts)):
        raise Misfit(f"is {value!r}, allowed: {shape_of(kind)}")
    return tuple(_below(str(index), entry, parts[0]) for index, entry in enumerate(value))


def _table(value: Any, kind: Any) -> dict[str, Any]:
    """Convert a mapping from names to values of a kind."""
    if not isinstance(value, Mapping) or not all(isinstance(name, str) for name in value):
        raise Misfit(f"is {value!r}, allowed: a table of names")
    return {name: _below(name, entry, kind) for name, entry in value.items()}


def _below(step: str, value: Any, kind: Any) -> Any:
    try:
        return taken(value, kind)
    except Misfit as misfit:
        raise Misfit(misfit.text, (step, *misfit.path)) from misfit


def _choice(value: Any, choices: tuple[Any, ...]) -> Any:
    if isinstance(value, str) and value in choices:
        return value
    hint = suggestion(value, choices) if isinstance(value, str) else ""
    raise Misfit(f"is {value!r}{hint or ','} allowed: {', '.join(map(repr, choices))}")


def _number(value: Any, kind: type[int | float]) -> int | float:
    if isinstance(value, bool) or not isinstance(value, Integral if kind is int else Real):
        raise Misfit(f"is {value!r}, allowed: {shape_of(kind)}")
    try:
        number = float(value)
    except OverflowError as cause:
        raise Misfit(f"is larger than any float, allowed: {shape_of(kind)}") from cause
    return number if kind is float else int(value)  # type: ignore[call-overload]

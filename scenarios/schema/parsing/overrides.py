"""Changes to a scenario's plain data before it is checked: ``--set a.b=value`` and the ``[demo]`` table."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from typing import Any

from scenarios.schema.parsing.structuring import spellings
from scenarios.text.problems import Problem, ScenarioError, suggestion
from scenarios.text.toml import read_toml

# Keys that give the same quantity in another way: an override with one of them replaces the others.
RIVALS: Mapping[str, tuple[str, ...]] = {
    "oil": ("density", "dynamic_viscosity"),
    "mass": ("density",),
    "density": ("mass",),
}

ORDERED = "orders "  # how the text of an order's event begins
MOST_PARTS = 12  # of a key; the longest that means something has six

_INDEX = r"-?[0-9]{1,9}"  # of an entry of a list, from its end if it is below 0


def parse_override(text: str) -> tuple[tuple[str, ...], Any]:
    """Read ``fluid.particle_spacing=0.06`` as a path and a value; a bare word is text. ScenarioError for another form.

    A key of more parts than `MOST_PARTS` is refused, too: no section lies so deep.
    """
    path, equals, value = text.partition("=")
    keys = tuple(key.strip() for key in path.split("."))
    if not equals or not all(keys):
        raise ScenarioError(
            [Problem("--set", f"is {text!r}, allowed: key=value, for example fluid.particle_spacing=0.06")]
        )
    if len(keys) > MOST_PARTS:
        raise ScenarioError(
            [Problem("--set", f"has a key of {len(keys)} parts, {path[:40]}..., allowed: up to {MOST_PARTS}")]
        )
    try:
        return keys, read_toml(f"value = {value}")["value"]
    except ValueError:
        return keys, value.strip()


def with_override(data: Mapping[str, Any], keys: tuple[str, ...], value: Any) -> dict[str, Any]:
    """Copy `data` with the entry at `keys` replaced or added; lists are reached by index or name. ScenarioError if it is not there."""
    try:
        return _replaced(data, keys, value)
    except LookupError as cause:
        raise ScenarioError([Problem(f"--set {'.'.join(keys)}", str(cause.args[0]))]) from cause


def merged(data: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Copy `data`; the nested tables of `changes` replace or add entries."""
    result = dict(data)
    for key, value in changes.items():
        old = result.get(key)
        if isinstance(value, Mapping) and isinstance(old, Mapping):
            result[key] = merged(old, value)
        else:
            result = _set(result, key, value)
    return result


def _set(table: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Copy a table with `key` set, and remove the keys that give the same quantity in another way."""
    others = {*spellings(key), *RIVALS.get(key, ())} - {key}
    return {name: entry for name, entry in table.items() if name not in others} | {key: value}


def _replaced(data: Any, keys: tuple[str, ...], value: Any) -> Any:
    key, rest = keys[0], keys[1:]
    if isinstance(data, Mapping):
        if not rest:
            return _set(data, key, value)
        return {**data, key: _replaced(data.get(key, {}), rest, value)}
    if isinstance(data, list):
        index = _index(data, key)
        return [*data[:index], _replaced(data[index], rest, value) if rest else value, *data[index + 1 :]]
    raise LookupError(f"leads into {data!r}, which has no entry {key!r}")


def _index(entries: list[Any], key: str) -> int:
    """Find the entry with this index or, in a list of tables, this name; LookupError if there is none."""
    names = [str(entry.get("name", "")) for entry in entries if isinstance(entry, Mapping)]
    if key in names:
        return next(i for i, entry in enumerate(entries) if isinstance(entry, Mapping) and entry.get("name") == key)
    if re.fullmatch(_INDEX, key) and -len(entries) <= int(key) < len(entries):
        return int(key) % len(entries)
    if not entries:
        raise LookupError(f"names entry {key!r} of an empty list, allowed: the whole list")
    hint = suggestion(key, names) or ","
    raise LookupError(
        f"names entry {key!r}{hint} allowed: 0 to {len(entries) - 1}" + "".join(f", {n}" for n in names if n)
    )


def settings_of(text: str) -> tuple[str, ...]:
    """Return the settings that the text of an event orders; none if it is no order's text. ScenarioError for one that is damaged."""
    if not text.startswith(ORDERED):
        return ()
    try:
        return tuple(shlex.split(text.removeprefix(ORDERED)))
    except ValueError as error:
        raise ScenarioError([Problem("the event", f"{text!r} cannot be read: {error}")], "oilsim") from error

"""Checks of orders that act together: those of a crew, of a run that goes on, and of a scenario's own injects.

Orders change the tables of a scenario, and every check of those tables holds for them. Some tables may not be readable; what lies in them
is said there, and is no fault of an order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

from scenarios.controls.signals import Signal, signals_of
from scenarios.controls.table import KEYS, NEW_TABLES, contradictions, matches, why_unfelt
from scenarios.schema.cross_checks import problems_between
from scenarios.schema.parsing.compass import section_without_compass
from scenarios.schema.parsing.overrides import parse_override, with_override
from scenarios.schema.parsing.quantity_fields import field_kinds
from scenarios.schema.parsing.structuring import as_data, spellings, structure
from scenarios.schema.tables import Parts
from scenarios.text.problems import Problem, ScenarioError, suggestion, unknown

SIGNALS_SHOWN = 8  # signals that an error names
PARTED = ("booms.*.parted",)  # joints that part add up
Keys = tuple[str, ...]


def condition_signals(parts: Parts) -> dict[str, Signal]:
    """List the signals that a condition may name: all that a run gives."""
    return {name: one for name, one in signals_of(parts).items() if not one.is_input}


def inject_problems(parts: Parts) -> Iterator[Problem]:
    """Yield every problem of the injects: of their conditions' signals, and of their orders."""
    signals = condition_signals(parts)
    for name, inject in parts.injects.items():
        wanted = None if inject.when is None else inject.when.signal
        if wanted is not None and wanted not in signals and not _is_unread(tuple(wanted.split(".")), parts):
            hint = suggestion(wanted, signals) or ","
            near = [signal for signal in signals if signal.split(".")[:2] == wanted.split(".")[:2]] or list(signals)
            shown = ", ".join(near[:SIGNALS_SHOWN]) + (", ..." if len(near) > SIGNALS_SHOWN else "")
            text = f"is {wanted!r}, which is no signal of the run{hint} allowed: {shown or 'none is there'}"
            yield Problem(f"injects.{name}.when.signal", text)
        repeated = contradictions([order.partition("=")[0].split(".") for order in inject.orders])
        for problem in (*repeated, *order_problems(inject.orders, parts)):
            path = problem.path.removeprefix("--set").strip()
            text = f"{path}, which {problem.text}" if path else problem.text.removeprefix("is ")
            yield Problem(f"injects.{name}.orders", f"has {text}")


def order_problems(settings: Sequence[str], parts: Parts) -> list[Problem]:
    """Return what is wrong with orders, given together to a run of these tables.

    A path is ``--set KEY`` for what cannot be ordered, and that of the entry for a value that it cannot have. An order that changes nothing
    is judged by its key: it is given, and logged, even if it already holds.
    """
    there = {table: getattr(parts, table) for table in field_kinds(Parts) if table not in ("names", "given")}
    before = {table: as_data(section) for table, section in there.items() if section is not None}
    found, taken, after = list[Problem](), list[Keys](), before
    for setting in settings:
        try:
            keys, value = parse_override(setting)
            text = _why_not(keys, value, parts)
            after = after if text else with_order(after, keys, value)
        except ScenarioError as error:
            found += error.problems
            continue
        if text:
            found.append(Problem(f"--set {'.'.join(keys)}", text))
        else:
            taken.append(keys)
    changed, misfits = _restructured({_place(keys, parts) for keys in taken}, after, parts)
    found += misfits
    after = before | {table: as_data(getattr(changed, table)) for table in before.keys() | {keys[0] for keys in taken}}
    for keys in taken:
        found += _not_orders(keys, before, after)
    found += _mended(before, after)
    if not found and changed is not parts:
        known = set(problems_between(parts))
        found += [problem for problem in problems_between(changed) if problem not in known]
    return found


def with_order(data: Mapping[str, Any], keys: Keys, value: Any) -> dict[str, Any]:
    """Return the plain data of a scenario with an order; joints of a boom that part do so beside those that have."""
    if matches(".".join(keys), PARTED) and isinstance(value, list):
        parted = data.get("booms", {}).get(keys[1], {}).get("parted", [])
        value = [*parted, *(number for number in value if number not in parted)]
    return with_override(data, keys, value)


def entries_of(keys: Sequence[str], data: Mapping[str, Any]) -> list[str]:
    """List the paths of all entries that a key, in any spelling, names, contains or lies in; the key itself if there is none."""
    return [path for path, _ in leaves(data) if _overlap(path, keys)] or [".".join(keys)]


def leaves(data: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every entry that is not a table, with its path; lists are entries."""
    for key, value in data.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", value


def _why_not(keys: Keys, value: Any, parts: Parts) -> str:
    """Say why a setting is no order to a run of these tables, by its key; empty if it is one."""
    path, table, name = ".".join(keys), keys[0], keys[1] if len(keys) > 1 else ""
    if not any(key.startswith(f"{table}.") for key in KEYS):
        return _unchangeable(table)
    if table in parts.names and name not in parts.names[table] and not matches(f"{table}.{name}", NEW_TABLES):
        return f"names {name!r}, which {unknown(name, parts.names[table], f'entry of {table}')}"
    if matches(path, ["injects.*.given"]) and name in parts.injects and parts.injects[name].given:
        return "has been given already, allowed: once"
    if matches(path, PARTED) and value == []:
        return "is [], allowed: numbers of joints that part; one that has parted stays so"
    return "" if _is_unread(keys, parts) else why_unfelt(keys, parts)


def _unchangeable(table: str) -> str:
    """Say that an entry cannot be ordered, and which of its table can."""
    allowed = [key for key in KEYS if key.startswith(f"{table}.")] or KEYS
    added = f"what a run began without: {', '.join(NEW_TABLES)}; with --resume: run.duration, run.threads"
    return f"cannot be changed during a run, allowed: {', '.join(allowed)}; {added}"


def _place(keys: Keys, parts: Parts) -> Keys:
    """Return the keys that lead to the section in which an order lies."""
    return keys[:2] if keys[0] in parts.names else keys[:1]


def _is_unread(keys: Keys, parts: Parts) -> bool:
    """Tell whether keys lead into a section that could not be read, which is said there."""
    table = getattr(parts, keys[0], None)
    if keys[0] not in parts.names:
        return keys[0] in parts.given and table is None
    return len(keys) > 1 and keys[1] in parts.names[keys[0]] and keys[1] not in (table or ())


def _restructured(places: set[Keys], data: Mapping[str, Any], parts: Parts) -> tuple[Parts, list[Problem]]:
    """Return the parts with the sections at these places read from plain data, and what is wrong with those that cannot be."""
    bearing = 0.5 * math.pi if parts.site is None else parts.site.bearing
    found = list[Problem]()
    for place in sorted(places):
        if _is_unread(place, parts):
            continue
        table, kind = place[0], field_kinds(Parts)[place[0]]
        entry = data[table][place[1]] if len(place) > 1 else data[table]
        entry, misread = section_without_compass(entry, place, bearing)
        try:
            if misread:
                raise ScenarioError(misread)
            section = structure(entry, get_args(kind)[1] if len(place) > 1 else kind)
        except ScenarioError as error:
            prefix = "" if misread else ".".join(place)
            found += [problem.below(prefix) for problem in error.problems]
            continue
        changes: dict[str, Any] = {table: section}
        if len(place) > 1:
            names = tuple(dict.fromkeys((*parts.names[table], place[1])))
            changes = {table: {**getattr(parts, table), place[1]: section}, "names": {**parts.names, table: names}}
        parts = replace(parts, **changes)
    return parts, found


def _not_orders(keys: Keys, before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Problem]:
    """Yield a problem for every entry under a key, among all that changed, that can only be set before a run."""
    old, new = dict(leaves(before)), dict(leaves(after))
    changed = sorted(path for path in old.keys() | new.keys() if old.get(path) != new.get(path))
    for path in [path for path in changed if _overlap(path, keys)] or entries_of(keys, before):
        if not matches(path, KEYS) and not _is_new(path, before):
            yield Problem(f"--set {path}", _unchangeable(keys[0]))


def _is_new(path: str, before: Mapping[str, Any]) -> bool:
    """Return whether a path lies in a table that an order may add, and that is not there before."""
    outer, _, rest = path.partition(".")
    name = rest.partition(".")[0]
    return matches(f"{outer}.{name}", NEW_TABLES) and name not in before.get(outer, {})


def _mended(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Problem]:
    """Yield the mooring legs and ties that would hold again but have parted, and ties that would be loose again."""
    for name, tie in before.get("ties", {}).items():
        if tie["made_fast"] and not after["ties"][name]["made_fast"]:
            text = f"is false, allowed: true, because the tie has been made fast; ties.{name}.parted=true casts it off"
            yield Problem(f"--set ties.{name}.made_fast", text)
        if tie["parted"] and after["ties"][name]["made_fast"] and not tie["made_fast"]:
            yield Problem(f"--set ties.{name}.made_fast", "is true, allowed: false, because the tie has parted")
    for table, what in (("moorings", "leg"), ("ties", "tie")):
        for name, line in before.get(table, {}).items():
            if line["parted"] and not after[table][name]["parted"]:
                yield Problem(f"--set {table}.{name}.parted", f"is false, allowed: true, because the {what} has parted")


def _overlap(path: str, keys: Sequence[str]) -> bool:
    """Return whether a path, in any spelling, is what a key names, contains it, or lies in it."""
    return all(part in spellings(key) for part, key in zip(path.split("."), keys, strict=False))

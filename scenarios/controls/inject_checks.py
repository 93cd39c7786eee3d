"""Checks of a scenario's injects before anything is built: their orders, and the signals of their conditions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol

from scenarios.controls.signals import Signal, SignalTables, signals_of
from scenarios.controls.table import KEYS, NEW_TABLES, contradictions, matches, plain_path, why_unfelt
from scenarios.schema.injects import InjectSettings
from scenarios.schema.liquid import PipeEmitterSettings
from scenarios.schema.parsing.compass import section_without_compass
from scenarios.schema.parsing.overrides import parse_override, with_override
from scenarios.schema.parsing.structuring import as_data, structure
from scenarios.schema.run_settings import SiteSettings
from scenarios.text.problems import Problem, ScenarioError, moved, suggestion, unknown

SIGNALS_SHOWN = 8  # signals that an error names


class InjectTables(SignalTables, Protocol):
    """The tables of a scenario that injects name, all its names by table, and the tables that it has, readable or not."""

    @property
    def injects(self) -> Mapping[str, InjectSettings]:
        """Injects by name."""

    @property
    def given(self) -> frozenset[str]:
        """Names of all tables."""

    @property
    def site(self) -> SiteSettings | None:
        """Place on Earth."""

    @property
    def names(self) -> Mapping[str, tuple[str, ...]]:
        """All names by table, those of entries that could not be read too."""


def condition_signals(exercise: SignalTables) -> dict[str, Signal]:
    """List the signals that a condition may name: all that a run gives."""
    return {name: one for name, one in signals_of(exercise).items() if not one.is_input}


def inject_problems(parts: InjectTables) -> Iterator[Problem]:
    """Yield every problem of the injects."""
    signals = condition_signals(parts)
    for name, inject in parts.injects.items():
        wanted = None if inject.when is None else inject.when.signal
        if wanted is not None and wanted not in signals and not _is_unread(wanted.split("."), parts):
            hint = suggestion(wanted, signals) or ","
            near = [signal for signal in signals if signal.split(".")[:2] == wanted.split(".")[:2]] or list(signals)
            shown = ", ".join(near[:SIGNALS_SHOWN]) + (", ..." if len(near) > SIGNALS_SHOWN else "")
            text = f"is {wanted!r}, which is no signal of the run{hint} allowed: {shown or 'none is there'}"
            yield Problem(f"injects.{name}.when.signal", text)
        for problem in _order_problems(inject.orders, parts):
            text = f"{problem.path}, which {problem.text}" if problem.path else problem.text
            yield Problem(f"injects.{name}.orders", f"has {text}")


def _is_unread(keys: Sequence[str], parts: InjectTables) -> bool:
    """Tell whether a signal is of an entry that could not be read, which is said there."""
    return len(keys) > 1 and keys[1] in parts.names.get(keys[0], ()) and keys[1] not in getattr(parts, keys[0])


def _order_problems(orders: tuple[str, ...], parts: InjectTables) -> Iterator[Problem]:
    """Yield what is wrong with orders that act together."""
    touched: dict[tuple[str, ...], Any] = {}
    read = list[tuple[str, ...]]()
    for order in orders:
        try:
            keys, value = parse_override(order)
        except ScenarioError as error:
            yield from (Problem("", problem.text.removeprefix("is ")) for problem in error.problems)
            continue
        read.append(keys)
        fault = _fault(keys, value, parts)
        if fault:
            yield Problem(".".join(keys), fault)
            continue
        place = keys[:2] if keys[0] in parts.names else keys[:1]
        before = touched.get(place, as_data(_entry(place, parts)))
        try:
            rest = keys[len(place) :]
            touched[place] = value if not rest else with_override(before or {}, rest, value)
        except ScenarioError as error:
            yield from (Problem(".".join(keys), problem.text) for problem in error.problems)
    yield from contradictions(read)
    for place, data in touched.items():
        yield from _misfits(place, data, parts)


def _fault(keys: tuple[str, ...], value: Any, parts: InjectTables) -> str:
    """Say why a setting is no order to a run of this scenario; empty if it is one."""
    if text := moved(".".join(keys)):
        return text
    table, name = keys[0], keys[1] if len(keys) > 1 else ""
    paths = [plain_path((*keys, *leaf)) for leaf in _leaves(value)]
    is_whole = len(keys) == 2 and isinstance(value, Mapping)  # orders since the start may have added the table
    is_new = matches(".".join(keys[:2]), NEW_TABLES) and (is_whole or not _is_there(table, name, parts))
    if not is_new and not all(_is_order(path) for path in paths):
        allowed = [key for key in KEYS if key.startswith(f"{table}.")] or KEYS
        return f"cannot be ordered, allowed: {', '.join(allowed)}"
    if table in parts.given and table not in parts.names and getattr(parts, table, None) is None:
        return ""  # the table itself could not be read, which is said
    if table in parts.names and not is_new and name not in parts.names[table]:
        return f"names {name!r}, which {unknown(name, parts.names[table], f'entry of {table}')}"
    return why_unfelt(keys, parts)


def _is_order(path: str) -> bool:
    """Return whether a path is a key that may be ordered, or lies in one, such as a leg of a course."""
    parts = path.split(".")
    return any(matches(".".join(parts[:length]), KEYS) for length in range(1, len(parts) + 1))


def _is_there(table: str, name: str, parts: InjectTables) -> bool:
    if table in parts.names:
        return name in parts.names[table]
    return getattr(getattr(parts, table, None), name, None) is not None


def _entry(place: tuple[str, ...], parts: InjectTables) -> Any:
    """Return the section at a place; None where there is none, or where it could not be read."""
    section = getattr(parts, place[0], None)
    return section.get(place[1]) if isinstance(section, Mapping) and len(place) > 1 else section


def _misfits(place: tuple[str, ...], data: Any, parts: InjectTables) -> Iterator[Problem]:
    """Yield what is wrong with the section at a place once the orders have changed it."""
    section = _entry(place, parts)
    if section is None and place[0] != "emitters":
        return  # it has been reported, or nothing feels it
    data, misread = section_without_compass(data, place, math.pi / 2 if parts.site is None else parts.site.bearing)
    yield from misread
    if misread:
        return
    try:
        if section is None:
            structure(data, PipeEmitterSettings)
        else:
            structure(data, type(section))
    except ScenarioError as error:
        for problem in error.problems:
            yield Problem(".".join((*place, problem.path)), problem.text)


def _leaves(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Yield the paths of all entries of a value that are no tables."""
    if isinstance(value, Mapping) and value:
        for key, entry in value.items():
            yield from _leaves(entry, (*path, key))
    else:
        yield path

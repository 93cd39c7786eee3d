"""Names of figures and of varied entries in words, with their units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from oilsim.quantity import quantities
from scenarios.scenario import Scenario
from scenarios.schema.parsing.structuring import COMPASS

_UNITS = {"_m3": "m³", "_deg": "°", "_kn": "kn", "_n": "N", "_m": "m"}  # by the end of a part of a key
_COMPASS_UNIT = "° clockwise from north"


def figure_in_words(key: str) -> str:
    """Return a figure's key in words, with its unit: ``scores.main.tow_tension_n.port.mean`` as "main tow tension port mean [N]"."""
    parts, unit = key.removeprefix("scores.").split("."), ""
    for number, part in enumerate(parts):
        end = next((end for end in _UNITS if part.endswith(end)), None)
        if end is not None:
            parts[number], unit = part.removesuffix(end), _UNITS[end]
    return _labelled(parts, unit)


def entry_in_words(scenario: Scenario, key: str) -> str:
    """Return the key of a varied entry in words, with its unit: ``sea.wind.speed`` as "sea wind speed [m/s]".

    A number without a unit, and what is no number, has none.
    """
    parts = key.split(".")
    *path, name = parts
    if name in COMPASS:
        return _labelled([*path, COMPASS[name]], _COMPASS_UNIT)
    if name.isdigit() and path:  # a component of a vector, such as tank.upper.2
        *path, name = path
    unit = _unit(scenario, path, name)
    return _labelled(parts, unit) if unit else figure_in_words(key)


def _unit(scenario: Scenario, path: Sequence[str], name: str) -> str:
    """Return the unit of the field `name` of the table at `path`; empty if that table declares no such field."""
    table: Any = scenario
    for part in path:
        if isinstance(table, Mapping):
            table = table.get(part)
        else:
            table = table[int(part)] if isinstance(table, tuple) else getattr(table, part, None)
    declared = quantities(type(table)).get(name)
    return declared.unit if declared is not None else ""


def _labelled(parts: Sequence[str], unit: str) -> str:
    words = " ".join(parts).replace("_", " ")
    return f"{words} [{unit}]" if unit else words

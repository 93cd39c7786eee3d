"""The shipped oils: by short name, by record of the ADIOS library, or by full name; and a search among them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from importlib.resources import files
from types import MappingProxyType

from scenarios.oils.properties import Measurement, OilRecord
from scenarios.text.problems import suggestion

SHORT_NAMES: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "gasoline": ("AD00466", "motor gasoline"),
        "diesel": ("AD02084", "diesel fuel"),
        "brent": ("AD00192", "light North Sea crude"),
        "statfjord": ("AD01040", "light North Sea crude"),
        "gullfaks": ("AD01454", "medium North Sea crude"),
        "arabian-light": ("AD02002", "light Gulf crude"),
        "alaska-north-slope": ("AD02574", "medium Alaskan crude"),
        "arabian-medium": ("AD00059", "medium Gulf crude"),
        "maya": ("AD00730", "heavy Mexican crude"),
        "heavy-fuel-300": ("AD02184", "intermediate fuel oil 300, a ship's bunker"),
        "bunker-c": ("AD02051", "heavy fuel oil number 6"),
        "boscan": ("AD02042", "extra-heavy Venezuelan crude"),
    }
)
"""Short names of common oils: record in the library, and a description."""
_DETAIL = re.compile(r"[,(]|\b\d{4}\b")  # where the name of an oil ends, and those of its sample begin


@lru_cache(maxsize=1)
def library() -> Mapping[str, OilRecord]:
    """Read the oils, by record."""
    points: dict[str, list[Measurement]] = {}
    for row in _rows("measurements.csv"):
        values = (float(row["temperature"]), float(row["evaporated"]), float(row["value"]))
        points.setdefault(row["record"], []).append(Measurement(row["quantity"], *values))
    oils = {
        row["record"]: OilRecord(
            record=row["record"],
            name=row["name"],
            location=row["location"],
            product=row["product"],
            reference=row["reference"],
            api=_optional(row["api"]),
            pour_point=_optional(row["pour_point"]),
            interfacial_tension=_optional(row["interfacial_tension"]),
            measurements=tuple(points[row["record"]]),
        )
        for row in _rows("oils.csv")
    }
    sampled: dict[str, list[OilRecord]] = {}
    for oil in oils.values():
        if any(point.evaporated for point in oil.measurements):
            sampled.setdefault(_plain_name(oil.name), []).append(oil)
    return MappingProxyType(
        {record: replace(oil, relatives=tuple(sampled.get(_plain_name(oil.name), ()))) for record, oil in oils.items()}
    )


def _plain_name(name: str) -> str:
    """Return the name of an oil without its year, place of the sample and company: ALASKA NORTH SLOPE of ALASKA NORTH SLOPE 2011."""
    return _DETAIL.split(name)[0].strip()


def refusals() -> list[dict[str, str]]:
    """Read the refusals: record, name, refused ("oil", or "value" of one that is kept) and reason."""
    return _rows("refused.csv")


def fault_of(name: str) -> str:
    """Say why `name` names no single oil, and which are near; empty if it names one."""
    found = _matches(name)
    if len(found) == 1:
        return ""
    if found:
        return f"names {len(found)} oils, allowed: one record, {', '.join(oil.record for oil in found)}"
    for row in refusals():
        if row["record"] == name.strip().upper() and row["refused"] == "oil":
            return f"is refused ({row['reason']}), allowed: another record of the ADIOS library (oilsim oils SEARCH)"
    hint = suggestion(name, [*SHORT_NAMES, *(oil.name.lower() for oil in library().values())])
    allowed = f"{', '.join(SHORT_NAMES)}, or a record or name of the ADIOS library (oilsim oils SEARCH)"
    return f"is no oil{hint}{' ' if hint else ', '}allowed: {allowed}"


def oil_named(name: str) -> OilRecord:
    """Return the oil of a short name, a record or a full name; ValueError says why there is no single one."""
    fault = fault_of(name)
    if fault:
        raise ValueError(f"{name!r} {fault}")
    return _matches(name)[0]


def search(words: Iterable[str]) -> list[OilRecord]:
    """List the oils whose record, name, short name, location or product contains every word, by name."""
    wanted = [word.casefold() for word in words]
    short = {record: name for name, (record, _) in SHORT_NAMES.items()}
    found = [
        oil
        for oil in library().values()
        if all(
            word in f"{oil.record} {oil.name} {short.get(oil.record, '')} {oil.location} {oil.product}".casefold()
            for word in wanted
        )
    ]
    return sorted(found, key=lambda oil: (oil.name, oil.record))


def _matches(name: str) -> list[OilRecord]:
    wanted = name.strip().casefold()
    if wanted in SHORT_NAMES:
        return [library()[SHORT_NAMES[wanted][0]]]
    if wanted.upper() in library():
        return [library()[wanted.upper()]]
    return [oil for oil in library().values() if oil.name.casefold() == wanted]


def _rows(name: str) -> list[dict[str, str]]:
    text = files("scenarios.oils").joinpath(name).read_text(encoding="utf-8")
    return list(csv.DictReader(io.StringIO(text, newline="")))


def _optional(text: str) -> float | None:
    return float(text) if text else None

"""The units in which a run's picture shows its usual diagrams: those of a response school, where recordings are in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from scipy.constants import degree, hour, knot


@dataclass(frozen=True)
class Unit:
    """A unit: its name, its size and the least magnitude that is shown in it, both in the unit of the recording."""

    name: str
    size: float
    least: float = 0.0


_SHOWN: Mapping[str, tuple[Unit, ...]] = {  # of each unit of a recording; the first whose `least` is reached
    "m³": (Unit("m³", 1.0, 2.0), Unit("litres", 1e-3)),
    "m/s": (Unit("knots", knot),),
    "m³/s": (Unit("m³/h", 1.0 / hour),),
    "N": (Unit("kN", 1e3, 1e3), Unit("N", 1.0)),
    "rad": (Unit("degrees", degree),),
}


def shown_in(title: str, largest: float) -> tuple[str, float]:
    """Return the title of a diagram in the unit that it is shown in, and the factor for its values; largest: their magnitude.

    title: as in `recordings.sink.plots`, its unit in brackets at its end. Other units stay as they are.
    """
    words, _, unit = title.removesuffix("]").rpartition(" [")
    chosen = next((one for one in _SHOWN.get(unit, ()) if largest >= one.least), None)
    return (f"{words} [{chosen.name}]", 1.0 / chosen.size) if chosen else (title, 1.0)

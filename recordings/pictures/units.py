"""The units in which a run's picture shows its usual diagrams: those of a response school, where recordings are in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from scipy.constants import degree

from oilsim.physical_constants import HOUR, KNOT


@dataclass(frozen=True)
class Unit:
    """A unit: its name, its size and the least magnitude that is shown in it, both in the unit of the recording."""

    name: str
    size: float
    least: float = 0.0


_SHOWN: Mapping[str, tuple[Unit, ...]] = {  # of each unit of a recording; the first whose `least` is reached
    "m³": (Unit("m³", 1.0, 2.0), Unit("litres", 1e-3)),
    "m/s": (Unit("knots", KNOT),),
    "m³/s": (Unit("m³/h", 1.0 / HOUR),),
    "N": (Unit("kN", 1e3, 1e3), Unit("N", 1.0)),
    "rad": (Unit("degrees", degree),),
}


def unit_for(unit: str, largest: float) -> tuple[str, float]:
    """Return the name of the unit in which values of a `unit` of the recording are shown, and the factor for them.

    largest: their magnitude, in `unit`. Units that the pictures do not change come back with the factor 1.
    """
    chosen = next((one for one in _SHOWN.get(unit, ()) if largest >= one.least), Unit(unit, 1.0))
    return chosen.name, 1.0 / chosen.size


def shown_in(title: str, largest: float) -> tuple[str, float]:
    """Return the title of a diagram in the unit that it is shown in, and the factor for its values.

    title: as in `recordings.sink.plots`, with its unit in brackets at its end; largest: magnitude of the values, in that unit.
    """
    words, bracket, unit = title.removesuffix("]").rpartition(" [")
    if not bracket:
        return title, 1.0
    name, factor = unit_for(unit, largest)
    return f"{words} [{name}]", factor

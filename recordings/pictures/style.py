"""The look of diagrams: fonts, lines and colours, and the units in which people read quantities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.colors import to_rgb
from matplotlib.patheffects import AbstractPathEffect, withStroke
from scipy.constants import degree

from oilsim.core.physical_constants import HOUR, KNOT

INK = "#26323b"
EDGE = "#6b7a86"  # round what is nearly white
_LIGHT = 0.9  # luminance from which a colour does not show on white
EVENT_COLORS = {"info": "#6b7a86", "warning": "#d9822b", "error": "#c23030"}
STYLE: dict[Any, Any] = {
    "font.size": 10.5,
    "axes.edgecolor": "#9aa7b1",
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titleweight": "bold",
}


def is_light(color: Any) -> bool:
    """Return whether a colour does not show on white, by its luminance (ITU-R BT.709)."""
    red, green, blue = to_rgb(color)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue > _LIGHT


def edge_of_light(color: Any, width: float) -> Sequence[AbstractPathEffect]:
    """Return the effects by which a line of a width [points] shows on white: an edge round a light colour, none for others."""
    return [withStroke(linewidth=width + 1.6, foreground=EDGE)] if is_light(color) else []


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

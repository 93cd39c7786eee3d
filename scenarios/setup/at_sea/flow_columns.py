"""Columns of a table of winds or currents: their names, their units, and the velocity that they give.

    time                                    since the start of the run
    x_velocity, y_velocity                  along the axes of the world
    eastward_velocity, northward_velocity   turned by the bearing of the x axis
    speed, direction                        to where it goes, counter-clockwise from +x, as in scenario files
    speed, from_direction or to_direction   clockwise from north, as in weather reports

Speeds are in a unit that `coupling.master.units` knows, as m/s or kn, directions in deg or rad.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coupling.master.units import conversion, read_unit

Double = NDArray[np.float64]

UNITS = {
    "time": "s", "x_velocity": "m/s", "y_velocity": "m/s", "eastward_velocity": "m/s", "northward_velocity": "m/s", "speed": "m/s",
    "direction": "rad", "from_direction": "rad", "to_direction": "rad",
}  # fmt: skip
PAIRS = (
    ("x_velocity", "y_velocity"),
    ("eastward_velocity", "northward_velocity"),
    ("speed", "direction"),
    ("speed", "from_direction"),
    ("speed", "to_direction"),
)
EXAMPLES = {"s": "s, min, h, d", "m/s": "m/s, km/h, kn", "rad": "deg, rad"}
# names of units in weather files, beside those of `coupling.master.units`
SPELLINGS = {
    "second": "s", "seconds": "s", "sec": "s", "minute": "min", "minutes": "min", "hour": "h", "hours": "h", "hr": "h", "day": "d",
    "days": "d", "degree": "deg", "degrees": "deg", "knot": "kn", "knots": "kn", "radian": "rad", "radians": "rad",
}  # fmt: skip


class FlowFileError(ValueError):
    """All that is wrong with a file of winds or currents, as texts."""

    def __init__(self, texts: list[str]) -> None:
        super().__init__("; ".join(texts))
        self.texts = texts


@dataclass(frozen=True)
class Column:
    """A column of a file: its place in words, its unit as written, and its values (N,), in their unit."""

    place: str
    unit: str
    values: Double


def in_si(name: str, column: Column) -> tuple[Double | None, str | None]:
    """Convert the column called `name` to its SI unit, (N,) in [s], [m/s] or [rad]; return the values, or a text about its unit."""
    target = UNITS[name]
    source = read_unit(SPELLINGS.get(column.unit, column.unit))
    factor = None if source is None else conversion(source, read_unit(target))  # type: ignore[arg-type]
    if not column.unit or factor is None:
        given = f"has the unit {column.unit!r}" if column.unit else "has no unit"
        return None, f"{column.place} {given}, allowed: {EXAMPLES[target]}"
    return column.values * factor.factor + factor.offset, None


def velocity_of(columns: Mapping[str, Column], bearing: float) -> Double:
    """Return the velocities (N, 2) [m/s] in the world that the columns give.

    bearing [rad] of the x axis, clockwise from north. Raises FlowFileError with everything that is missing, doubled or of another unit.
    """
    pairs = [pair for pair in PAIRS if set(pair) <= set(columns)]
    given = [name for name in columns if name != "time"]
    if len(pairs) != 1 or len(given) != 2:
        choices = "; ".join(" and ".join(pair) for pair in PAIRS)
        raise FlowFileError(
            [f"has the columns {', '.join(given) or 'none'} beside time, allowed: one pair of {choices}"]
        )
    converted = {name: in_si(name, columns[name]) for name in pairs[0]}
    texts = [text for _, text in converted.values() if text]
    texts += [text for name, (values, _) in converted.items() for text in _signs(name, columns[name], values)]
    if texts:
        raise FlowFileError(texts)
    first, second = (values for values, _ in converted.values())
    assert first is not None and second is not None
    return _in_world(pairs[0], first, second, bearing)


def _signs(name: str, column: Column, values: Double | None) -> Iterator[str]:
    """Say that a speed is negative."""
    if name == "speed" and values is not None and (values < 0.0).any():
        row = int(np.flatnonzero(values < 0.0)[0])
        yield f"{column.place} is {column.values[row]:g} {column.unit} in row {row}, allowed: 0 or more"


def _in_world(pair: tuple[str, str], first: Double, second: Double, bearing: float) -> Double:
    """Return velocities (N, 2) [m/s] in the world from the two columns of a pair [m/s], [rad]."""
    if pair[0] == "x_velocity":
        return np.stack([first, second], -1)
    if pair[1] == "direction":
        return np.stack([first * np.cos(second), first * np.sin(second)], -1)
    east, north = first, second
    if pair[0] == "speed":
        to = second + (math.pi if pair[1] == "from_direction" else 0.0)
        east, north = first * np.sin(to), first * np.cos(to)
    # the x axis points to (sin bearing, cos bearing) in (east, north), the y axis a quarter turn to its left
    s, c = math.sin(bearing), math.cos(bearing)
    return np.stack([east * s + north * c, north * s - east * c], -1)

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
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coupling.master.units import conversion, read_unit
from oilsim.sea.flows import FASTEST

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


# [in the column's unit] values that stand for missing ones in weather files; paper (NDBC, DWD, WMO: nines in all digits of a field)
MARKERS = (99.0, 99.9, 99.99, 999.0, 999.9, 999.99, 9999.0, 9999.9, 99999.0)
# [1] share by which a number differs from itself in single precision; numerical
ROUNDING = 1e-6


class FlowFileError(ValueError):
    """All that is wrong with a file of winds or currents, as texts."""

    def __init__(self, texts: list[str]) -> None:
        super().__init__("; ".join(texts))
        self.texts = texts


@dataclass(frozen=True)
class Column:
    """A column of a file: its place in words, its unit as written, its values (N,), in their unit, and their lines in a text file."""

    place: str
    unit: str
    values: Double
    lines: Sequence[int] = ()

    def at(self, row: int) -> str:
        """Say where a row is: by its line, or by its number from 0."""
        return f"line {self.lines[row]}" if self.lines else f"row {row}"


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
    texts += [text for name, (values, _) in converted.items() for text in _limits(name, columns[name], values)]
    if texts:
        raise FlowFileError(texts)
    first, second = (values for values, _ in converted.values())
    assert first is not None and second is not None
    return _in_world(pairs[0], first, second, bearing)


def _limits(name: str, column: Column, values: Double | None) -> Iterator[str]:
    """Say where a column first holds no number, a marker of missing data, or what no wind, current or direction is.

    values (N,) [m/s] or [rad], None of a column whose unit is unknown.
    """
    if values is None:
        return
    size, given = np.abs(values), column.values
    wrong: list[tuple[Any, str]] = [(~np.isfinite(given), "finite numbers, and no empty values")]
    if UNITS[name] == "rad":
        wrong.append((size > 2.0 * math.pi * (1.0 + ROUNDING), "-360 to 360 deg"))
    else:
        marked = np.isclose(np.abs(given)[:, None], MARKERS, rtol=ROUNDING, atol=0.0).any(axis=1)
        wrong.append((marked, "measured values; it marks missing data"))
        wrong.append((size > FASTEST, f"up to {FASTEST:g} m/s"))
    if name == "speed":
        wrong.append((values < 0.0, "0 or more"))
    for is_wrong, allowed in wrong:
        rows = np.flatnonzero(is_wrong)
        if rows.size:
            more = f" and {rows.size - 1} more" if rows.size > 1 else ""
            yield f"{column.place} is {given[rows[0]]:g} {column.unit} in {column.at(int(rows[0]))}{more}, allowed: {allowed}"
            return


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

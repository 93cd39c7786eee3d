"""Tables of winds and currents from files: CSV with units in the header, and CF NetCDF in its classic format.

A CSV has one header, as ``time [h], speed [kn], from_direction [deg]``; lines that begin with # are skipped. The column time counts from
the start of the run, or is ``time [UTC]`` with dates after ISO 8601. A NetCDF file has one point, or none, beside its time; its variables
are found by their standard names (grids: `flow_maps`). Dates need the date of the run's start, which [site] gives.

Dates in the calendars of CF 1.8 (section 4.4.1), as seconds since a day that all of them share.

`standard`, the default, and `gregorian` are the mixed calendar: Julian until 4 October 1582, Gregorian from the day after it, 15 October.
`proleptic_gregorian` has the Gregorian rule, and `julian` the Julian one, at all times. The other calendars have no days of the real
world (years of 360 or 365 days), or no dates at all (`none`), so a run, which begins on a real date, has no place in them.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Mapping
from datetime import UTC, date, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from oilsim.sea import FlowTable
from scenarios.schema.run_settings import SiteSettings
from scenarios.setup.at_sea.flow_columns import SPELLINGS, UNITS, Column, FlowFileError, in_si, velocity_of
from scenarios.text.problems import reason_of

if TYPE_CHECKING:
    from scipy.io import netcdf_file

MIXED = ("standard", "gregorian", "")
CALENDARS = ("standard", "gregorian", "proleptic_gregorian", "julian")
SINCE = re.compile(r"\s*(\w+)\s+since\s+(.+?)\s*")
_DATE = re.compile(
    r"(-?\d{1,4})-(\d{1,2})-(\d{1,2})"
    r"(?:(?:\s*T\s*|\s+)(\d{1,2})(?::(\d{1,2})(?::(\d{1,2}(?:\.\d*)?))?)?)?"
    r"\s*(?:(Z|UTC|GMT)|([+-]?)(\d{1,2})(?::?(\d{2}))?)?",
    re.IGNORECASE,
)


def seconds_of(text: str, calendar: str) -> float:
    """Return the time [s] of a date since the day before 0001-01-01 of the proleptic Gregorian calendar, in UTC.

    text: as CF and UDUNITS write dates, ``1990-1-1``, ``2026-05-01T08:00:00Z``, ``2026-05-01 10:00 +2:00``. Raises ValueError, whose text
    goes on after the name of a variable, for a text that is none, a date that the calendar does not have, and a calendar without dates.
    """
    if calendar.lower() not in (*CALENDARS, ""):
        raise ValueError(
            f"has the calendar {calendar!r}, allowed: {', '.join(CALENDARS)}; others have no dates of the real world"
        )
    match = _DATE.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"counts from {text!r}, allowed: a date after ISO 8601, as 2026-05-01 08:00:00")
    year, month, day, hour, minute = (int(match[part] or 0) for part in range(1, 6))
    second = float(match[6] or 0.0)
    try:
        days = date(year, month, day).toordinal()
    except ValueError:
        days = 0
    is_mixed = calendar.lower() in MIXED
    is_lost = is_mixed and (1582, 10, 4) < (year, month, day) < (1582, 10, 15)
    if not days or is_lost or hour > 23 or minute > 59 or second >= 61.0:
        raise ValueError(f"counts from {text!r}, allowed: a date that the calendar {calendar or 'standard'!r} has")
    if calendar.lower() == "julian" or (is_mixed and (year, month, day) < (1582, 10, 15)):
        century = (year - (month < 3)) // 100
        days += (
            century - century // 4 - 2
        )  # its leap days more than the Gregorian rule's since 0001-01-01, which it has 2 days earlier
    zone = 3600.0 * int(match[9] or 0) + 60.0 * int(match[10] or 0)
    return 86400.0 * days + 3600.0 * hour + 60.0 * minute + second - (-zone if match[8] == "-" else zone)


Double = NDArray[np.float64]
Kind = Literal["wind", "current"]

STANDARD_NAMES = {
    "wind": {
        "eastward_wind": "eastward_velocity", "northward_wind": "northward_velocity", "wind_speed": "speed",
        "wind_from_direction": "from_direction", "wind_to_direction": "to_direction",
    },
    "current": {
        "eastward_sea_water_velocity": "eastward_velocity", "northward_sea_water_velocity": "northward_velocity",
        "surface_eastward_sea_water_velocity": "eastward_velocity", "surface_northward_sea_water_velocity": "northward_velocity",
        "sea_water_speed": "speed", "direction_of_sea_water_velocity": "to_direction", "sea_water_velocity_to_direction": "to_direction",
        "sea_water_velocity_from_direction": "from_direction",
    },
}  # fmt: skip
# what scipy raises for bytes that it cannot take apart; it has no error of its own
OF_DAMAGE = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, EOFError, MemoryError)
_HEADING = re.compile(r"\s*([^\[\]]*?)\s*(?:\[([^\[\]]*)\])?\s*")


def read_flow(path: Path, kind: Kind, *, start: datetime | None, bearing: float) -> FlowTable:
    """Read a table of a wind or a current at the surface; times [s] count from the run's start.

    start: date of the run's start, None if not known; bearing [rad] of the x axis, clockwise from north.
    Raises FlowFileError with everything that is wrong with the file.
    """
    reader = {".csv": _read_csv, ".nc": _read_netcdf}.get(path.suffix.lower())
    if reader is None:
        raise FlowFileError([f"is {path.name!r}, allowed: a file of the kind .csv, .nc"])
    try:
        columns = reader(path, kind, start)
    except (OSError, UnicodeDecodeError, csv.Error) as cause:
        raise FlowFileError([f"cannot be read: {reason_of(cause)}"]) from cause
    texts: list[str] = []
    time, text = in_si("time", columns["time"]) if "time" in columns else (None, "has no column time")
    texts += [text] if text else []
    try:
        velocity = velocity_of(columns, bearing)
    except FlowFileError as error:
        raise FlowFileError([*texts, *error.texts]) from error
    if time is None:
        raise FlowFileError(texts)
    try:
        return FlowTable(time, velocity)
    except ValueError as error:
        raise FlowFileError([str(error)]) from error


def _read_csv(path: Path, kind: Kind, start: datetime | None) -> dict[str, Column]:
    """Read the columns of a CSV; FlowFileError with every unknown column and every entry that is no number."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        lines = [
            (number, row) for number, row in enumerate(csv.reader(file), 1) if any(row) and not row[0].startswith("#")
        ]
    if len(lines) < 3:
        raise FlowFileError([f"has {max(len(lines) - 1, 0)} rows, allowed: a header and 2 rows or more"])
    (_, header), rows = lines[0], lines[1:]
    texts = [
        f"has {len(row)} entries in line {number}, allowed: {len(header)}, as in the header"
        for number, row in rows
        if len(row) != len(header)
    ]
    if texts:
        raise FlowFileError(texts[:5])
    columns: dict[str, Column] = {}
    places = [number for number, _ in rows]
    for place, heading in enumerate(header):
        match = _HEADING.fullmatch(heading)
        name, unit = (match[1], match[2] or "") if match else (heading, "")
        if name not in UNITS or name in columns:
            problem = "twice" if name in columns else "no known column"
            texts.append(f"has {name!r} in its header, which is {problem}, allowed: each once of {', '.join(UNITS)}")
            continue
        entries = [(number, row[place].strip()) for number, row in rows]
        if name == "time" and unit == "UTC":
            columns[name] = Column("column 'time'", "s", _dates(entries, start, texts), places)
        else:
            columns[name] = Column(f"column {name!r}", unit, _numbers(name, entries, texts), places)
    if texts:
        raise FlowFileError(texts)
    return columns


def _numbers(name: str, entries: list[tuple[int, str]], texts: list[str]) -> Double:
    """Return the numbers (N,) of a column in its unit, and add a text about the first entry that is none."""
    values = np.full(len(entries), math.nan)
    wrong = []
    for row, (number, entry) in enumerate(entries):
        try:
            values[row] = float(entry)
        except ValueError:
            wrong.append((number, entry))
    wrong += [
        (number, entry) for (number, entry), value in zip(entries, values, strict=True) if not math.isfinite(value)
    ]
    texts += _told(name, list(dict.fromkeys(wrong)), "a finite number")
    return values


def _dates(entries: list[tuple[int, str]], start: datetime | None, texts: list[str]) -> Double:
    """Return the times (N,) [s] since the start of dates after ISO 8601, and add a text about the first entry that is none."""
    if start is None:
        texts.append("has dates, allowed: only with [site] start, the date of the run's start")
        return np.zeros(len(entries))
    values, wrong = np.zeros(len(entries)), []
    for row, (number, entry) in enumerate(entries):
        try:
            values[row] = (in_utc(datetime.fromisoformat(entry)) - start).total_seconds()
        except ValueError:
            wrong.append((number, entry))
    texts += _told("time", wrong, "a date after ISO 8601, as 2026-05-01T08:00:00Z")
    return values


def _told(name: str, wrong: list[tuple[int, str]], allowed: str) -> Iterable[str]:
    """Say where the first wrong entry of a column is, and how many there are."""
    if wrong:
        number, entry = wrong[0]
        more = f" and {len(wrong) - 1} more" if len(wrong) > 1 else ""
        yield f"column {name!r} has {entry!r} in line {number}{more}, allowed: {allowed}"


def in_utc(date: datetime) -> datetime:
    """Return a date with a time zone; without one it counts as UTC."""
    return date.replace(tzinfo=UTC) if date.tzinfo is None else date.astimezone(UTC)


def start_of(site: SiteSettings | None) -> datetime | None:
    """Return the date of the run's start in UTC; None without a site."""
    return None if site is None else in_utc(datetime.fromisoformat(site.start))


def _read_netcdf(path: Path, kind: Kind, start: datetime | None) -> dict[str, Column]:
    """Read the variables of a NetCDF file by their standard names; FlowFileError for what cannot be taken."""
    with path.open("rb") as file:
        head = file.read(8)
    if head.startswith(b"\x89HDF"):
        raise FlowFileError(
            [
                "is NetCDF-4 (HDF5), allowed: classic NetCDF; convert it with `nccopy -k classic IN OUT` of the package netcdf-bin, "
                "or with xarray and netCDF4: to_netcdf(OUT, format='NETCDF3_CLASSIC')"
            ]
        )
    if not head.startswith(b"CDF"):
        raise FlowFileError(["is no NetCDF file, allowed: classic NetCDF"])
    from scipy.io import netcdf_file  # for those who have such a file

    known = STANDARD_NAMES[kind] | {"time": "time"}
    try:
        with netcdf_file(path, "r", mmap=False, maskandscale=True) as file:
            columns, texts = _series_of(file, known, start)
    except OF_DAMAGE as error:
        raise FlowFileError(["is a damaged NetCDF file, allowed: a whole one"]) from error
    if texts:
        raise FlowFileError(texts)
    if len(columns) < 3:
        raise FlowFileError([f"has too few variables, allowed: standard names time and a pair of {', '.join(known)}"])
    if len({column.values.size for column in columns.values()}) > 1:
        raise FlowFileError(["has variables of several lengths, allowed: one series in time"])
    return columns


def _series_of(
    file: netcdf_file, known: Mapping[str, str], start: datetime | None
) -> tuple[dict[str, Column], list[str]]:
    """Return the variables with these standard names as columns, and texts about those that cannot be taken."""
    columns: dict[str, Column] = {}
    texts: list[str] = []
    for key, variable in file.variables.items():
        name = known.get(attribute(variable, "standard_name"))
        if name is None:
            continue
        values = present(variable)
        if values.size != max(values.shape, default=0) or name in columns:
            problem = "is a second one" if name in columns else f"has the shape {values.shape}"
            texts.append(
                f"variable {key!r} {problem}, allowed: one series in time of each standard name; currents on a grid, too"
            )
            continue
        column = Column(f"variable {key!r}", attribute(variable, "units"), values.ravel())
        columns[name] = since(column, attribute(variable, "calendar"), start, texts) if name == "time" else column
    return columns, texts


def attribute(variable: Any, name: str) -> str:
    """Return an attribute of a NetCDF variable as text, empty without it."""
    value = getattr(variable, name, b"")
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def present(variable: Any) -> Double:
    """Return the values (N,) or of more dimensions of a NetCDF variable [in its unit], NaN for fill values and beyond its valid range."""
    values = np.ma.filled(np.ma.asarray(variable[:]).astype(np.float64), math.nan)
    low, high = np.ravel(getattr(variable, "valid_range", (-math.inf, math.inf)))
    low, high = getattr(variable, "valid_min", low), getattr(variable, "valid_max", high)
    scale, offset = getattr(variable, "scale_factor", 1.0), getattr(variable, "add_offset", 0.0)
    packed = (values - offset) / scale  # the range is one of packed values
    slack = 1e-6 * np.maximum(np.abs(packed), 1.0)
    return np.where((packed >= low - slack) & (packed <= high + slack), values, math.nan)


def since(column: Column, calendar: str, start: datetime | None, texts: list[str]) -> Column:
    """Return the time since the run's start [s] of a variable in a unit as ``hours since 2026-05-01 00:00``, values (N,)."""
    match = SINCE.fullmatch(column.unit)
    if match is None:
        texts.append(f"{column.place} has the unit {column.unit!r}, allowed: as 'hours since 2026-05-01 00:00:00'")
        return column
    values, text = in_si("time", Column(column.place, SPELLINGS.get(match[1], match[1]), column.values))
    texts += [text] if text else []
    if start is None:
        texts.append(f"{column.place} has dates, allowed: only with [site] start, the date of the run's start")
    try:
        origin = seconds_of(match[2], calendar)
    except ValueError as error:
        texts.append(f"{column.place} {error}")
        return column
    if values is None or start is None:
        return column
    return Column(column.place, "s", values + (origin - seconds_of(start.isoformat(), "proleptic_gregorian")))

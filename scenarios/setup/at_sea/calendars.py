"""Dates in the calendars of CF 1.8 (section 4.4.1), as seconds since a day that all of them share.

`standard`, the default, and `gregorian` are the mixed calendar: Julian until 4 October 1582, Gregorian from the day after it, 15 October.
`proleptic_gregorian` has the Gregorian rule, and `julian` the Julian one, at all times. The other calendars have no days of the real
world (years of 360 or 365 days), or no dates at all (`none`), so a run, which begins on a real date, has no place in them.
"""

from __future__ import annotations

import re
from datetime import date

MIXED = ("standard", "gregorian", "")
CALENDARS = ("standard", "gregorian", "proleptic_gregorian", "julian")
SINCE = re.compile(r"\s*(\w+)\s+since\s+(.+?)\s*")
_DATE = re.compile(
    r"(-?\d{1,4})-(\d{1,2})-(\d{1,2})"
    r"(?:(?:\s*T\s*|\s+)(\d{1,2})(?::(\d{1,2})(?::(\d{1,2}(?:\.\d*)?))?)?)?"
    r"\s*(?:(Z|UTC|GMT)|([+-]?)(\d{1,2})(?::?(\d{2}))?)?",
    re.IGNORECASE,
)
_MONTHS = (31, 29, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31)


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
    days = _day_number(year, month, day, calendar.lower())
    if days is None or hour > 23 or minute > 59 or second >= 61.0:
        raise ValueError(f"counts from {text!r}, allowed: a date that the calendar {calendar or 'standard'!r} has")
    zone = 3600.0 * int(match[9] or 0) + 60.0 * int(match[10] or 0)
    return 86400.0 * days + 3600.0 * hour + 60.0 * minute + second - (-zone if match[8] == "-" else zone)


def _day_number(year: int, month: int, day: int, calendar: str) -> int | None:
    """Return the ordinal of a day (`datetime.date.toordinal`); None for one that the calendar does not have."""
    if year < 1 or not 1 <= month <= 12 or not 1 <= day <= _MONTHS[month - 1]:
        return None
    is_mixed = calendar in MIXED
    if is_mixed and (1582, 10, 4) < (year, month, day) < (1582, 10, 15):
        return None
    if calendar == "julian" or (is_mixed and (year, month, day) < (1582, 10, 15)):
        return _julian(year, month, day)
    try:
        return date(year, month, day).toordinal()
    except ValueError:
        return None


def _julian(year: int, month: int, day: int) -> int | None:
    """Return the ordinal of a day of the Julian calendar, 2 days earlier on 0001-01-01; None for 29 February of a common year."""
    if (month, day) == (2, 29) and year % 4:
        return None
    before = sum(_MONTHS[: month - 1]) - (1 if month > 2 and year % 4 else 0)
    return 365 * (year - 1) + (year - 1) // 4 + before + day - 2

"""What a recording says of a response exercise beside the motions: its booms, the water they lie in, and where on Earth it is."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from datetime import datetime

import cattrs

Point3 = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class BoomDescription:
    """A boom: what its recorded segments mean.

    segments         names of the bodies, from the first end to the second
    ends             what holds it: names of vessels, or of fixed points
    length           [m] along the skirt
    skirt_depth      [m] below, and freeboard [m] above the design waterline
    waterline        [m] height of that line over a segment's centre of mass
    joint_points     both ends of a segment in its own frame [m]
    full_tension     [N] at which the scale of the boom's colours ends: the bollard pull of the vessels that tow it, or what
                     fixed ends carry by formula at 0.7 knots
    """

    name: str
    segments: tuple[str, ...]
    ends: tuple[str, str]
    length: float
    skirt_depth: float
    freeboard: float
    waterline: float
    joint_points: tuple[Point3, Point3]
    full_tension: float


FIRST_YEAR, LAST_YEAR = 1583, 9000  # of the Gregorian calendar, and far from the end of Python's


@dataclass(frozen=True, kw_only=True)
class Site:
    """Where the world's origin lies and when time began, so that far-field models can go on from here.

    latitude, longitude  [degrees] of the origin, WGS 84
    bearing              [degrees] of the x axis, clockwise from north: 90 is east
    start                time of the first frame, ISO 8601; UTC unless it says otherwise
    """

    latitude: float
    longitude: float
    bearing: float = 90.0
    start: str = "2000-01-01T00:00:00+00:00"

    def __post_init__(self) -> None:
        for name, low, high in (("latitude", -89.0, 89.0), ("longitude", -180.0, 360.0), ("bearing", -360.0, 360.0)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"site {name} is {value:g}, allowed: {low:g} to {high:g} degrees")
        try:
            year = datetime.fromisoformat(self.start).year
        except ValueError:
            raise ValueError(f"site start is {self.start!r}, allowed: ISO 8601 such as 2026-05-01T08:00:00Z") from None
        if not FIRST_YEAR <= year <= LAST_YEAR:
            raise ValueError(f"site start is {self.start!r}, allowed: years {FIRST_YEAR} to {LAST_YEAR}")


@dataclass(frozen=True, kw_only=True)
class ExerciseDescription:
    """Booms, the uniform current (x, y) [m/s] and the level of the still water [m]."""

    booms: tuple[BoomDescription, ...] = ()
    current: tuple[float, float] = (0.0, 0.0)
    water_level: float = 0.0


def to_json(description: Site | ExerciseDescription | None) -> str:
    """A description as text, for a recording's properties; empty for none."""
    return "" if description is None else json.dumps(asdict(description))


def exercise_from_json(text: str) -> ExerciseDescription | None:
    """The inverse of `to_json`."""
    return cattrs.structure(json.loads(text), ExerciseDescription) if text else None


def site_from_json(text: str) -> Site | None:
    """The inverse of `to_json`."""
    return cattrs.structure(json.loads(text), Site) if text else None

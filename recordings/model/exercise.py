"""Descriptions of a response exercise: its booms, skimmers, mooring legs and ties, the water around them, and the place on Earth."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any, Literal

import cattrs
import numpy as np
import numpy.typing as npt

Point3 = tuple[float, float, float]
_CORNERS = 24  # of the ring that stands for a skimmer's mouth


@dataclass(frozen=True, kw_only=True)
class Equipment:
    """A skimmer with one end, its mouth, or a line with two, a mooring leg's anchor last.

    ends    the body of each end, empty for the world, and the point [m] along its axes from its centre of mass
    places  names of the series of the place [m] of the last end, where it may be moved: a mouth, or an anchor that drags
    width   [m] of a skimmer's mouth
    series  name of the series of a line's tension [N], which is 0 where it has parted or hangs loose; empty for a skimmer
    """

    name: str
    kind: Literal["skimmer", "mooring", "tie"]
    ends: tuple[tuple[str, Point3], ...]
    places: tuple[str, ...] = ()
    width: float = 0.0
    series: str = ""

    def strip(
        self, motions: Mapping[str, npt.NDArray[np.float64]], scalars: Mapping[str, float], level: float
    ) -> npt.NDArray[np.float64] | None:
        """Return a line (N, 3) [m] that shows it, not below `level` [m], where water would hide it; None without one of its bodies.

        motions: of bodies by name, (7,) or more, position [m] and quaternion xyzw first; scalars: values of series by name.
        """
        if any(body and body not in motions for body, _ in self.ends):
            return None
        places = np.array([_placed(np.array(point), motions.get(body)) for body, point in self.ends])
        moved = [scalars.get(name) for name in self.places]
        places[-1, : len(moved)] = [old if new is None else new for old, new in zip(places[-1], moved, strict=False)]
        places[:, 2] = np.maximum(places[:, 2], level)
        if self.kind != "skimmer":
            return places
        turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
        return np.asarray(places + 0.5 * self.width * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn]))


def _placed(point: npt.NDArray[np.float64], motion: npt.NDArray[np.float64] | None) -> npt.NDArray[np.float64]:
    """Return where a point (3,) [m] of a body is in the world: x + p + 2 u x (u x p + w p) for a quaternion (u, w)."""
    if motion is None:
        return point
    axis, real = motion[3:6], motion[6]
    return np.asarray(motion[:3] + point + 2.0 * np.cross(axis, np.cross(axis, point) + real * point))


LAND = "land/"  # the names of the bodies of [land] begin so
GROUND = "shore"  # name of the body that is the ground of a shore


def is_ground(name: str) -> bool:
    """Tell whether a body is land or the ground of a shore, which pictures do not frame."""
    return name == GROUND or name.startswith(LAND)


@dataclass(frozen=True, kw_only=True)
class BoomDescription:
    """A boom, and what its recorded segments mean.

    segments         names of the bodies, from the first end to the second
    ends             names of the vessels or fixed points that hold the ends
    length           [m] along the skirt
    skirt_depth      [m] below the design waterline; freeboard [m] above it
    waterline        [m] height of the design waterline above a segment's centre of mass
    joint_points     both ends of a segment in its own frame [m]
    full_tension     [N] at which the colour scale of the boom ends: the bollard pull of the vessels that tow it, or the tension of a
                     boom between fixed ends by formula at 0.7 knots
    deployment       kind of exercise: "sweep", "funnel", "containment", "exclusion", "diversion" or "trial"
    blockage         part [-] of the water's section that the boom, and what tows it, fill across their way; 0 if it was not recorded
    fed_by           names of the funnels whose oil it is to meet
    skimmers         names of the skimmers that may take its oil, those on other booms not; None if it was not recorded
    waiting_ties     names of the ties that a crew is to make fast at it while the run goes on
    flow_shares      [-] share of the water's speed that meets each segment, below 1 in a pocket; empty: 1 at all
    hold_time        [s] for which a speed of the water against a segment must last to count as held
    has_closures     True if closures say what it loses beyond what particles resolve; None if it was not recorded
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
    deployment: str = "sweep"
    blockage: float = 0.0
    fed_by: tuple[str, ...] = ()
    skimmers: tuple[str, ...] | None = None
    waiting_ties: tuple[str, ...] = ()
    flow_shares: tuple[float, ...] = ()
    hold_time: float = 0.0
    has_closures: bool | None = None

    @property
    def apex(self) -> str:
        """Name of the segment in the middle."""
        return self.segments[len(self.segments) // 2]


@dataclass(frozen=True, kw_only=True)
class WindowDescription:
    """A box of particles that moves through a sea by formulas. The series `middle_series` tell where its middle is.

    name     its name in the scenario
    target   what its middle follows, in words
    size     [m] along x and y
    depth    [m] of its water
    spacing  [m] of its particles
    """

    name: str
    target: str
    size: tuple[float, float]
    depth: float
    spacing: float

    @property
    def middle_series(self) -> tuple[str, str]:
        """Names of the series of the place (x, y) [m] of its middle."""
        return f"windows/{self.name}/x", f"windows/{self.name}/y"


FIRST_YEAR, LAST_YEAR = 1583, 9000  # of the Gregorian calendar, and far from the end of Python's


@dataclass(frozen=True, kw_only=True)
class ChartImage:
    """The image of a chart, and where it lies.

    image   data URL of a PNG or JPEG
    origin  (x, y) [m] of its upper left corner
    along   (x, y) [m] from one pixel to the next on its right; the next one below is as far, a quarter turn clockwise
    """

    image: str
    origin: tuple[float, float]
    along: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Site:
    """The place of the world's origin on Earth and the date of the start, for far-field models.

    latitude, longitude  [degrees] of the origin, WGS 84
    bearing              [degrees] of the x axis, clockwise from north: 90 is east
    start                time of the first frame, ISO 8601; UTC unless it gives another zone
    chart                to be shown under plans and maps; None without one

    Raises ValueError for angles out of their range and for a start that is not ISO 8601.
    """

    latitude: float
    longitude: float
    bearing: float = 90.0
    start: str = "2000-01-01T00:00:00+00:00"
    chart: ChartImage | None = None

    def __post_init__(self) -> None:
        for name, low, high in (("latitude", -89.0, 89.0), ("longitude", -180.0, 360.0), ("bearing", -360.0, 360.0)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise ValueError(f"site {name} is {value:g}, allowed: {low:g} to {high:g} degrees")
        try:
            year = datetime.fromisoformat(self.start).year
        except ValueError:
            raise ValueError(
                f"site start is {self.start!r}, allowed: ISO 8601, for example 2026-05-01T08:00:00Z"
            ) from None
        if not FIRST_YEAR <= year <= LAST_YEAR:
            raise ValueError(f"site start is {self.start!r}, allowed: years {FIRST_YEAR} to {LAST_YEAR}")

    def date_at(self, time: float) -> datetime:
        """Return the date and time (UTC) of a simulated time [s]."""
        start = datetime.fromisoformat(self.start)
        start = start.replace(tzinfo=UTC) if start.tzinfo is None else start.astimezone(UTC)
        return start + timedelta(seconds=time)


@dataclass(frozen=True, kw_only=True)
class ExerciseDescription:
    """Booms, the uniform current (x, y) [m/s] and the level [m] of the still water.

    period    [m] after which the sea repeats along x and y; 0: it does not
    wind      (x, y) [m/s] at the start, towards which it blows; 0 without one
    criteria  what the scenario changes of the criteria of the grade, or adds to them: settings by name, for each criterion's key
    equipment skimmers, mooring legs and ties
    prices    of the operation, with their currency, by key; empty without
    areas     outlines (x, y) [m] of sensitive areas, by name
    """

    booms: tuple[BoomDescription, ...] = ()
    current: tuple[float, float] = (0.0, 0.0)
    water_level: float = 0.0
    period: tuple[float, float] = (0.0, 0.0)
    wind: tuple[float, float] = (0.0, 0.0)
    criteria: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    equipment: tuple[Equipment, ...] = ()
    prices: Mapping[str, Any] = field(default_factory=dict)
    areas: Mapping[str, tuple[tuple[tuple[float, float], ...], ...]] = field(default_factory=dict)

    def is_seen(self, one: Equipment, time: float, scalars: Mapping[str, float]) -> bool:
        """Tell whether a skimmer or a line is there to see at `time` [s]: no line that has parted, hangs loose, or waits for its crew.

        At the start no line pulls yet, and those that do not wait are there all the same.
        """
        waits = any(one.name in boom.waiting_ties for boom in self.booms)
        return scalars.get(one.series) != 0.0 or (time == 0.0 and not waits)


def to_json(description: Site | ExerciseDescription | None) -> str:
    """Write a description as text for a recording's properties; empty for None."""
    return "" if description is None else json.dumps(asdict(description))


def exercise_from_json(text: str) -> ExerciseDescription | None:
    """Read the description that `to_json` wrote; None for an empty text."""
    return cattrs.structure(json.loads(text), ExerciseDescription) if text else None


def windows_to_json(windows: tuple[WindowDescription, ...]) -> str:
    """Write the descriptions of windows as text for a recording's properties; empty without any."""
    return json.dumps([asdict(one) for one in windows]) if windows else ""


def windows_from_json(text: str) -> tuple[WindowDescription, ...]:
    """Read the descriptions that `windows_to_json` wrote; none for an empty text."""
    return cattrs.structure(json.loads(text), tuple[WindowDescription, ...]) if text else ()


def site_from_json(text: str) -> Site | None:
    """Read the site that `to_json` wrote; None for an empty text."""
    return cattrs.structure(json.loads(text), Site) if text else None

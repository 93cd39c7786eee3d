"""The fields of POLREP and ICS 209 that a recording can fill, its oil balance, and the cost of the operation.

POLREP: POLWARN 1-5, POLINF 40-60, POLFAC 80-99, as IMO-560 (1995) numbers them, and REMPEC and the Bonn Agreement after it; read in the
Indian Coast Guard's contingency plan for the eastern region, annex 1A, whose spare numbers are left out. ICS 209: FEMA 502-2, version 3
(September 2010); read in FEMA's form, whose fields carry number and title, and in its instructions by block.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
import numpy.typing as npt

from oilsim.core.physical_constants import KNOT
from recordings.model.entity_paths import VESSELS, body_group
from recordings.model.exercise import Site
from recordings.model.tangent_plane import longitude_latitude
from recordings.model.words import cause_in_words, course_in_words, three_figures, volume_in_words
from recordings.replay.recording import Replay
from scenarios.debrief.key_moments import KeyMoment, bearing_of, is_technical

HOUR, DAY = 3600.0, 86400.0  # [s]
Fields = list[tuple[str, str, str]]  # number, title, what is known; empty: left blank
_ROWS = {
    "contained": "held by booms",
    "afloat": "afloat, neither held nor lost",
    "recovered": "recovered by skimmers",
    "stranded": "stranded",
    "evaporated": "evaporated",
    "left_the_domain": "left the simulated water",
}
_SERIES = "oil/lost/"
ICS_209_BLOCKS = (
    "Incident name", "Incident number", "Report version", "Incident commander(s) and agency or organization",
    "Incident management organization", "Incident start date/time", "Current incident size or area involved",
    "Percent contained or completed", "Incident definition", "Incident complexity level", "For time period", "Prepared by",
    "Date/time submitted", "Approved by", "Primary location, organization, or agency sent to", "State", "County/parish/borough",
    "City", "Unit or other", "Incident jurisdiction", "Incident location ownership", "Longitude and latitude",
    "US National Grid reference", "Legal description", "Short location or area description", "UTM coordinates",
    "Electronic geospatial data included or attached", "Significant events for the time period reported",
    "Primary materials or hazards involved", "Damage assessment information", "Public status summary", "Responder status summary",
    "Life, safety, and health status/threat remarks", "Life, safety, and health threat management", "Weather concerns",
    "Projected incident activity, potential, movement, escalation, or spread", "Strategic objectives",
    "Current incident threat summary and risk information", "Critical resource needs", "Strategic discussion",
    "Planned actions for next operational period", "Projected final incident size/area",
    "Anticipated incident management completion date", "Projected significant resource demobilization start date",
    "Estimated incident costs to date", "Projected final incident cost estimate", "Remarks", "Agency or organization", "Resources",
    "Additional personnel not assigned to a resource", "Total personnel", "Total resources",
    "Additional cooperating and assisting organizations not listed above",
)  # titles of blocks 1 to 53, in order  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class CostLine:
    """One line of the cost: an amount in a unit, its price, and in `cost` their product."""

    what: str
    amount: float
    unit: str
    price: float

    @property
    def cost(self) -> float:
        """Cost of the line, in the currency of the scenario."""
        return self.amount * self.price


def oil_balance(replay: Replay) -> list[tuple[str, float]]:
    """List the rows of the oil ledger at the end [m3], in words; their sum is all that was spilled. Empty without oil."""
    rows = [(words, _at_end(replay, f"oil/{row}")) for row, words in _ROWS.items()]
    lost = [n.removeprefix(_SERIES) for n in replay.scalars if n.startswith(_SERIES)]
    rows += [(f"lost {cause_in_words(cause)}", _at_end(replay, f"{_SERIES}{cause}")) for cause in lost]
    return [(words, volume) for words, volume in rows if volume] if "oil/spilled" in replay.scalars else []


def operation_cost(replay: Replay, duration: float) -> tuple[list[CostLine], list[str]]:
    """Return the lines of the cost of `duration` [s], and what has no price; neither without prices in the scenario."""
    exercise = replay.run.exercise
    if exercise is None or not exercise.prices:
        return [], []
    vessels = sum(body_group(name) == VESSELS for name in replay.run.meshes)
    skimmers = [one.name for one in exercise.equipment if one.kind == "skimmer"]
    taken = sum(_at_end(replay, f"skimmers/{name}/{part}") for name in skimmers for part in ("aboard", "offloaded"))
    metres = math.fsum(boom.length for boom in exercise.booms)
    lost = math.fsum(_at_end(replay, name) for name in replay.scalars if name.startswith(_SERIES))
    counted = (
        ("vessel_hour", f"Vessels: {vessels}", vessels * duration / HOUR, "vessel hours"),
        ("skimmer_hour", f"Skimmers: {len(skimmers)}", len(skimmers) * duration / HOUR, "skimmer hours"),
        ("boom_metre_day", f"Boom: {metres:g} m", metres * duration / DAY, "metre days"),
        ("recovered_m3", "Recovered oil and water, taken ashore", taken, "m³"),
        ("lost_m3", "Oil lost by booms", lost, "m³"),
        ("stranded_m3", "Oil stranded", _at_end(replay, "oil/stranded"), "m³"),
    )
    prices = exercise.prices
    lines = [
        CostLine(what=what, amount=amount, unit=unit, price=float(prices[key]))
        for key, what, amount, unit in counted
        if prices.get(key) is not None
    ]
    return lines, [what for key, what, amount, _ in counted if amount and prices.get(key) is None]


def report_parts(replay: Replay, moments: Sequence[KeyMoment]) -> dict[str, object]:
    """Return what the template of the reports shows, beside what it has in common with the debrief."""
    lines, unpriced = operation_cost(replay, moments[-1].time - moments[0].time)
    currency = str(replay.run.exercise.prices["currency"]) if replay.run.exercise and lines else ""
    cost = f"{math.fsum(line.cost for line in lines):,.2f} {currency}" if lines else ""
    return {
        "polrep": polrep(replay, moments, cost),
        "ics_209": ics_209(replay, moments, cost),
        "balance": oil_balance(replay),
        "spilled": _at_end(replay, "oil/spilled"),
        "cost": lines,
        "unpriced": unpriced,
        "currency": currency,
    }


def polrep(replay: Replay, moments: Sequence[KeyMoment], cost: str) -> Fields:
    """Fill the fields of a POLREP at the last of the key moments; `cost` in words, empty if unknown."""
    start, end = _date(replay, moments[0].time), _date(replay, moments[-1].time)
    at_first, at_last = (_place(replay, moment) for moment in (moments[0], moments[-1]))
    current, wind = _weather(replay)
    extent = "; ".join(filter(None, (at_last, _extent(replay, moments[-1]))))
    title = str(replay.run.properties.get("title") or replay.run.name)
    return [
        ("1", "Date and time", start), ("2", "Position", at_first), ("3", "Incident", title),
        ("4", "Outflow", _spilled(replay)), ("5", "Acknowledge", ""),
        ("40", "Date and time", end), ("41", "Position and extent of pollution", extent),
        ("42", "Characteristics of pollution", _characteristics(replay)), ("43", "Source and cause of pollution", ""),
        ("44", "Wind direction and speed", wind), ("45", "Current direction and speed, tide", current),
        ("46", "Sea state and visibility", ""), ("47", "Drift of pollution", ""), ("48", "Forecast of likely effect", ""),
        ("49", "Identity of observer, ships on scene", _ships(replay)), ("50", "Action taken", _action(replay)),
        ("51", "Photographs or samples", f"{len(moments)} pictures, below (drawn by the simulator)"),
        ("52", "Names of other states and organisations informed", ""), ("60", "Acknowledge", ""),
        ("80", "Date and time", ""), ("81", "Request for assistance", ""), ("82", "Cost", cost),
        ("83", "Pre-arrangements for the delivery of assistance", ""), ("84", "Where and how assistance is to be rendered", ""),
        ("85", "Other states and organisations requested", ""), ("86", "Change of command", ""),
        ("87", "Exchange of information", ""), ("99", "Acknowledge", ""),
    ]  # fmt: skip


def ics_209(replay: Replay, moments: Sequence[KeyMoment], cost: str) -> Fields:
    """Fill the blocks of an ICS 209 for the time between the first and the last key moment; `cost` in words, empty if unknown."""
    current, wind = _weather(replay)
    start, end = _date(replay, moments[0].time), _date(replay, moments[-1].time)
    weather = "; ".join(f"{name} {said}" for name, said in (("wind", wind), ("current", current)) if said)
    period = f"{start} to {end}" if start else f"exercise time {moments[0].time:.0f} s to {moments[-1].time:.0f} s"
    told = [
        f"{event.time:.0f} s {event.source}: {event.text}"
        for event in replay.events
        if event.urgency and not is_technical(event)
    ]
    known = {
        1: str(replay.run.properties.get("title") or replay.run.name),
        6: start,
        7: _extent(replay, moments[-1]),
        8: _contained(replay),
        9: "oil spill (exercise)",
        11: period,
        22: _place(replay, moments[0]),
        28: "; ".join(told),
        29: _characteristics(replay),
        35: weather,
        45: cost,
        47: "Oil balance, map and time line follow.",
        49: _ships(replay),
    }
    return [(str(number), title, known.get(number, "")) for number, title in enumerate(ICS_209_BLOCKS, start=1)]


def _at_end(replay: Replay, name: str) -> float:
    """Return the last value of a series; 0 without one."""
    series = replay.scalars.get(name)
    return float(series.value[-1]) if series is not None and len(series.value) else 0.0


def _date(replay: Replay, time: float) -> str:
    """Return the date and time (UTC) of a simulated time [s]; empty unless the scenario tells place and date."""
    site = replay.run.site
    if site is None or datetime.fromisoformat(site.start) == datetime.fromisoformat(Site.start):  # nobody gave a date
        return ""
    return f"{site.date_at(time):%Y-%m-%d %H:%M:%S} UTC"


def _oil(replay: Replay, key: KeyMoment) -> npt.NDArray[np.float64]:
    """Return the places (N, 3) [m] of all oil on the water at a moment."""
    parts = [points for name, points in key.moment.positions.items() if name in replay.run.oils]
    return np.concatenate([np.empty((0, 3)), *parts, *key.moment.lost.values()])


def _place(replay: Replay, key: KeyMoment) -> str:
    """Return latitude and longitude of the middle of the oil; empty without oil or a site."""
    oil, site = _oil(replay, key), replay.run.site
    if site is None or not len(oil):
        return ""
    longitude, latitude = (float(part[0]) for part in longitude_latitude(site, oil[:, :2].mean(axis=0)[None]))
    longitude = (longitude + 180.0) % 360.0 - 180.0
    return f"{abs(latitude):.4f}° {'N' if latitude >= 0.0 else 'S'}, {abs(longitude):.4f}° {'E' if longitude >= 0.0 else 'W'}"


def _extent(replay: Replay, key: KeyMoment) -> str:
    oil = _oil(replay, key)
    if not len(oil):
        return ""
    length, width = (three_figures(float(side)) for side in np.ptp(oil[:, :2], axis=0))
    return f"all oil lies within {length} m by {width} m"


def _spilled(replay: Replay) -> str:
    return volume_in_words(_at_end(replay, "oil/spilled")) if "oil/spilled" in replay.scalars else ""


def _contained(replay: Replay) -> str:
    """Return the part of all spilled oil that booms hold or skimmers have; empty without oil."""
    held, spilled = (
        _at_end(replay, "oil/contained") + _at_end(replay, "oil/recovered"),
        _at_end(replay, "oil/spilled"),
    )
    return f"{100.0 * held / spilled:.0f} % held by booms or recovered" if spilled > 0.0 else ""


def _characteristics(replay: Replay) -> str:
    return "; ".join(
        f"{phase.name}, {three_figures(phase.rest_density)} kg/m³, {three_figures(1000.0 * phase.dynamic_viscosity)} mPa s"
        for phase in replay.run.phases
        if phase.is_oil
    )


def _weather(replay: Replay) -> tuple[str, str]:
    """Return current and wind in words, with compass courses where the site is known; empty where there is none on record."""
    exercise = replay.run.exercise
    if exercise is None:
        return "", ""
    current, wind = (
        [_at_end(replay, f"{kind}/{axis}") for axis in "xy"] if f"{kind}/x" in replay.scalars else at_start
        for kind, at_start in (("current", exercise.current), ("wind", exercise.wind))
    )
    said = []
    for (x, y), turn, word in ((current, 0.0, "towards"), (wind, math.pi, "from")):
        course = course_in_words(math.atan2(y, x) + turn, bearing_of(replay))
        way = f" {word} {course}°" if replay.run.site is not None else ""
        said.append(f"{three_figures(math.hypot(x, y) / KNOT)} kn{way}" if x or y else "")
    return said[0], said[1]


def _ships(replay: Replay) -> str:
    return ", ".join(name.partition("/")[2] for name in replay.run.meshes if body_group(name) == VESSELS)


def _action(replay: Replay) -> str:
    """Say what was deployed, and what it holds and took."""
    exercise = replay.run.exercise
    if exercise is None:
        return ""
    booms = [f"boom {boom.name}, {boom.length:g} m ({boom.deployment})" for boom in exercise.booms]
    skimmers = [f"skimmer {one.name}" for one in exercise.equipment if one.kind == "skimmer"]
    return "; ".join([*booms, *skimmers, _contained(replay)]).removesuffix("; ")

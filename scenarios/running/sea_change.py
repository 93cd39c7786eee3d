"""A sea that goes gradually from what it is to what is ordered: wind, current, waves and visibility, within `sea.within` seconds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from scenarios.controls.table import with_entry
from scenarios.schema.parsing.relations import entries_at
from scenarios.spec.resolve import RunSpec

NUMBERS = (
    "sea.wind.speed", "sea.wind.direction", "sea.wind.gust_intensity", "sea.current.speed", "sea.current.direction",
    "sea.waves.height", "sea.waves.significant_height", "sea.waves.period", "sea.waves.peak_period", "sea.visibility",
)  # fmt: skip
_FROM_NOTHING = (
    "speed",
    "height",
    "significant_height",
    "gust_intensity",
)  # of wind, current or waves that were not there


@dataclass(frozen=True)
class SeaChange:
    """Numbers of the sea on their way, by their paths: from `before` at `begin` [s] to `after` at `end` [s], linearly in time.

    Directions turn the short way round.
    """

    begin: float
    end: float
    before: Mapping[str, float]
    after: Mapping[str, float]

    def at(self, time: float) -> dict[str, float]:
        """Return the numbers at `time` [s]."""
        share = 1.0 if time >= self.end else max(0.0, (time - self.begin) / (self.end - self.begin))
        return {path: before + share * self._way(path) for path, before in self.before.items()}

    def _way(self, path: str) -> float:
        way = self.after[path] - self.before[path]
        return math.remainder(way, 2.0 * math.pi) if path.endswith(".direction") else way


def sea_change(present: RunSpec, ordered: RunSpec, time: float) -> SeaChange | None:
    """Return the change, from `time` [s] on, of the `present` sea to that of new orders; None if they act at once."""
    within, wanted, now = ordered.sea.within, dict(sea_numbers(ordered)), dict(sea_numbers(present))
    if within == 0.0:
        return None
    begin = {path: now[path] for path in wanted if path in now}
    begin |= {path: 0.0 for path in wanted if path not in now and path.rpartition(".")[2] in _FROM_NOTHING}
    moving = {path: value for path, value in begin.items() if value != wanted[path]}
    return SeaChange(time, time + within, moving, {path: wanted[path] for path in moving}) if moving else None


def with_numbers(scenario: RunSpec, numbers: Mapping[str, float]) -> RunSpec:
    """Return a scenario whose sea has these numbers, by their paths."""
    for path, value in numbers.items():
        scenario = with_entry(scenario, path.split("."), value)
    return scenario


def sea_numbers(scenario: RunSpec) -> Iterator[tuple[str, float]]:
    """Yield the numbers of a scenario's sea that may change gradually, by their paths."""
    for key in NUMBERS:
        for path, _, value in entries_at(key, scenario):
            if isinstance(value, float | int):
                yield path, float(value)

"""Compares a run with the same run under other orders: one table of differences and two curves, in plain data for the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from oilsim.core.physical_constants import KNOT
from recordings.model.words import three_figures
from recordings.replay.comparison import common_time, parting, scores
from recordings.replay.joined import JoinedReplay
from recordings.replay.recording import Replay
from scenarios.debrief.grade import exercise_grade, grades_of
from scenarios.debrief.key_moments import deck_text
from scenarios.schema.parsing.overrides import ORDERED

# series of a curve that tell most of an exercise, their titles, units, and factors from SI; the first two that differ are drawn
CURVES: Mapping[str, tuple[str, str, float]] = {
    "oil_lost": ("Oil lost", "litres", 1e3),
    "oil_contained": ("Oil held", "litres", 1e3),
    "oil/recovered": ("Oil recovered", "litres", 1e3),
    "normal_speed_held": ("Water against the boom", "kn", 1.0 / KNOT),
    "tow_speed": ("Speed through the water", "kn", 1.0 / KNOT),
    "gap_ratio": ("Gap ratio", "1", 1.0),
}
MOST_POINTS = 500  # [1] of a curve; more than a page has pixels


def what_if(first: Path, second: Path) -> dict[str, Any]:
    """Compare a run with the same run under other orders, over the time that both cover.

    Returns names, begin and end [s], the time [s] from which on they differ (None: the other orders change nothing), the orders that only
    the second has, grades by boom, rows of differences (label, unit, and the two values in words), and two curves.
    """
    runs = JoinedReplay(first), JoinedReplay(second)
    begin, end = common_time(*runs)
    apart = parting(*runs)
    return {
        "first": first.stem,
        "second": second.stem,
        "begin": begin,
        "end": end,
        "apart": apart,
        "orders": list(_orders_of_second(*runs)),
        "grades": list(_grades(*runs)),
        "rows": [
            [one.label, one.unit, three_figures(one.first), three_figures(one.second)]
            for one in scores(*runs)
            if three_figures(one.first) != three_figures(one.second)
        ],
        "curves": list(_curves(*runs, end)),
    }


def _orders_of_second(first: Replay, second: Replay) -> Iterator[str]:
    """Yield the orders that only the second run has, in words, with their times."""
    known = [(event.time, event.text) for event in first.events if event.is_by_people]
    for event in second.events:
        if event.is_by_people and event.text.startswith(ORDERED):
            if (event.time, event.text) in known:
                known.remove((event.time, event.text))
            else:
                yield f"{deck_text(second, event)}, at {event.time:.1f} s"


def _grades(*runs: Replay) -> Iterator[list[str]]:
    """Yield the letters of both runs: of each boom, and of several booms that of the exercise first."""
    both = [grades_of(run) for run in runs]
    overall = [exercise_grade(grades) for grades in both]
    if len(both[0]) > 1:
        yield ["exercise", *(one[1].letter if one else "none" for one in overall)]
    for boom in both[0]:
        yield [f"boom {boom}", *(grades[boom].letter or "none" for grades in both if boom in grades)]


def _curves(first: Replay, second: Replay, end: float) -> Iterator[dict[str, Any]]:
    """Yield the two curves of each of two diagrams, up to the time `end` [s]: of the series that differ, else of the first there are."""
    there = [name for name in first.scalars if _known(name) and name in second.scalars]
    ordered = sorted(there, key=lambda name: (_is_alike(first, second, name), list(CURVES).index(_known(name)), name))
    for name in ordered[:2]:
        title, unit, factor = CURVES[_known(name)]
        boom = name.removesuffix(_known(name)).strip("/")
        lines = [_line(run, name, factor, end) for run in (first, second)]
        yield {"title": f"{title}, boom {boom}" if boom else title, "unit": unit, "first": lines[0], "second": lines[1]}


def _known(name: str) -> str:
    """Return the series of `CURVES` that a series is, with or without a boom's name; empty if it is none."""
    return next((key for key in CURVES if name == key or (name.endswith(f"/{key}") and name.count("/") == 1)), "")


def _is_alike(first: Replay, second: Replay, name: str) -> bool:
    one, two = first.scalars[name], second.scalars[name]
    count = min(len(one.value), len(two.value))
    return bool(np.array_equal(one.value[:count], two.value[:count], equal_nan=True))


def _line(run: Replay, name: str, factor: float, end: float) -> list[list[float]]:
    series = run.scalars[name]
    kept = np.flatnonzero(series.time <= end + 1e-9)
    kept = kept[:: max(1, -(-len(kept) // MOST_POINTS))]
    kept = kept[np.isfinite(series.value[kept])]
    return [series.time[kept].round(2).tolist(), (factor * series.value[kept]).tolist()]

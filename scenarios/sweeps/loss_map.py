"""The loss map of a sweep: how much oil a boom loses over two of the varied entries."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from recordings.pictures.style import INK, STYLE
from scenarios.sweeps.results import Outcome
from scenarios.sweeps.words import entry_in_words

_COLORS = "YlOrBr"
_LOST, _GONE = "oil_m3.lost", "oil_m3.lost.left_the_tank"
_LEAST_RUNS = 4


def draw_loss_map(outcomes: Sequence[Outcome], picture: Path) -> bool:
    """Draw the oil lost, in percent of the oil released, over the first two varied entries to a PNG file; return whether there is one.

    There is a map where the first two entries are numbers that take two values or more each, in four runs or more, and a run has lost oil.
    A grid becomes tiles with their numbers, means over the other entries; samples become dots.
    """
    names = list(outcomes[0].variant.values)[:2]
    places = _numbers(outcomes, names)
    if len(names) < 2 or places is None or len(outcomes) < _LEAST_RUNS:
        return False
    lost = np.array([lost_share(outcome) for outcome in outcomes])
    if not np.nanmax(lost, initial=0.0) > 0.0 or min(len(np.unique(column)) for column in places.T) < 2:
        return False
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 5.4), dpi=110, layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        is_grid = len(np.unique(places, axis=0)) == math.prod(len(np.unique(column)) for column in places.T)
        (_draw_tiles if is_grid else _draw_dots)(axes, places, lost)
        scenario = outcomes[0].variant.plan.scenario
        axes.set_xlabel(entry_in_words(scenario, names[0]))
        axes.set_ylabel(entry_in_words(scenario, names[1]))
        axes.set_title("oil lost, % of the oil released", loc="left")
        figure.colorbar(axes.collections[0], ax=axes, label="%")
        figure.savefig(picture)
    return True


def lost_share(outcome: Outcome) -> float:
    """Compute the oil that booms lost in a run [% of the oil released]; NaN where none was released.

    Oil that has left the tank does not count: no boom lost it.
    """
    figures = outcome.figures()
    released = figures.get("oil_m3.released", 0.0)
    lost = sum(
        value for key, value in figures.items() if (key == _LOST or key.startswith(f"{_LOST}.")) and key != _GONE
    )
    return 100.0 * lost / released if released > 0.0 else math.nan


def _numbers(outcomes: Sequence[Outcome], names: Sequence[str]) -> NDArray[np.float64] | None:
    """Return the values (N, 2) of entries in all runs; None where one is no number."""
    try:
        return np.array([[float(outcome.variant.values[name]) for name in names] for outcome in outcomes])
    except ValueError:
        return None


def _draw_tiles(axes: Axes, places: NDArray[np.float64], lost: NDArray[np.float64]) -> None:
    """Draw a tile for each pair of values, at even distances, with its number."""
    columns, rows = (np.unique(places[:, axis]) for axis in (0, 1))
    total, count = np.zeros((2, len(rows), len(columns)))
    for (x, y), value in zip(places, lost, strict=True):
        if np.isfinite(value):
            at = np.searchsorted(rows, y), np.searchsorted(columns, x)
            total[at] += value
            count[at] += 1.0
    tiles = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0.0)
    axes.pcolormesh(tiles, cmap=_COLORS, vmin=0.0, edgecolors="white", linewidth=1.5)
    half = 0.5 * np.nanmax(tiles)
    for (row, column), value in np.ndenumerate(tiles):
        text = f"{value:.3g}" if np.isfinite(value) else "-"
        axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", color="white" if value > half else INK)
    axes.set_xticks(np.arange(len(columns)) + 0.5, [f"{value:g}" for value in columns])
    axes.set_yticks(np.arange(len(rows)) + 0.5, [f"{value:g}" for value in rows])


def _draw_dots(axes: Axes, places: NDArray[np.float64], lost: NDArray[np.float64]) -> None:
    """Draw a dot for each run."""
    axes.scatter(places[:, 0], places[:, 1], c=lost, cmap=_COLORS, vmin=0.0, s=90.0, edgecolors="0.4", linewidths=0.7)

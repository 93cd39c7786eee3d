"""The picture of a sweep: each figure that differs between the runs, over the values of the first varied entry."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from recordings.pictures.style import STYLE
from scenarios.sweeps.results import Outcome, differing

_COLUMNS, _PANEL = 3, (4.6, 3.1)  # inches


def draw_sweep(outcomes: Sequence[Outcome], picture: Path) -> None:
    """Draw the figures that differ between the runs to a PNG file."""
    keys = differing([outcome.figures() for outcome in outcomes])
    rows, columns = math.ceil(len(keys) / _COLUMNS), min(len(keys), _COLUMNS)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_PANEL[0] * columns, _PANEL[1] * rows + 0.6), dpi=110, layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, key in zip(panels, keys, strict=False):
            _draw(axes, key, outcomes)
        for axes in panels[len(keys) :]:
            axes.set_axis_off()
        handles, names = panels[0].get_legend_handles_labels()
        if len(names) > 1:
            figure.legend(handles, names, loc="outside upper left", frameon=False, ncols=4)
        figure.savefig(picture)


def _draw(axes: Axes, key: str, outcomes: Sequence[Outcome]) -> None:
    """Draw one figure, with a line for each combination of the other varied entries."""
    varied = next(iter(outcomes[0].variant.values))
    lines: dict[str, list[tuple[str, float]]] = {}
    for outcome in outcomes:
        first, *others = outcome.variant.values.items()
        of_line = lines.setdefault(", ".join(f"{name} = {value}" for name, value in others), [])
        if key in outcome.figures():
            of_line.append((first[1], outcome.figures()[key]))
    is_measured = all(_is_number(outcome.variant.values[varied]) for outcome in outcomes)
    for name, points in lines.items():
        places = [float(value) if is_measured else value for value, _ in points]
        axes.plot(places, [figure for _, figure in points], marker="o", label=name)
    axes.set_title(key.removeprefix("scores."), loc="left", fontsize=9.5)
    axes.set_xlabel(varied)


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False

"""The picture of a sweep: each figure that differs between the runs, over the values of the first varied entry."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.stats import spearmanr

from recordings.pictures.style import STYLE
from scenarios.sweeps.results import Outcome, differing

_COLUMNS, _PANEL = 3, (4.6, 3.1)  # inches
_FEWEST = 4  # runs of a sampled sweep, from which a correlation says something


def draw_sweep(outcomes: Sequence[Outcome], picture: Path) -> None:
    """Draw the figures that differ between the runs to a PNG file."""
    keys = differing([outcome.figures() for outcome in outcomes])
    if _is_sampled(outcomes):
        _draw_tornado(outcomes, keys, picture)
        return
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


def _is_sampled(outcomes: Sequence[Outcome]) -> bool:
    """Tell whether the entries vary freely: more than two, or two in more combinations than a grid of their values has lines."""
    names = list(outcomes[0].variant.values)
    firsts = {outcome.variant.values[names[0]] for outcome in outcomes}
    numbers = all(_is_number(value) for outcome in outcomes for value in outcome.variant.values.values())
    return numbers and len(outcomes) >= _FEWEST and len(firsts) == len(outcomes) and len(names) > 1


def _draw_tornado(outcomes: Sequence[Outcome], keys: Sequence[str], picture: Path) -> None:
    """Draw for each figure how strongly each entry moves it: Spearman's rank correlation over the runs."""
    rows, columns = math.ceil(len(keys) / _COLUMNS), min(len(keys), _COLUMNS)
    names = list(outcomes[0].variant.values)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_PANEL[0] * columns, 0.75 * _PANEL[1] * rows + 0.6), dpi=110, layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
        for axes, key in zip(panels, keys, strict=False):
            known = [outcome for outcome in outcomes if key in outcome.figures()]
            strengths = [_rank_correlation(known, name, key) for name in names]
            axes.barh(range(len(names)), strengths, color=["C3" if one < 0.0 else "C0" for one in strengths])
            axes.axvline(0.0, color="0.3", linewidth=0.8)
            axes.set_yticks(range(len(names)), names)
            axes.set_xlim(-1.0, 1.0)
            axes.set_title(key.removeprefix("scores."), loc="left", fontsize=9.5)
        for axes in panels[len(keys) :]:
            axes.set_axis_off()
        figure.suptitle(f"Rank correlation over {len(outcomes)} runs", x=0.0, ha="left", fontsize=10)
        figure.savefig(picture)


def _rank_correlation(outcomes: Sequence[Outcome], name: str, key: str) -> float:
    """Compute Spearman's rank correlation [-] of a figure with an entry; 0 where one of them does not vary, or in fewer than three runs."""
    entry = [float(outcome.variant.values[name]) for outcome in outcomes]
    figure = [outcome.figures()[key] for outcome in outcomes]
    if len(outcomes) < 3 or len(set(entry)) < 2 or len(set(figure)) < 2:
        return 0.0
    return float(spearmanr(entry, figure).statistic)


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

"""The picture of a sweep: each figure that differs between the runs, over the values of the first varied entry."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.stats import spearmanr

from recordings.pictures.style import STYLE
from scenarios.sweeps.results import Outcome, differing
from scenarios.sweeps.words import entry_in_words, figure_in_words

_COLUMNS, _PANEL = 4, (4.0, 2.7)  # inches
_BY_CAUSE = "oil_m3.lost"  # beginning of the keys of losses, which runs without such a loss do not have
_FEWEST = 4  # runs of a sampled sweep, from which a correlation says something


def draw_sweep(outcomes: Sequence[Outcome], picture: Path) -> None:
    """Draw the figures that differ between the runs to a PNG file."""
    drawn = drawn_figures([outcome.figures() for outcome in outcomes])
    if _is_sampled(outcomes):
        _draw_tornado(outcomes, drawn, picture)
        return
    rows, columns = math.ceil(len(drawn) / _COLUMNS), min(len(drawn), _COLUMNS)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_PANEL[0] * columns, _PANEL[1] * rows + 0.6), dpi=110, layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, (key, values) in zip(panels, drawn.items(), strict=False):
            _draw(axes, key, values, outcomes)
        for axes in panels[len(drawn) :]:
            axes.set_axis_off()
        handles, names = panels[0].get_legend_handles_labels()
        if len(names) > 1:
            figure.legend(handles, names, loc="outside upper left", frameon=False, ncols=4)
        figure.savefig(picture)


def drawn_figures(figures: Sequence[Mapping[str, float]]) -> dict[str, list[float]]:
    """Return the figures of the runs that have a panel, by key: a value for each run, NaN where it was not measured.

    A cause by which a run has lost nothing counts as 0. Figures that are the same in all runs that have them are left out, and those that
    repeat another one, as the modelled part of a loss does where all of it is modelled.
    """
    drawn: dict[str, list[float]] = {}
    for key in differing(figures):
        missing = 0.0 if key.startswith(_BY_CAUSE) else math.nan
        values = [own.get(key, missing) for own in figures]
        if len({value for value in values if not math.isnan(value)}) > 1 and str(values) not in map(
            str, drawn.values()
        ):
            drawn[key] = values
    return drawn


def _is_sampled(outcomes: Sequence[Outcome]) -> bool:
    """Tell whether the entries vary freely: more than two, or two in more combinations than a grid of their values has lines."""
    names = list(outcomes[0].variant.values)
    firsts = {outcome.variant.values[names[0]] for outcome in outcomes}
    numbers = all(_is_number(value) for outcome in outcomes for value in outcome.variant.values.values())
    return numbers and len(outcomes) >= _FEWEST and len(firsts) == len(outcomes) and len(names) > 1


def _draw_tornado(outcomes: Sequence[Outcome], drawn: Mapping[str, Sequence[float]], picture: Path) -> None:
    """Draw for each figure how strongly each entry moves it: Spearman's rank correlation over the runs."""
    rows, columns = math.ceil(len(drawn) / _COLUMNS), min(len(drawn), _COLUMNS)
    names = list(outcomes[0].variant.values)
    labels = [entry_in_words(outcomes[0].variant.plan.scenario, name) for name in names]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(_PANEL[0] * columns, 0.75 * _PANEL[1] * rows + 0.6), dpi=110, layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
        for axes, (key, values) in zip(panels, drawn.items(), strict=False):
            strengths = [_rank_correlation(outcomes, name, values) for name in names]
            axes.barh(range(len(names)), strengths, color=["C3" if one < 0.0 else "C0" for one in strengths])
            axes.axvline(0.0, color="0.3", linewidth=0.8)
            axes.set_yticks(range(len(names)), labels)
            axes.set_xlim(-1.0, 1.0)
            axes.set_title(figure_in_words(key), loc="left", fontsize=9.5)
        for axes in panels[max(0, len(drawn) - columns) : len(drawn)]:
            axes.tick_params(labelbottom=True)  # the lowest of each column, which may have an empty place below
        for axes in panels[len(drawn) :]:
            axes.set_axis_off()
        panels[0].invert_yaxis()  # the first entry on top, in all of them
        figure.suptitle(f"Rank correlation over {len(outcomes)} runs", x=0.0, ha="left", fontsize=10)
        figure.savefig(picture)


def _rank_correlation(outcomes: Sequence[Outcome], name: str, values: Sequence[float]) -> float:
    """Compute Spearman's rank correlation [-] of a figure with an entry over the runs that have it.

    0 where one of them does not vary, or in fewer than three runs.
    """
    known = [(one, value) for one, value in zip(outcomes, values, strict=True) if not math.isnan(value)]
    entry = [float(one.variant.values[name]) for one, _ in known]
    figure = [value for _, value in known]
    if len(known) < 3 or len(set(entry)) < 2 or len(set(figure)) < 2:
        return 0.0
    return float(spearmanr(entry, figure).statistic)


def _draw(axes: Axes, key: str, values: Sequence[float], outcomes: Sequence[Outcome]) -> None:
    """Draw one figure, with a line for each combination of the other varied entries."""
    varied = next(iter(outcomes[0].variant.values))
    for name, points in lines_of(values, outcomes).items():
        axes.plot([place for place, _ in points], [figure for _, figure in points], marker="o", label=name)
    axes.set_title(figure_in_words(key), loc="left", fontsize=9.5)
    axes.set_xlabel(entry_in_words(outcomes[0].variant.plan.scenario, varied))


def lines_of(
    values: Sequence[float], outcomes: Sequence[Outcome]
) -> dict[str, list[tuple[float, float]] | list[tuple[str, float]]]:
    """Return the points of a figure's lines, by the other varied entries: the first entry and the figure, in their units.

    Numbers are in increasing order, as samples are not; words keep theirs. Values (N,) of the runs, NaN where there is none.
    """
    lines: dict[str, list[tuple[str, float]]] = {}
    for outcome, value in zip(outcomes, values, strict=True):
        (_, place), *others = outcome.variant.values.items()
        of_line = lines.setdefault(", ".join(f"{name} = {text}" for name, text in others), [])
        if not math.isnan(value):
            of_line.append((place, value))
    if not all(_is_number(next(iter(outcome.variant.values.values()))) for outcome in outcomes):
        return dict(lines)
    return {name: sorted((float(place), value) for place, value in points) for name, points in lines.items()}


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False

"""Charts of a sweep: its figures over what was varied, and the share of oil lost over two entries."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import spearmanr

from oilsim.core.quantity import quantities
from recordings.pictures.style import INK, STYLE
from scenarios.schema.parsing.structuring import COMPASS
from scenarios.spec.scenario import Scenario
from scenarios.sweeps.results import Outcome, differing

_UNITS = {"_m3": "m³", "_deg": "°", "_kn": "kn", "_n": "N", "_m": "m"}  # by the end of a part of a key
_COMPASS_UNIT = "° clockwise from north"


def figure_in_words(key: str) -> str:
    """Return a figure's key in words, with its unit: ``scores.main.tow_tension_n.port.mean`` as "main tow tension port mean [N]"."""
    parts, unit = key.removeprefix("scores.").split("."), ""
    for number, part in enumerate(parts):
        end = next((end for end in _UNITS if part.endswith(end)), None)
        if end is not None:
            parts[number], unit = part.removesuffix(end), _UNITS[end]
    return _labelled(parts, unit)


def entry_in_words(scenario: Scenario, key: str) -> str:
    """Return the key of a varied entry in words, with its unit: ``sea.wind.speed`` as "sea wind speed [m/s]".

    A number without a unit, and what is no number, has none.
    """
    parts = key.split(".")
    *path, name = parts
    if name in COMPASS:
        return _labelled([*path, COMPASS[name]], _COMPASS_UNIT)
    if name.isdigit() and path:  # a component of a vector, such as tank.upper.2
        *path, name = path
    unit = _unit(scenario, path, name)
    return _labelled(parts, unit) if unit else figure_in_words(key)


def _unit(scenario: Scenario, path: Sequence[str], name: str) -> str:
    """Return the unit of the field `name` of the table at `path`; empty if that table declares no such field."""
    table: Any = scenario
    for part in path:
        if isinstance(table, Mapping):
            table = table.get(part)
        else:
            table = table[int(part)] if isinstance(table, tuple) else getattr(table, part, None)
    declared = quantities(type(table)).get(name)
    return declared.unit if declared is not None else ""


def _labelled(parts: Sequence[str], unit: str) -> str:
    words = " ".join(parts).replace("_", " ")
    return f"{words} [{unit}]" if unit else words


_COLUMNS, _PANEL = 4, (4.0, 2.7)  # inches
_BY_CAUSE = "oil_m3.lost"  # beginning of the keys of losses, which runs without such a loss do not have
_FEWEST = 4  # runs of a sampled sweep, from which a correlation says something


def draw_sweep(outcomes: Sequence[Outcome], picture: Path) -> bool:
    """Draw the figures that differ between the runs to a PNG file; False if no two runs have measured any, which leaves no picture."""
    drawn = drawn_figures([outcome.figures() for outcome in outcomes])
    if not drawn:
        return False
    if _is_sampled(outcomes):
        _draw_tornado(outcomes, drawn, picture)
        return True
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
    return True


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


_COLORS = "YlOrBr"
_LOST = "oil_m3.lost"
_LEAST_RUNS = 4


def draw_loss_map(outcomes: Sequence[Outcome], picture: Path) -> bool:
    """Draw the oil lost, in percent of the oil spilled, over the first two varied entries to a PNG file; return whether there is one.

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
        axes.set_title("oil lost, % of the oil spilled", loc="left")
        figure.colorbar(axes.collections[0], ax=axes, label="%")
        figure.savefig(picture)
    return True


def lost_share(outcome: Outcome) -> float:
    """Compute the oil that booms lost in a run [% of the oil spilled]; NaN where none was spilled."""
    figures = outcome.figures()
    spilled = figures.get("oil_m3.spilled", 0.0)
    lost = sum(value for key, value in figures.items() if key == _LOST or key.startswith(f"{_LOST}."))
    return 100.0 * lost / spilled if spilled > 0.0 else math.nan


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

"""The picture: one panel a measure, wall time across, error upwards, a line along each solver's Pareto front."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from tests.benchmarks.pareto.measures import pareto_front
from tests.benchmarks.pareto.results import Row, points

COLORS = ("tab:blue", "tab:red", "tab:green", "tab:purple")  # one a solver
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")  # one a family
COLUMNS = 4


def _panel(axes: Axes, rows: Sequence[Row], measure: str, looks: Mapping[str, Mapping[str, str]]) -> None:
    for row in rows:
        if measure in row.errors:
            axes.plot(
                row.wall_per_second, row.errors[measure], linestyle="none", color=looks["solver"][row.solver],
                marker=looks["family"][row.family], markersize=7, alpha=0.75, markeredgecolor="white", markeredgewidth=0.6,
            )  # fmt: skip
    for solver, color in looks["solver"].items():
        front = pareto_front(points(rows, solver, measure))
        if front:
            axes.plot(*zip(*front, strict=True), color=color, linewidth=1.6, zorder=1)
    axes.set(xscale="log", yscale="log", xlabel="wall seconds a simulated second", ylabel=measure)
    axes.grid(True, which="major", alpha=0.35)
    axes.grid(True, which="minor", alpha=0.12)


def _legend(axes: Axes, looks: Mapping[str, Mapping[str, str]]) -> None:
    solvers = [Line2D([], [], color=color, label=f"{name}, Pareto front") for name, color in looks["solver"].items()]
    families = [
        Line2D([], [], color="0.35", marker=marker, linestyle="none", label=name)
        for name, marker in looks["family"].items()
    ]
    axes.axis("off")
    axes.legend(handles=[*solvers, *families], loc="center", frameon=False)


def draw(rows: Sequence[Row], titles: Mapping[str, str], file: Path) -> None:
    """Write the picture of all rows to `file`; `titles` names the scenes."""
    looks = {
        "solver": dict(zip(dict.fromkeys(row.solver for row in rows), COLORS, strict=False)),
        "family": dict(zip(dict.fromkeys(row.family for row in rows), MARKERS, strict=False)),
    }
    panels = list(dict.fromkeys((row.scene, measure) for row in rows for measure in row.errors))
    columns = min(COLUMNS, len(panels) + 1)
    lines = math.ceil((len(panels) + 1) / columns)
    figure, grid = plt.subplots(
        lines, columns, figsize=(4.2 * columns, 3.9 * lines), squeeze=False, layout="constrained"
    )
    places = list(grid.flat)
    for axes, (scene, measure) in zip(places, panels, strict=False):
        _panel(axes, [row for row in rows if row.scene == scene], measure, looks)
        axes.set_title(titles[scene])
    _legend(places[len(panels)], looks)
    for axes in places[len(panels) + 1 :]:
        axes.axis("off")
    figure.suptitle("run time against error: lower left is better")
    figure.savefig(file, dpi=130)
    plt.close(figure)

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
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from tests.benchmarks.pareto.measures import pareto_front
from tests.benchmarks.pareto.results import Row, points

COLORS = ("tab:blue", "tab:red", "tab:green", "tab:purple")  # one a solver
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")  # one a family
COLUMNS = 4


def _panel(axes: Axes, rows: Sequence[Row], measure: str, looks: Mapping[str, Mapping[str, str]]) -> None:
    axes.set(xscale="log", yscale="log", ylabel=measure)
    across = ["wall seconds a simulated second"]
    for solver, color in looks["solver"].items():
        mine = [row for row in rows if row.solver == solver]
        front = pareto_front(points(mine, solver, measure))
        if front:
            axes.plot(*zip(*front, strict=True), color=color, linewidth=1.6, zorder=1)
        for row in mine:
            _mark(axes, row, measure, color, looks["family"][row.family], front)
        lost = [row for row in mine if measure not in row.errors]
        if lost:
            across.append(f"({solver}: {len(lost)} of {len(mine)} runs without a result)")
    axes.set_xlabel("\n".join(across))
    for axis in (axes.xaxis, axes.yaxis):
        low, high = axis.get_view_interval()
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100.0 * low else (1.0,)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(True, which="major", alpha=0.35)


def _mark(axes: Axes, row: Row, measure: str, color: str, marker: str, front: Sequence[tuple[float, float]]) -> None:
    """One point; a black rim tells that it lies on the front."""
    if measure in row.errors:
        best = (row.wall_per_second, row.errors[measure]) in front
        axes.plot(
            row.wall_per_second, row.errors[measure], linestyle="none", color=color, marker=marker, markersize=7,
            markeredgecolor="black" if best else "white", markeredgewidth=0.9, alpha=0.95 if best else 0.6,
        )  # fmt: skip


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
    figure.suptitle(
        "run time against error: lower left is better; a black rim: no other run of that solver is both faster and better"
    )
    figure.savefig(file, dpi=130)
    plt.close(figure)

"""The diagrams of a debrief: figures over time with the key moments numbered, and shares along the boom."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.constants import knot

from booms.containment import PRACTICE_SPEED
from recordings import palette
from recordings.replay.recording import Replay
from recordings.sink.plots import labels, plots_with_series
from scenarios.debrief.boom_history import BoomHistory
from scenarios.debrief.key_moments import KeyMoment

Array = NDArray[np.float64]
_WIDTH = 8.6  # inches
_HELD, _FREE = "#3b2a1a", "#c9bba7"
_LINES = ("#1f5fa8", "#e07b20", "#4a8f4a", "#8a5aa8")
_LITRES = 2.0  # [m3]: less is told in litres


def empty_figure(height: float) -> Figure:
    """A figure of a debrief's width, ready to be saved."""
    figure = Figure(figsize=(_WIDTH, height), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def oil_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure:
    """Where the oil was: held, lost by cause, and, under it on a scale of its own, what was lost."""
    figure = empty_figure(4.6)
    whole, lost = figure.subplots(2, 1, sharex=True)
    factor, unit = _volume_unit(history)
    parts = {"held": (history.oil["retained"], _HELD), "not met yet": (history.oil["free"], _FREE)}
    causes = {
        _words(cause): (volume, palette.css(palette.cause_color(cause))) for cause, volume in history.causes.items()
    }
    for axes, shown in ((whole, {**parts, **causes}), (lost, causes)):
        shown = {name: part for name, part in shown.items() if part[0].any()}
        if shown:
            volumes = [factor * volume for volume, _ in shown.values()]
            colors = [color for _, color in shown.values()]
            axes.stackplot(history.time, volumes, labels=list(shown), colors=colors, edgecolor="#ffffff", linewidth=0.4)
        axes.set_ylabel(unit)
    if not causes:
        lost.text(0.5, 0.5, "nothing was lost", transform=lost.transAxes, ha="center", color="#5c6b76")
    whole.set_title("Where the oil was", loc="left")
    lost.set_title("Lost by cause, on a scale of its own", loc="left", fontsize=10.5)
    if whole.get_legend_handles_labels()[0]:  # nothing is drawn of a run without oil
        whole.legend(frameon=False, ncols=5, loc="lower right", bbox_to_anchor=(1.0, 0.98), fontsize=9)
    _finish([whole, lost], moments)
    return figure


def speed_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure:
    """Speeds in knots against the 0.7 knots from which a boom loses oil."""
    figure = empty_figure(2.9)
    axes = figure.subplots()
    limit, held = PRACTICE_SPEED / knot, _held_speed(history).max(axis=1) / knot
    worst = np.abs(history.normal_flow).max(axis=1) / knot
    axes.plot(
        history.time,
        held,
        color=_LINES[0],
        linewidth=1.6,
        label=f"normal to the boom, largest held for {history.hold_time:.2g} s",
    )
    axes.plot(
        history.time, worst, color=_LINES[0], linewidth=1.0, alpha=0.4, label="normal to the boom, at its largest"
    )
    if history.tow_speed.any():
        axes.plot(
            history.time, history.tow_speed / knot, color=_LINES[1], linewidth=1.6, label="tow, through the water"
        )
    axes.axhline(limit, color="#c23030", linewidth=1.4, linestyle="--", label=f"{limit:.1f} kn: oil is lost")
    axes.fill_between(history.time, limit, held, where=held > limit, color="#c23030", alpha=0.18, linewidth=0.0)
    axes.set_ylim(bottom=0.0)
    axes.set_title("Speed of the water against the boom", loc="left")
    axes.set_ylabel("kn")
    axes.legend(frameon=False, ncols=2, fontsize=9, loc="upper left")
    _finish([axes], moments)
    return figure


def tension_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure | None:
    """Tow tension at each end; None if it was not recorded."""
    if not history.tow_tension:
        return None
    figure = empty_figure(2.9)
    axes = figure.subplots()
    for color, (end, tension) in zip(_LINES, history.tow_tension.items(), strict=False):
        mean = tension[history.under_way].mean()
        label = f"{end}: mean under way {mean:.3g} N, peak {history.tow_peak[end].max():.3g} N"
        axes.plot(history.time, tension, color=color, linewidth=1.4, label=label)
    axes.set_ylim(bottom=0.0, top=1.3 * max(float(tension.max()) for tension in history.tow_tension.values()))
    axes.set_title("Tow tension at each end", loc="left")
    axes.set_ylabel("N")
    axes.legend(frameon=False, fontsize=9, loc="upper left")
    _finish([axes], moments)
    return figure


def skirt_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure:
    """Lean and draft of the skirt, and the gap ratio."""
    figure = empty_figure(5.4)
    lean, draft, gap = figure.subplots(3, 1, sharex=True)
    angle = np.degrees(history.skirt_angle)
    lean.plot(history.time, angle.max(axis=1), color=_LINES[0], linewidth=1.4, label="most leaning segment")
    lean.plot(history.time, np.median(angle, axis=1), color=_LINES[0], alpha=0.5, linewidth=1.2, label="median segment")
    lean.set_title("Lean of the skirt from upright", loc="left")
    lean.set_ylabel("deg")
    share = 100.0 * history.effective_draft / history.boom.skirt_depth
    draft.plot(history.time, share.min(axis=1), color=_LINES[2], linewidth=1.4, label="shallowest segment")
    draft.plot(
        history.time, np.median(share, axis=1), color=_LINES[2], alpha=0.5, linewidth=1.2, label="median segment"
    )
    draft.set_title(f"Draft kept, of the skirt's {history.boom.skirt_depth:g} m", loc="left")
    draft.set_ylabel("%")
    gap.plot(history.time, history.gap_ratio, color=_LINES[3], linewidth=1.4)
    gap.axhline(1.0 / 3.0, color="#7b8791", linewidth=1.0, linestyle="--")
    gap.set_title("Gap ratio (dashed: one third)", loc="left")
    for axes in (lean, draft):
        axes.legend(frameon=False, ncols=2, fontsize=9, loc="lower right", bbox_to_anchor=(1.0, 0.98))
    for axes in (lean, gap):
        axes.set_ylim(bottom=0.0)
    _finish([lean, draft, gap], moments)
    return figure


def along_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure:
    """Speed, lean and tension along the boom over time: where it was weak."""
    maps: list[tuple[str, str, Array, str, float | None]] = [
        ("Speed held normal to the boom; white line: 0.7 kn", "kn", _held_speed(history) / knot, "viridis", 0.7),
        ("Lean of the skirt", "deg", np.degrees(history.skirt_angle), "cividis", None),
    ]
    if not np.isnan(history.tension).any():
        maps.append(("Tension", "N", history.tension, "inferno_r", None))
    figure = empty_figure(1.75 * len(maps))
    rows = np.atleast_1d(figure.subplots(len(maps), 1, sharex=True))
    place = (np.arange(history.tension.shape[1]) + 0.5) * history.boom.length / history.tension.shape[1]
    for axes, (title, unit, values, colors, level) in zip(rows, maps, strict=True):
        image = axes.pcolormesh(history.time, place, values.T, cmap=colors, shading="nearest", rasterized=True)
        if level is not None and np.nanmin(values) < level < np.nanmax(values):
            axes.contour(history.time, place, values.T, levels=[level], colors="white", linewidths=1.0)
        figure.colorbar(image, ax=axes, label=unit, pad=0.01)
        axes.set_title(f"{title}, along the boom from {history.boom.ends[0]}", loc="left", fontsize=10.5)
        axes.set_ylabel("m")
    _finish(list(rows), moments, grid=False)
    return figure


def _held_speed(history: BoomHistory) -> Array:
    """Speeds held (N, S) [m/s], NaN until one can have been held; 0 if the run is too short for that."""
    begun = history.time - history.time[0] >= history.hold_time
    return np.where(begun[:, None], history.held_speed, np.nan if begun.any() else 0.0)


def probe_diagram(replay: Replay, moments: Sequence[KeyMoment]) -> Figure | None:
    """Draw the readings of the probes, each quantity on a scale of its own; None without probes."""
    probes = [name for name in sorted(replay.scalars) if name.startswith("probes/")]
    if not probes:
        return None
    plots = plots_with_series(replay.run.plots, probes)
    figure = empty_figure(1.0 + 1.3 * len(plots))
    rows = np.atleast_1d(figure.subplots(len(plots), 1, sharex=True))
    for axes, (title, names) in zip(rows, plots.items(), strict=True):
        for color, name, label in zip(_LINES, names, labels(names), strict=False):
            series = replay.scalars[name]
            axes.plot(series.time, series.value, color=color, linewidth=1.4, label=label)
        axes.set_title(title, loc="left", fontsize=10.5)
        if len(names) > 1:
            axes.legend(frameon=False, ncols=3, fontsize=9, loc="lower right", bbox_to_anchor=(1.0, 0.96))
    _finish(list(rows), moments)
    return figure


def _finish(rows: Sequence[Axes], moments: Sequence[KeyMoment], *, grid: bool = True) -> None:
    """Time axis, grid, and the numbers of the key moments over the topmost diagram."""
    for axes in rows:
        axes.margins(x=0.0)
        axes.set_axisbelow(True)
        if grid:
            axes.grid(axis="y", color="#e3e8ec", linewidth=0.8)
        for moment in moments:
            axes.axvline(moment.time, color="#7b8791", linewidth=0.8, linestyle=":")
    for moment in moments:
        mark = {"boxstyle": "circle,pad=0.18", "facecolor": "#26323b", "edgecolor": "none"}
        rows[-1].annotate(
            str(moment.number), (moment.time, 0.0), (0.0, -24.0), xycoords=("data", "axes fraction"),
            textcoords="offset points", ha="center", va="center", fontsize=8, color="white", bbox=mark, annotation_clip=False,
        )  # fmt: skip
    rows[-1].set_xlabel("simulated time [s]; numbers: key moments", labelpad=16.0)


def _volume_unit(history: BoomHistory) -> tuple[float, str]:
    largest = float((history.oil["retained"] + history.oil["lost"] + history.oil["free"]).max())
    return (1.0, "m³") if largest >= _LITRES else (1000.0, "litres")


def _words(cause: str) -> str:
    return cause.replace("_", " ")


DIAGRAMS: dict[str, Callable[[BoomHistory, Sequence[KeyMoment]], Figure | None]] = {
    "oil": oil_diagram,
    "speed": speed_diagram,
    "tension": tension_diagram,
    "skirt": skirt_diagram,
    "along": along_diagram,
}

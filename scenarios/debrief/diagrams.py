"""The diagrams of a debrief: figures over time with the numbered key moments, and maps along the boom."""

from __future__ import annotations

import colorsys
from collections.abc import Callable, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from booms.containment import PRACTICE_SPEED
from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import KNOT
from recordings.model import palette
from recordings.model.words import cause_in_words, force_in_words, force_unit
from recordings.pictures.style import EDGE, unit_for
from recordings.replay.recording import Replay
from recordings.sink.plots import labels, plots_with_series
from scenarios.debrief.boom_history import BoomHistory
from scenarios.debrief.key_moments import KeyMoment

_WIDTH = 8.6  # inches
HELD_COLOR, _FREE = "#3b2a1a", "#c9bba7"
_LINES = ("#1f5fa8", "#e07b20", "#4a8f4a", "#8a5aa8")
_GOLDEN = 0.618034  # of the circle of hues, by which the colours of further series differ


def empty_figure(height: float) -> Figure:
    """Create a figure of the page's width, ready to be saved; `height` in inches."""
    figure = Figure(figsize=(_WIDTH, height), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def line_color(place: int) -> str:
    """Return the colour of the series at a place in its diagram; no two series of a diagram share one."""
    if place < len(_LINES):
        return _LINES[place]
    red, green, blue = colorsys.hsv_to_rgb((place * _GOLDEN) % 1.0, 0.75, 0.7)
    return mpl.colors.to_hex((red, green, blue))


def oil_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure:
    """Draw the oil over time: held, not met and lost by cause; below, the lost oil on its own scale."""
    figure = empty_figure(4.6)
    whole, lost = figure.subplots(2, 1, sharex=True)
    factor, unit = volume_unit(history)
    parts = {"held": (history.oil["contained"], HELD_COLOR), "not met yet": (history.oil["afloat"], _FREE)}
    causes = {
        cause_in_words(cause): (volume, palette.css(palette.cause_color(cause)))
        for cause, volume in history.causes.items()
    }
    for axes, shown in ((whole, {**parts, **causes}), (lost, causes)):
        shown = {name: part for name, part in shown.items() if part[0].any()}
        if shown:
            volumes = [factor * volume for volume, _ in shown.values()]
            colors = [color for _, color in shown.values()]
            edge = {"edgecolor": EDGE, "linewidth": 0.4}  # since oil that splashed over is white
            axes.stackplot(history.time, volumes, labels=list(shown), colors=colors, **edge)
        axes.set_ylabel(unit)
    if not causes:
        lost.text(0.5, 0.5, "no oil was lost", transform=lost.transAxes, ha="center", color="#5c6b76")
    whole.set_title("Where the oil was", loc="left")
    lost.set_title("How oil was lost, on a scale of its own", loc="left", fontsize=10.5)
    if whole.get_legend_handles_labels()[0]:  # a run without oil has nothing to draw
        whole.legend(frameon=False, ncols=1, loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    finish([whole, lost], moments)
    return figure


def speed_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure:
    """Draw speeds in knots, with the 0.7 knots above which booms lose oil."""
    figure = empty_figure(2.9)
    axes = figure.subplots()
    limit, held = PRACTICE_SPEED / KNOT, _held_speed(history).max(axis=1) / KNOT
    worst = np.abs(history.normal_flow).max(axis=1) / KNOT
    axes.plot(
        history.time,
        held,
        color=_LINES[0],
        linewidth=1.6,
        label=f"normal to the boom, highest held for {history.boom.hold_time:.2g} s",
    )
    axes.plot(
        history.time,
        worst,
        color=_LINES[0],
        linewidth=1.0,
        alpha=0.4,
        label="normal to the boom, highest at the instant",
    )
    if history.tow_speed.any():
        axes.plot(
            history.time, history.tow_speed / KNOT, color=_LINES[1], linewidth=1.6, label="tow speed through the water"
        )
    axes.axhline(limit, color="#c23030", linewidth=1.4, linestyle="--", label=f"above {limit:.1f} kn booms lose oil")
    axes.fill_between(history.time, limit, held, where=held > limit, color="#c23030", alpha=0.18, linewidth=0.0)
    axes.set_ylim(bottom=0.0)
    axes.set_title("Speed of the water against the boom", loc="left")
    axes.set_ylabel("kn")
    axes.legend(frameon=False, ncols=2, fontsize=9, loc="upper left")
    finish([axes], moments)
    return figure


def tension_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure | None:
    """Draw the tow tension at each end; None if it was not recorded."""
    if not history.tow_tension:
        return None
    figure = empty_figure(2.9)
    axes = figure.subplots()
    largest = max(float(tension.max()) for tension in history.tow_tension.values())
    factor, unit = force_unit(max(float(peak.max()) for peak in history.tow_peak.values()))
    for place, (end, tension) in enumerate(history.tow_tension.items()):
        mean, peak = (
            force_in_words(float(tension[history.settled].mean())),
            force_in_words(float(history.tow_peak[end].max())),
        )
        label = f"{end}: mean once settled {mean}, peak {peak}"
        axes.plot(history.time, factor * tension, color=line_color(place), linewidth=1.4, label=label)
    axes.set_ylim(bottom=0.0, top=1.3 * factor * largest or None)
    axes.set_title("Tension at each end", loc="left")
    axes.set_ylabel(unit)
    axes.legend(frameon=False, fontsize=9, loc="upper left")
    finish([axes], moments)
    return figure


def skirt_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure:
    """Draw lean and draft of the skirt, and the gap ratio."""
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
    draft.set_title(f"Draft of the skirt, of {history.boom.skirt_depth:g} m", loc="left")
    draft.set_ylabel("%")
    gap.plot(history.time, history.gap_ratio, color=_LINES[3], linewidth=1.4)
    gap.axhline(1.0 / 3.0, color="#7b8791", linewidth=1.0, linestyle="--")
    gap.set_title("Gap ratio (dashed line: one third)", loc="left")
    for axes in (lean, draft):
        axes.legend(frameon=False, ncols=2, fontsize=9, loc="lower right", bbox_to_anchor=(1.0, 0.98))
    for axes in (lean, gap):
        axes.set_ylim(bottom=0.0)
    finish([lean, draft, gap], moments)
    return figure


def along_diagram(history: BoomHistory, moments: Sequence[KeyMoment]) -> Figure:
    """Draw speed, lean and tension along the boom over time: they show its weak places."""
    maps: list[tuple[str, str, Array, str, float | None]] = [
        ("Held speed normal to the boom (white line: 0.7 kn)", "kn", _held_speed(history) / KNOT, "viridis", 0.7),
        ("Lean of the skirt", "deg", np.degrees(history.skirt_angle), "cividis", None),
    ]
    if not np.isnan(history.tension).any():
        factor, unit = force_unit(float(history.tension.max()))
        maps.append(("Tension", unit, factor * history.tension, "inferno_r", None))
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
    finish(list(rows), moments, grid=False)
    return figure


def _held_speed(history: BoomHistory) -> Array:
    """Compute the held speeds (N, S) [m/s]: NaN before the hold time has passed, or 0 if the run is shorter than that."""
    begun = history.time - history.time[0] >= history.boom.hold_time
    return np.where(begun[:, None], history.held_speed, np.nan if begun.any() else 0.0)


def probe_diagram(replay: Replay, moments: Sequence[KeyMoment]) -> Figure | None:
    """Draw the readings of the probes, each quantity on its own scale; None without probes."""
    probes = [name for name in sorted(replay.scalars) if name.startswith("probes/")]
    if not probes:
        return None
    plots = plots_with_series(replay.run.plots, probes)
    figure = empty_figure(1.0 + 1.3 * len(plots))
    rows = np.atleast_1d(figure.subplots(len(plots), 1, sharex=True))
    for axes, (title, names) in zip(rows, plots.items(), strict=True):
        for place, (name, label) in enumerate(zip(names, labels(names), strict=True)):
            series = replay.scalars[name]
            axes.plot(series.time, series.value, color=line_color(place), linewidth=1.4, label=label)
        axes.set_title(title, loc="left", fontsize=10.5)
        if len(names) > 1:
            axes.legend(frameon=False, ncols=3, fontsize=9, loc="lower right", bbox_to_anchor=(1.0, 0.96))
    finish(list(rows), moments)
    return figure


def finish(rows: Sequence[Axes], moments: Sequence[KeyMoment], *, grid: bool = True) -> None:
    """Add time axis and grid, and write the numbers of the key moments below the lowest diagram."""
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
    rows[-1].set_xlabel("simulated time [s]; the numbers mark the key moments", labelpad=16.0)


def volume_unit(history: BoomHistory) -> tuple[float, str]:
    """Return the factor from m3, and the name, of the unit in which the page shows the volumes of a boom."""
    largest = float((history.oil["contained"] + history.oil["lost"] + history.oil["afloat"]).max())
    name, factor = unit_for("m³", largest)
    return factor, name


DIAGRAMS: dict[str, Callable[[BoomHistory, Sequence[KeyMoment]], Figure | None]] = {
    "speed": speed_diagram,
    "tension": tension_diagram,
    "skirt": skirt_diagram,
    "along": along_diagram,
}

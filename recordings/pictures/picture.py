"""Draw a run as one picture: scenes at some moments, events with their numbers, and diagrams over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from textwrap import shorten
from typing import Literal

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D

from recordings.model import palette
from recordings.model.frame import Event, RunDescription
from recordings.pictures.chart import draw_map
from recordings.pictures.scenes import SceneView
from recordings.pictures.style import EVENT_COLORS, STYLE, edge_of_light, shown_in
from recordings.replay.joined import JoinedReplay
from recordings.replay.moments import Moment, key_steps, read_moments, recorded_steps
from recordings.replay.recording import Replay
from recordings.sink.plots import labels, plots_with_series

EVENT_ROW = 1.1  # height of the events, in heights of a diagram
_NAMED_EVENTS = 4
_EVENT_LETTERS = 88  # letters that fit above a diagram
_WIDTH = 1.6  # [points] of a line
_BESIDE = 0.035  # of the width: numbers of events closer than this share a mark
_Style = Literal["-"] | tuple[float, Sequence[float]]
_STYLES: tuple[_Style, ...] = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (5, 1.5, 1, 1.5)))  # of booms, in turn
_LEGEND_SIZES = (
    (56, 9.0),
    (66, 7.5),
    (1000, 6.5),
)  # letters of a legend that fit beside the title of a diagram, and their size


def draw_events(axes: Axes, events: Sequence[Event], span: tuple[float, float]) -> None:
    """Write the few most urgent events, of equals the last, and below them their numbers at their times; span [s] of the axis."""
    shown = sorted(
        sorted(events, key=lambda event: (event.urgency, event.time))[-_NAMED_EVENTS:], key=lambda event: event.time
    )
    axes.set_ylim(-1.8, _NAMED_EVENTS - 0.5)
    axes.set_axis_off()
    for place, event in enumerate(shown):
        row, color = len(shown) - 1 - place, EVENT_COLORS[event.level]
        said = f"{event.source}: {event.text}" if event.source else event.text
        text = shorten(f"{event.time:.1f} s  {said}", _EVENT_LETTERS, placeholder=" ...")
        across = axes.get_yaxis_transform()
        axes.text(0.0, row, str(place + 1), transform=across, va="center", fontsize=9, color=color, fontweight="bold")
        axes.text(0.025, row, text, transform=across, va="center", fontsize=9, color=color)
    for time, numbers, color in _marks(shown, _BESIDE * (span[1] - span[0])):
        axes.plot([time], [-1.7], marker="v", markersize=4.5, color=color, clip_on=False)
        axes.text(time, -1.35, numbers, ha="center", va="bottom", fontsize=8.5, color=color, fontweight="bold")


def _marks(events: Sequence[Event], apart: float) -> list[tuple[float, str, str]]:
    """List times, numbers and colours of the marks; events within `apart` [s] of the first of a mark share it."""
    found: list[tuple[float, list[int], str]] = []
    for number, event in enumerate(events, start=1):
        if found and event.time - found[-1][0] < apart:
            found[-1][1].append(number)
        else:
            found.append((event.time, [number], EVENT_COLORS[event.level]))
    return [(time, ", ".join(map(str, numbers)), color) for time, numbers, color in found]


def draw_lines(axes: Axes, replay: Replay, names: Sequence[str], booms: Sequence[str], factor: float) -> None:
    """Draw series times `factor` in one diagram; of several `booms`, a quantity has one colour, and a boom one style of line."""
    quantities = [_quantity(name, booms) for name in names]
    unlike = list(dict.fromkeys(quantities))
    colors = {one: _line_color(one) or f"C{place % 10}" for place, one in enumerate(unlike)}
    styles = {boom: _STYLES[place % len(_STYLES)] for place, boom in enumerate(booms)}
    for name, quantity in zip(names, quantities, strict=True):
        series, boom = replay.scalars[name], name.removesuffix(quantity).rstrip("/")
        color = colors[quantity]
        axes.plot(
            series.time, factor * series.value, linewidth=_WIDTH, color=color, linestyle=styles.get(boom, _STYLES[0]),
            path_effects=edge_of_light(color, _WIDTH),
        )  # fmt: skip
    shown = [_key(colors[one], "-", label) for one, label in zip(unlike, labels(unlike), strict=True)]
    drawn = [boom for boom in booms if any(name.startswith(f"{boom}/") for name in names)]
    shown += [_key("#5c6b76", styles[boom], boom) for boom in drawn if len(drawn) > 1]
    if len(shown) > 1 or "/" in names[0]:  # a single cause of loss needs its name, too
        letters = sum(len(str(line.get_label())) + 4 for line in shown)
        size = next(size for most, size in _LEGEND_SIZES if letters <= most)
        axes.legend(
            handles=shown, frameon=False, ncols=len(shown), loc="lower right", bbox_to_anchor=(1.0, 0.97), fontsize=size,
            columnspacing=1.2, handlelength=1.6, handletextpad=0.5, borderaxespad=0.2,
        )  # fmt: skip


def _key(color: str, style: _Style, label: str) -> Line2D:
    """Return the line that stands in a legend."""
    effects = edge_of_light(color, _WIDTH)
    return Line2D([], [], linewidth=_WIDTH, color=color, linestyle=style, label=label, path_effects=effects)


def _quantity(name: str, booms: Sequence[str]) -> str:
    """Return the name of a series without that of its boom."""
    boom, _, rest = name.partition("/")
    return rest if rest and boom in booms else name


def _line_color(name: str) -> str | None:
    """Return the colour that a series has in the viewer, too; None for the next colour in turn."""
    if "oil_lost/" in name:
        return palette.css(palette.cause_color(name.rpartition("/")[2]))
    return palette.css(palette.LIMIT) if name.endswith("_limit") else None


Points = npt.NDArray[np.float64]
MOMENTS = 3
_DIAGRAMS = 3
_TITLE_SIZE, _TITLE_LETTERS = 19.0, 80  # letters of that size that fit above the picture
_ORDERS_OF_INJECTS = "injects"  # source of orders that the text of an inject says in words
_AS_PLANNED = ("", "completed", "finished")  # reasons of an end that need no words
_SCENE_WIDTH = 930  # [pixels], 1.5 times as many as shown


def draw_picture(recording: str | Path, picture: str | Path) -> None:
    """Read a recording, and those that it goes on from, and draw the run's picture to a PNG file of 1920 x 1200 pixels."""
    replay = JoinedReplay(recording)
    moments = read_moments(replay, key_steps(recorded_steps(replay), MOMENTS))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(16.0, 10.0), dpi=120, facecolor="white")
        FigureCanvasAgg(figure)
        view = SceneView(replay.run, moments, _SCENE_WIDTH)
        images = [view.draw(moment) for moment in moments]
        scene_height = images[0].shape[0] / _SCENE_WIDTH
        outer = figure.add_gridspec(
            2,
            1,
            height_ratios=[1.5 * scene_height, 2.0 - 1.5 * scene_height],
            left=0.045,
            right=0.985,
            top=0.9,
            bottom=0.06,
            hspace=0.13,
        )
        _draw_title(figure, replay)
        scenes = outer[0].subgridspec(1, len(moments), wspace=0.03)
        for column, (moment, image) in enumerate(zip(moments, images, strict=True)):
            _show_scene(figure.add_subplot(scenes[column]), moment, image)
        figure.axes[-1].set_title(view.note, loc="right", pad=4, fontsize=9.0, color="#5c6b76", fontweight="normal")
        has_series = bool(replay.events or _diagrams(replay))
        below = outer[1].subgridspec(1, 1 + has_series, width_ratios=[1.15, 1.0][: 1 + has_series], wspace=0.13)
        draw_map(figure.add_subplot(below[0]), replay, moments)
        if has_series:
            _draw_series(figure, below[1], replay, moments)
        figure.savefig(picture)


def _show_scene(axes: Axes, moment: Moment, image: Points) -> None:
    axes.imshow(image, interpolation="antialiased", aspect="equal")
    axes.set_axis_off()
    axes.set_title(f"{moment.time:.1f} s", loc="left", pad=4)


def _draw_title(figure: Figure, replay: Replay) -> None:
    """Write the name, the title, and the numbers that describe the run."""
    run = replay.run
    title = str(run.properties.get("title", "")) or run.name
    size = _TITLE_SIZE * min(1.0, _TITLE_LETTERS / max(len(title), 1))
    figure.text(0.045, 0.965, title, fontsize=size, fontweight="bold", va="center")
    counts = ", ".join(f"{phase.name} {phase.rest_density:g} kg/m³" for phase in run.phases)
    facts = [run.name if title != run.name else "", counts, _detail(run)]
    figure.text(0.045, 0.935, "  ·  ".join(fact for fact in facts if fact), fontsize=11, va="center", color="#5c6b76")
    if replay.end_reason not in _AS_PLANNED:
        figure.text(0.985, 0.965, replay.end_reason, fontsize=11, va="center", ha="right", color="#c23030")


def _draw_series(figure: Figure, place: SubplotSpec, replay: Replay, moments: Sequence[Moment]) -> None:
    """Draw the events, and up to three diagrams over simulated time."""
    chosen = _diagrams(replay)
    events = [event for event in replay.events if event.source != _ORDERS_OF_INJECTS]
    heights = [EVENT_ROW] * bool(events) + [1.0] * len(chosen)
    if not heights:
        return
    grid = place.subgridspec(len(heights), 1, hspace=0.42, height_ratios=heights)
    rows = [figure.add_subplot(grid[row]) for row in range(len(heights))]
    diagrams = rows[-len(chosen) :] if chosen else []
    if events:
        draw_events(rows[0], events, (moments[0].time, moments[-1].time))
    booms = [boom.name for boom in replay.run.exercise.booms] if replay.run.exercise else []
    for axes, (title, names) in zip(diagrams, chosen, strict=True):
        own = title in replay.run.plots  # whose author has chosen the unit
        heading, factor = (title, 1.0) if own else shown_in(title, _largest(replay, names))
        draw_lines(axes, replay, names, booms if len(booms) > 1 else [], factor)
        axes.set_title(heading, loc="left", fontsize=10.5)
        axes.margins(x=0.0, y=0.12)
        axes.grid(axis="y", color="#e3e8ec", linewidth=0.8)
        axes.tick_params(labelbottom=axes is rows[-1])
    for axes in rows:
        axes.set_xlim(moments[0].time, max(moments[-1].time, moments[0].time + 1e-3))
    for axes in diagrams:  # not through the texts of the events
        for moment in moments:
            axes.axvline(moment.time, color="#c8d1d8", linewidth=0.8, zorder=0)
        for event in events:
            axes.axvline(event.time, color=EVENT_COLORS[event.level], linewidth=0.9, linestyle=":")
    rows[-1].set_xlabel("simulated time [s]")


def _diagrams(replay: Replay) -> list[tuple[str, list[str]]]:
    """Choose up to three diagrams, by title and names of series: those in which something happens, if there are any."""
    told = {name for name, series in replay.scalars.items() if "/" not in name or np.any(series.value != 0.0)}
    plots = plots_with_series(replay.run.plots, list(replay.scalars))
    showing = [(title, [name for name in names if name in told]) for title, names in plots.items()]
    showing = [(title, names) for title, names in showing if names]
    moved = [one for one in showing if any(np.any(replay.scalars[name].value != 0.0) for name in one[1])]
    return (moved or showing)[:_DIAGRAMS]


def _largest(replay: Replay, names: Sequence[str]) -> float:
    """Return the largest magnitude of some series; 0 if they are empty."""
    values = np.concatenate([np.abs(replay.scalars[name].value).ravel() for name in names])
    return float(np.nanmax(values, initial=0.0))


def _detail(run: RunDescription) -> str:
    """Say what the water is made of."""
    if run.properties.get("boxes") == "none":
        return "no particles: bodies float by formulas (modelled)"
    if run.properties.get("boxes") == "windows":
        return f"a window of particles {1000.0 * run.particle_spacing:g} mm apart, outside it formulas and parcels (modelled)"
    return f"particles {1000.0 * run.particle_spacing:g} mm apart"

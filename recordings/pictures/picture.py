"""The picture of a run, drawn from its recording alone: three moments in space, a map, and its numbers over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from recordings.frame import RunDescription
from recordings.pictures.chart import draw_map
from recordings.pictures.scenes import render_moments
from recordings.pictures.series import EVENT_ROW, draw_events, draw_lines
from recordings.pictures.style import EVENT_COLORS, STYLE
from recordings.pictures.units import shown_in
from recordings.replay.joined import JoinedReplay
from recordings.replay.moments import Moment, key_steps, read_moments, recorded_steps
from recordings.replay.recording import Replay
from recordings.sink.plots import plots_with_series

Points = npt.NDArray[np.float64]
MOMENTS = 3
_DIAGRAMS = 3
_TITLE_SIZE, _TITLE_LETTERS = 19.0, 80  # letters of that size that fit above the picture
_ORDERS_OF_INJECTS = "injects"  # source of orders that the text of an inject says in words
_SCENE_WIDTH = 930  # [pixels], 1.5 times as many as shown


def draw_picture(recording: str | Path, picture: str | Path) -> None:
    """Read a recording, and those that it goes on from, and draw the run's picture to a PNG file of 1920 x 1200 pixels."""
    replay = JoinedReplay(recording)
    moments = read_moments(replay, key_steps(recorded_steps(replay), MOMENTS))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(16.0, 10.0), dpi=120, facecolor="white")
        FigureCanvasAgg(figure)
        images = render_moments(replay.run, moments, _SCENE_WIDTH)
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
        below = outer[1].subgridspec(1, 2, width_ratios=[1.15, 1.0], wspace=0.13)
        draw_map(figure.add_subplot(below[0]), replay, moments)
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
    facts = [run.name, counts, _detail(run)]
    figure.text(0.045, 0.935, "  ·  ".join(fact for fact in facts if fact), fontsize=11, va="center", color="#5c6b76")
    if replay.end_reason and replay.end_reason != "completed":
        figure.text(0.985, 0.965, replay.end_reason, fontsize=11, va="center", ha="right", color="#c23030")


def _draw_series(figure: Figure, place: SubplotSpec, replay: Replay, moments: Sequence[Moment]) -> None:
    """Draw the events, and up to three diagrams over simulated time."""
    told = {name for name, series in replay.scalars.items() if "/" not in name or np.any(series.value != 0.0)}
    plots = plots_with_series(replay.run.plots, list(replay.scalars))
    showing = [(title, [name for name in names if name in told]) for title, names in plots.items()]
    showing = [(title, names) for title, names in showing if names]
    moved = [one for one in showing if any(np.any(replay.scalars[name].value != 0.0) for name in one[1])]
    chosen = (moved or showing)[:_DIAGRAMS]
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


def _largest(replay: Replay, names: Sequence[str]) -> float:
    """Return the largest magnitude of some series; 0 if they are empty."""
    values = np.concatenate([np.abs(replay.scalars[name].value).ravel() for name in names])
    return float(np.nanmax(values, initial=0.0))


def _detail(run: RunDescription) -> str:
    """Say what the water is made of."""
    if run.properties.get("detail") == "none":
        return "no particles: bodies float by formulas (modelled)"
    if run.properties.get("detail") == "window":
        return f"a window of particles {1000.0 * run.particle_spacing:g} mm apart, outside it formulas and parcels (modelled)"
    return f"particles {1000.0 * run.particle_spacing:g} mm apart"

"""Draws a run from its recording alone: three moments in space, the whole of it on a map, and its figures over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from textwrap import shorten
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from recordings import palette
from recordings.chart import draw_map
from recordings.frame import CameraView, Event, MeshDescription, PhaseDescription, RunDescription
from recordings.moments import Moment, key_steps, placed_vertices, read_moments, recorded_steps
from recordings.plots import plots_with_series
from recordings.raster import Canvas, fitted_projection
from recordings.replay import Replay

Points = npt.NDArray[np.float64]
MOMENTS = 3
_DIAGRAMS = 3
_SCENE_WIDTH = 930  # pixels drawn, half as many again as shown
_SCENE_HEIGHTS = (0.45, 0.76)  # of a scene, in widths
_MARGIN = 0.04  # round a scene, in widths
_OIL_RADIUS = 0.6  # in particle spacings: a film one particle thick should look closed
_CLEAR_DEPTHS = 0.9  # one sees this many water depths far
_NAMED_EVENTS = 4
_EVENT_LETTERS = 92  # as many as fit over a diagram
_EVENT_ROW = 0.85  # height of the events, in diagrams
_INK = "#26323b"
_EVENT_COLORS = {"info": "#6b7a86", "warning": "#d9822b", "error": "#c23030"}
_STYLE: dict[Any, Any] = {
    "font.size": 10.5,
    "axes.edgecolor": "#9aa7b1",
    "axes.labelcolor": _INK,
    "text.color": _INK,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titleweight": "bold",
}


def draw_picture(recording: str | Path, picture: str | Path) -> None:
    """Read a recording and draw its picture to a PNG file of 1920 x 1200 pixels."""
    replay = Replay(recording)
    moments = read_moments(replay, key_steps(recorded_steps(replay), MOMENTS))
    with mpl.rc_context(_STYLE):
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


def render_moments(run: RunDescription, moments: Sequence[Moment], width: int) -> list[Points]:
    """Pictures (height, width, 3) of several moments with one camera that sees them all, as high as they need."""
    camera = run.camera or _usual_camera(moments)
    eye, target = np.array(camera.eye), np.array(camera.target)
    seen = np.concatenate([_extent(run, moment) for moment in moments])
    margin = _MARGIN * width
    room = int(width - 2.0 * margin)
    tight = fitted_projection(eye, target, seen, room, int(_SCENE_HEIGHTS[1] * width - 2.0 * margin))
    needed = float(np.ptp(tight(seen)[0][:, 1])) + 2.0 * margin
    height = int(np.clip(needed, _SCENE_HEIGHTS[0] * width, _SCENE_HEIGHTS[1] * width))
    fitted = fitted_projection(eye, target, seen, room, int(height - 2.0 * margin))
    projection = replace(fitted, center=fitted.center + margin)
    depth = _water_depth(run, moments)
    return [_render(run, moment, Canvas(projection, width, height), depth) for moment in moments]


def _render(run: RunDescription, moment: Moment, canvas: Canvas, depth: float) -> Points:
    """One moment: what is opaque first, then the water over it."""
    for name, mesh in run.meshes.items():
        if name in moment.bodies:
            placed = placed_vertices(mesh.vertices, moment.bodies[name])
            canvas.triangles(placed, mesh.faces, _mesh_color(name, mesh))
    clear = [(index, phase) for index, phase in enumerate(run.phases) if not _opaque(phase, len(run.phases))]
    for index, phase in enumerate(run.phases):
        if (index, phase) not in clear and phase.name in moment.positions:
            color = palette.phase_color(phase, index)
            canvas.spheres(moment.positions[phase.name], _OIL_RADIUS * run.particle_spacing, color)
    for index, phase in clear:
        if len(moment.positions.get(phase.name, ())):
            color = palette.phase_color(phase, index)
            canvas.water(moment.positions[phase.name], run.particle_spacing, color, _CLEAR_DEPTHS * depth)
    return canvas.image


def _opaque(phase: PhaseDescription, phase_count: int) -> bool:
    """Oil hides what is behind it; water does not, nor does the only fluid of a run unless it is oil."""
    if palette.is_oil(phase.name):
        return True
    return phase_count > 1 and not palette.is_water(phase.name)


def _mesh_color(name: str, mesh: MeshDescription) -> tuple[int, int, int, int]:
    return palette.body_color(name, mesh)


def _extent(run: RunDescription, moment: Moment) -> Points:
    """Points that the picture must hold: nearly all particles, and every body that is not far off."""
    parts = [position for position in moment.positions.values() if len(position)]
    if not parts:
        return np.array([body.position for body in moment.bodies.values()]) if moment.bodies else np.zeros((1, 3))
    together = np.concatenate(parts)
    lower, upper = np.percentile(together, 0.2, axis=0), np.percentile(together, 99.8, axis=0)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (upper - lower) + lower
    room = 0.5 * (upper - lower).max()
    for name, mesh in run.meshes.items():
        if name in moment.bodies:
            placed = placed_vertices(mesh.vertices, moment.bodies[name])
            near = ((placed > lower - room) & (placed < upper + room)).all(axis=1)
            corners = np.concatenate([corners, placed[near]])
    return np.asarray(corners)


def _usual_camera(moments: Sequence[Moment]) -> CameraView:
    """From the front left and above, far enough off that lines stay nearly parallel."""
    particles = [position for moment in moments for position in moment.positions.values() if len(position)]
    bodies = [body.position[None] for moment in moments for body in moment.bodies.values()]
    together = np.concatenate([*(particles or bodies or [np.zeros((1, 3))])]).astype(np.float64)
    middle = np.median(together, axis=0)
    size = max(float(np.ptp(together, axis=0).max()), 1e-3)
    eye = middle + size * np.array([-0.9, -1.6, 1.1])
    return CameraView(tuple(eye.tolist()), tuple(middle.tolist()))


def _water_depth(run: RunDescription, moments: Sequence[Moment]) -> float:
    """How deep the fluids lie at the end [m], bulk of them."""
    heights = [position[:, 2] for position in moments[-1].positions.values() if len(position)]
    if not heights:
        return run.particle_spacing
    lower, upper = np.percentile(np.concatenate(heights), [1.0, 99.0]).tolist()
    return max(float(upper - lower), 2.0 * run.particle_spacing)


def _show_scene(axes: Axes, moment: Moment, image: Points) -> None:
    axes.imshow(image, interpolation="antialiased", aspect="equal")
    axes.set_axis_off()
    axes.set_title(f"{moment.time:.1f} s", loc="left", pad=4)


def _draw_title(figure: Figure, replay: Replay) -> None:
    """Name, what it is about, and the figures that tell its size."""
    run = replay.run
    title = str(run.properties.get("title", "")) or run.name
    figure.text(0.045, 0.965, title, fontsize=19, fontweight="bold", va="center")
    counts = ", ".join(f"{phase.name} {phase.rest_density:g} kg/m³" for phase in run.phases)
    facts = [run.name, counts, f"particles {1000.0 * run.particle_spacing:g} mm apart"]
    figure.text(0.045, 0.935, "  ·  ".join(fact for fact in facts if fact), fontsize=11, va="center", color="#5c6b76")
    if replay.end_reason and replay.end_reason != "completed":
        figure.text(0.985, 0.965, replay.end_reason, fontsize=11, va="center", ha="right", color="#c23030")


def _draw_series(figure: Figure, place: SubplotSpec, replay: Replay, moments: Sequence[Moment]) -> None:
    """The events, and up to three diagrams over simulated time."""
    told = [name for name, series in replay.scalars.items() if "/" not in name or np.any(series.value != 0.0)]
    chosen = list(plots_with_series(replay.run.plots, told).items())[:_DIAGRAMS]
    heights = [_EVENT_ROW] * bool(replay.events) + [1.0] * len(chosen)
    if not heights:
        return
    grid = place.subgridspec(len(heights), 1, hspace=0.42, height_ratios=heights)
    rows = [figure.add_subplot(grid[row]) for row in range(len(heights))]
    diagrams = rows[-len(chosen) :] if chosen else []
    if replay.events:
        _draw_events(rows[0], replay.events)
    for axes, (title, names) in zip(diagrams, chosen, strict=True):
        for name, label in zip(names, _labels(names), strict=True):
            series = replay.scalars[name]
            axes.plot(series.time, series.value, linewidth=1.6, label=label)
        axes.set_title(title, loc="left", fontsize=10.5)
        axes.margins(x=0.0, y=0.12)
        axes.grid(axis="y", color="#e3e8ec", linewidth=0.8)
        axes.tick_params(labelbottom=axes is rows[-1])
        if len(names) > 1:
            axes.legend(frameon=False, ncols=4, loc="lower right", bbox_to_anchor=(1.0, 0.97), fontsize=9)
    for axes in rows:
        axes.set_xlim(moments[0].time, max(moments[-1].time, moments[0].time + 1e-3))
        for moment in moments:
            axes.axvline(moment.time, color="#c8d1d8", linewidth=0.8, zorder=0)
        for event in replay.events if axes in diagrams else ():
            axes.axvline(event.time, color=_EVENT_COLORS[event.level], linewidth=0.9, linestyle=":")
    rows[-1].set_xlabel("simulated time [s]")


def _draw_events(axes: Axes, events: Sequence[Event]) -> None:
    """The last few events: what they say over the width of the diagrams, and a mark where they happened."""
    axes.set_ylim(-0.5, _NAMED_EVENTS - 0.5)
    axes.set_axis_off()
    for row, event in enumerate(reversed(events[-_NAMED_EVENTS:])):
        color = _EVENT_COLORS[event.level]
        text = shorten(f"{event.time:.1f} s  {event.text}", _EVENT_LETTERS, placeholder=" ...")
        axes.text(0.0, row, text, transform=axes.get_yaxis_transform(), va="center", fontsize=9, color=color)
        axes.plot([event.time], [row - 0.4], marker="v", markersize=4.5, color=color, clip_on=False)


def _labels(names: Sequence[str]) -> list[str]:
    """What a legend calls some series: their names less what they have in common."""
    first, last = min(names), max(names)  # in alphabetical order, hence what these two share all share
    alike = next((place for place, pair in enumerate(zip(first, last, strict=False)) if pair[0] != pair[1]), len(first))
    start = max(first.rfind("/", 0, alike), first.rfind("_", 0, alike)) + 1
    return [name[start:].replace("_", " ") for name in names]

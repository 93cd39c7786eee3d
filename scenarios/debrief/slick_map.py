"""The map of a debrief: slick, boom and vessels at each key moment, and the vessels' tracks."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar  # type: ignore[import-untyped]

from oilsim.core.physical_constants import KNOT
from recordings.model import palette
from recordings.model.entity_paths import BODIES, VESSELS, body_group
from recordings.model.exercise import BoomDescription, is_ground
from recordings.model.words import cause_in_words, course_in_words, three_figures
from recordings.pictures.chart import (
    draw_areas,
    draw_body,
    draw_equipment,
    draw_land,
    draw_map,
    draw_outline,
    draw_spots,
    draw_tracks,
    draw_windows,
    spread_names,
)
from recordings.replay.moments import Moment
from recordings.replay.recording import Replay
from scenarios.debrief.diagrams import empty_figure
from scenarios.debrief.key_moments import KeyMoment, bearing_of

_ACROSS = (0, 1)


def slick_map(replay: Replay, moments: Sequence[KeyMoment]) -> Figure:
    """Draw slick outlines and booms from above, coloured by time, and at the end the lost oil by cause.

    A run without booms is shown at its end, from the side if it is a flume or two-dimensional.
    """
    figure = empty_figure(5.2)
    axes = figure.subplots()
    if replay.run.exercise is None:
        draw_map(axes, replay, [key.moment for key in moments])
        return figure
    shades = mpl.colormaps["viridis_r"](np.linspace(0.15, 1.0, len(moments)))
    marks = [
        _draw_moment(axes, replay, key, mpl.colors.to_hex(shade), last=key is moments[-1])
        for key, shade in zip(moments, shades, strict=True)
    ]
    _draw_vessels(axes, replay, moments[0].moment, moments[-1].moment)
    draw_equipment(axes, moments[-1].moment)
    draw_land(axes, replay.run, moments[-1].moment)
    draw_areas(axes, replay.run)
    marks += [
        *_draw_lost(axes, moments[-1].moment, replay.run.particle_spacing),
        *draw_windows(axes, replay, moments[-1].time),
        Line2D([], [], color="#5c6b76", linestyle=(0, (4, 2)), label="tracks"),
    ]
    axes.legend(handles=marks, frameon=False, fontsize=9, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    _draw_north(axes, replay)
    _draw_scale(axes)
    axes.set_title("Outline of the slick, and line of the boom, at the key moments", loc="left")
    axes.set_axisbelow(True)
    axes.grid(color="#e3e8ec", linewidth=0.8)
    _draw_weather(axes, replay)
    spread_names(axes)
    return figure


def _draw_moment(axes: Axes, replay: Replay, key: KeyMoment, color: str, *, last: bool) -> Line2D:
    """Draw slick and booms at one moment, at the `last` with the names of several booms; return their mark for the legend."""
    run = replay.run
    for name, positions in key.moment.positions.items():
        if name in run.oils:
            draw_outline(axes, positions[:, :2], run.particle_spacing, "solid", color)
    for boom in run.booms:
        _draw_boom(axes, boom, key, color, named=last and len(run.booms) > 1)
    return Line2D([], [], color=color, linewidth=2.0, label=f"{key.number}: {key.time:.1f} s")


def _draw_vessels(axes: Axes, replay: Replay, first: Moment, last: Moment) -> None:
    """Draw the vessels at the beginning, faintly, and at the end, with their tracks; and all other bodies, such as a casualty."""
    for name, mesh in replay.run.meshes.items():
        if body_group(name) == BODIES and name in last.bodies and not is_ground(name):
            draw_body(axes, name, mesh, last.bodies[name], _ACROSS, 1.0)
        if body_group(name) == VESSELS and name in first.bodies and name in last.bodies:
            draw_body(axes, name, mesh, first.bodies[name], _ACROSS, 0.3)
            draw_body(axes, name, mesh, last.bodies[name], _ACROSS, 1.0)
    draw_tracks(axes, replay, _ACROSS)


def _draw_lost(axes: Axes, last: Moment, spacing: float) -> list[Line2D]:
    """Draw lost oil by its cause, particles of `spacing` [m] or parcels; return the marks for the legend."""
    marks = []
    for cause, positions in last.lost.items():
        if len(positions):
            color, label = palette.cause_color(cause), f"oil {cause_in_words(cause)}"
            draw_spots(axes, positions[:, :2], last.radius.get(cause, 0.5 * spacing), color)
            mark = Line2D([], [], marker="o", markersize=4.0, linestyle="", color=palette.css(color), label=label)
            mark.set(markeredgecolor="#444444", markeredgewidth=0.4)
            marks.append(mark)
    if marks and last.radius:
        marks.append(Line2D([], [], linestyle="", label=palette.spot_in_words()))
    return marks


def _draw_boom(axes: Axes, boom: BoomDescription, key: KeyMoment, color: str, *, named: bool) -> None:
    """Draw a boom's line, and its name if it is `named`."""
    places = [key.moment.bodies[name].position for name in boom.segments if name in key.moment.bodies]
    if places:
        line = np.array(places)
        axes.plot(line[:, 0], line[:, 1], color=color, linewidth=2.6, solid_capstyle="round", zorder=5)
        if named:
            x, y = line[len(line) // 2, :2]
            axes.annotate(boom.name, (x, y), (6.0, 6.0), textcoords="offset points", fontsize=9, color=color, zorder=7)


def _draw_weather(axes: Axes, replay: Replay) -> None:
    """Draw arrows along current and wind, with their speeds: a current by where it runs to, a wind by where it comes from."""
    exercise, bearing = replay.run.exercise, bearing_of(replay)
    if exercise is None:
        return
    for name, (x, y), turn, height, color in (
        ("current {} kn\ntowards {}°", exercise.current, 0.0, 0.08, "#1f5fa8"),
        ("wind {} kn\nfrom {}°", exercise.wind, np.pi, 0.34, "#5c6b76"),
    ):
        speed = float(np.hypot(x, y))
        if speed > 0.0:
            course = course_in_words(float(np.arctan2(y, x)) + turn, bearing)
            text = name.format(three_figures(speed / KNOT), course)
            _draw_arrow(axes, (1.12, height), np.array([x, y]) / speed, text, color)


def _draw_north(axes: Axes, replay: Replay) -> None:
    """Draw an arrow to the north."""
    bearing = bearing_of(replay)
    _draw_arrow(axes, (1.04, 0.27), np.array([np.cos(bearing), np.sin(bearing)]), "N", "#26323b")


def _draw_arrow(axes: Axes, middle: tuple[float, float], along: npt.NDArray[np.float64], text: str, color: str) -> None:
    """Draw an arrow beside the map about `middle`, in fractions of the map, with a text above."""
    ends = [tuple(np.array(middle) + sign * 0.05 * along) for sign in (-1.0, 1.0)]
    arrow = {"arrowstyle": "->", "color": color, "linewidth": 1.8}
    axes.annotate(
        "", ends[1], ends[0], xycoords="axes fraction", textcoords="axes fraction", arrowprops=arrow, annotation_clip=False
    )  # fmt: skip
    axes.text(middle[0], middle[1] + 0.07, text, transform=axes.transAxes, ha="center", fontsize=9, color=color)


def _draw_scale(axes: Axes) -> None:
    """Draw a bar of a round length, about a fifth of the map's width."""
    axes.apply_aspect()  # which widens the limits
    low, high = axes.get_xlim()
    exponent = np.floor(np.log10(0.2 * (high - low)))
    length = next(step * 10.0**exponent for step in (5.0, 2.0, 1.0) if step * 10.0**exponent <= 0.2 * (high - low))
    bar = AnchoredSizeBar(
        axes.transData, length, f"{length:g} m", "lower left", frameon=False, size_vertical=0.0, pad=0.6
    )
    axes.add_artist(bar)

"""The map of a debrief: slick, boom and vessels at each key moment, and the vessels' tracks."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.constants import knot

from recordings import palette
from recordings.entity_paths import VESSELS, body_group
from recordings.exercise import BoomDescription
from recordings.pictures.chart import draw_body, draw_map, draw_outline, draw_tracks
from recordings.replay.moments import Moment
from recordings.replay.recording import Replay
from scenarios.debrief.diagrams import empty_figure
from scenarios.debrief.key_moments import KeyMoment

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
        _draw_moment(axes, replay, key, mpl.colors.to_hex(shade)) for key, shade in zip(moments, shades, strict=True)
    ]
    _draw_vessels(axes, replay, moments[0].moment, moments[-1].moment)
    marks += [
        *_draw_lost(axes, moments[-1].moment),
        Line2D([], [], color="#5c6b76", linestyle=(0, (4, 2)), label="tracks"),
    ]
    axes.legend(handles=marks, frameon=False, fontsize=9, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title("Outline of the slick, and line of the boom, at the key moments", loc="left")
    axes.set_axisbelow(True)
    axes.grid(color="#e3e8ec", linewidth=0.8)
    _draw_current(axes, replay)
    return figure


def _draw_moment(axes: Axes, replay: Replay, key: KeyMoment, color: str) -> Line2D:
    """Draw slick and booms at one moment; return their mark for the legend."""
    run = replay.run
    for name, positions in key.moment.positions.items():
        if name in run.oils:
            draw_outline(axes, positions[:, :2], run.particle_spacing, "solid", color)
    for boom in run.exercise.booms if run.exercise else ():
        _draw_boom(axes, boom, key, color)
    return Line2D([], [], color=color, linewidth=2.0, label=f"{key.number}: {key.time:.1f} s")


def _draw_vessels(axes: Axes, replay: Replay, first: Moment, last: Moment) -> None:
    """Draw the vessels at the beginning, faintly, and at the end, with their tracks."""
    for name, mesh in replay.run.meshes.items():
        if body_group(name) == VESSELS and name in first.bodies and name in last.bodies:
            draw_body(axes, name, mesh, first.bodies[name], _ACROSS, 0.3)
            draw_body(axes, name, mesh, last.bodies[name], _ACROSS, 1.0)
    draw_tracks(axes, replay, _ACROSS)


def _draw_lost(axes: Axes, last: Moment) -> list[Line2D]:
    """Draw lost oil by its cause; return the marks for the legend."""
    marks = []
    for cause, positions in last.lost.items():
        if len(positions):
            x, y = positions[:, 0], positions[:, 1]
            label, tint = f"lost by {cause.replace('_', ' ')}", palette.css(palette.cause_color(cause))
            (line,) = axes.plot(x, y, "o", markersize=4.0, color=tint, label=label, zorder=8)
            line.set(markeredgecolor="#444444", markeredgewidth=0.4)
            marks.append(line)
    return marks


def _draw_boom(axes: Axes, boom: BoomDescription, key: KeyMoment, color: str) -> None:
    places = [key.moment.bodies[name].position for name in boom.segments if name in key.moment.bodies]
    if places:
        line = np.array(places)
        axes.plot(line[:, 0], line[:, 1], color=color, linewidth=2.6, solid_capstyle="round", zorder=5)


def _draw_current(axes: Axes, replay: Replay) -> None:
    """Draw an arrow in the direction of the current, with its speed."""
    current = np.array(replay.run.exercise.current if replay.run.exercise else (0.0, 0.0))
    speed = float(np.linalg.norm(current))
    if speed == 0.0:
        return
    along = current / speed
    middle = np.array([1.12, 0.08])
    ends = [tuple(middle + sign * 0.05 * along) for sign in (-1.0, 1.0)]
    arrow = {"arrowstyle": "->", "color": "#1f5fa8", "linewidth": 1.8}
    axes.annotate(
        "",
        ends[1],
        ends[0],
        xycoords="axes fraction",
        textcoords="axes fraction",
        arrowprops=arrow,
        annotation_clip=False,
    )
    axes.text(
        1.12, 0.11, f"current {speed / knot:.2g} kn", transform=axes.transAxes, ha="center", fontsize=9, color="#1f5fa8"
    )

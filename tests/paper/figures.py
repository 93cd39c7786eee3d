"""The four figures, drawn from the runs that were followed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from recordings.pictures.raster import Canvas, fitted_projection
from recordings.pictures.style import STYLE
from tests.paper.scenes import Track
from tests.paper.timing import Timing

OIL, SEA, ROCK = (38, 28, 24), (36, 110, 160), (150, 140, 126)  # colours
WIDTH = 460  # [pixels] of a rendered moment
CLEARNESS = 0.3  # [m] that light reaches in the water
EYES = {"calm-spread": (2.0, -2.2, 5.4), "wind-drift": (2.0, -3.4, 7.4), "rock-coating": (0.7, -1.0, 0.7)}  # [m]
QUALITY = 84
_SEAS = {"calm-spread": ((0.0, 0.0, 0.0), (4.0, 2.0, 0.4)), "wind-drift": ((0.0, -1.0, 0.0), (4.0, 3.0, 0.4))}  # [m]


def draw_spreading(tracks: Sequence[Track], picture: Path, title: str, curves: Sequence[tuple[str, str]]) -> None:
    """Draw one row of moments for each viscosity, the settings side by side, and below them curves over time (`Track` series, label)."""
    settings = list(dict.fromkeys(track.scene.setting.name for track in tracks))
    viscosities = sorted({track.scene.viscosity for track in tracks})
    moments = tracks[0].scene.moments
    columns = len(settings) * len(moments)
    row = 1.5 if tracks[0].scene.scenario == "calm-spread" else 2.1  # [inches]
    with mpl.rc_context(STYLE | {"font.size": 9.5}):
        figure = Figure(figsize=(2.6 * columns, row * len(viscosities) + 3.1), dpi=110)
        FigureCanvasAgg(figure)
        top, low = figure.add_gridspec(
            2,
            1,
            height_ratios=[row * len(viscosities), 1.9],
            left=0.045,
            right=0.99,
            top=0.9,
            bottom=0.075,
            hspace=0.14,
        )
        grid = top.subgridspec(len(viscosities), columns, wspace=0.03, hspace=0.14)
        for track in tracks:
            line = viscosities.index(track.scene.viscosity)
            first = settings.index(track.scene.setting.name) * len(moments)
            for column, moment in enumerate(moments):
                axes = figure.add_subplot(grid[line, first + column])
                _show(axes, track, moment)
                if line == 0 and column == 0:
                    axes.annotate(
                        track.scene.setting.name, (0, 1.2), xycoords="axes fraction", fontsize=12, weight="bold"
                    )
        below = low.subgridspec(1, len(curves), wspace=0.17)
        for place, (name, label) in enumerate(curves):
            axes = figure.add_subplot(below[place])
            _curves(axes, tracks, name, label)
        figure.legend(*axes.get_legend_handles_labels(), frameon=False, fontsize=8, ncols=6, loc="lower center")
        figure.suptitle(title, x=0.045, ha="left", y=0.985, fontsize=13, weight="bold")
        figure.savefig(picture, pil_kwargs={"quality": QUALITY})


def _show(axes: Axes, track: Track, moment: float) -> None:
    """Show one rendered moment."""
    axes.imshow(render(track, moment), interpolation="antialiased")
    axes.set_axis_off()
    axes.set_title(f"{track.scene.viscosity:g} Pa s, {moment:g} s", loc="left", fontsize=8.5, weight="normal", pad=2)


def _curves(axes: Axes, tracks: Sequence[Track], name: str, label: str) -> None:
    """Draw a measure of all runs over time: solid in the first setting, dashed in the second."""
    settings = list(dict.fromkeys(track.scene.setting.name for track in tracks))
    viscosities = sorted({track.scene.viscosity for track in tracks})
    for track in tracks:
        values = track.drift() if name == "drift" else track.series(name)
        dashed = settings.index(track.scene.setting.name) > 0
        axes.plot(
            track.times, values, color=f"C{viscosities.index(track.scene.viscosity)}", linestyle="--" if dashed else "-",
            label=f"{track.scene.viscosity:g} Pa s, {track.scene.setting.name}", linewidth=1.5,
        )  # fmt: skip
    axes.set_title(label, loc="left", fontsize=9.5)
    axes.grid(axis="y", color="#e3e8ec", linewidth=0.8)
    axes.set_xlabel("s")


def draw_rock(tracks: Sequence[Track], picture: Path, title: str) -> None:
    """Draw one row of moments a run, and beside it the oil that hangs on the rock."""
    moments = tracks[0].scene.moments
    with mpl.rc_context(STYLE | {"font.size": 9.5}):
        figure = Figure(figsize=(2.7 * len(moments) + 4.0, 2.35 * len(tracks) + 0.9), dpi=110)
        FigureCanvasAgg(figure)
        left, right = figure.add_gridspec(
            1, 2, width_ratios=[2.7 * len(moments), 3.4], left=0.01, right=0.985, top=1.0 - 0.75 / figure.get_figheight(),
            bottom=0.08, wspace=0.09,
        )  # fmt: skip
        grid = left.subgridspec(len(tracks), len(moments), wspace=0.03, hspace=0.18)
        for row, track in enumerate(tracks):
            for column, moment in enumerate(moments):
                axes = figure.add_subplot(grid[row, column])
                axes.imshow(render(track, moment), interpolation="antialiased")
                axes.set_axis_off()
                axes.set_title(f"{moment:g} s", loc="left", fontsize=8.5, weight="normal", pad=2)
                if column == 0:
                    place = {"x": 0.02, "y": 0.04, "transform": axes.transAxes, "fontsize": 8.0}
                    axes.text(
                        s=track.scene.setting.name, bbox={"facecolor": "white", "linewidth": 0.0, "pad": 1.5}, **place
                    )
        axes = figure.add_subplot(right)
        for number, track in enumerate(tracks):
            axes.plot(
                track.times,
                [100.0 * one.covered for one in track.coatings],
                color=f"C{number}",
                label=track.scene.setting.name,
            )
        axes.set_title("rock's surface above the pool under oil [%]", loc="left", fontsize=9.5)
        axes.set_xlabel("s")
        axes.axvline(tracks[0].pouring_end(), color="#8a96a0", linewidth=1.0, linestyle=":", label="the pipe ends")
        axes.set_ylim(0.0, 130.0)
        axes.set_yticks(range(0, 101, 20))
        axes.legend(frameon=False, fontsize=8, loc="upper left")
        figure.suptitle(title, x=0.01, ha="left", y=0.985, fontsize=13, weight="bold")
        figure.savefig(picture, pil_kwargs={"quality": QUALITY})


def draw_timing(timings: Sequence[Timing], picture: Path, title: str) -> None:
    """Draw the wall time of every step, one diagram for each viscosity."""
    viscosities = sorted({one.viscosity for one in timings})
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.2 * len(viscosities), 4.2), dpi=110, layout="constrained")
        FigureCanvasAgg(figure)
        for axes, viscosity in zip(figure.subplots(1, len(viscosities), sharey=True), viscosities, strict=True):
            for number, one in enumerate(each for each in timings if each.viscosity == viscosity):
                label = f"{one.name}: mean {np.mean(one.milliseconds):.0f} ms"
                axes.plot(one.milliseconds, color=f"C{number}", linewidth=1.0, label=label)
            axes.set_title(f"{viscosity:g} Pa s", loc="left")
            axes.set_xlabel("step")
            axes.set_ylim(bottom=0.0)
            axes.legend(frameon=False, fontsize=9)
            axes.set_ylabel("ms a step")
        figure.suptitle(title, x=0.01, ha="left", fontsize=13, weight="bold")
        figure.savefig(picture, pil_kwargs={"quality": QUALITY})


def render(track: Track, moment: float) -> NDArray[np.float64]:
    """Draw the oil of a moment as balls, under clear water, as seen from above one side."""
    particles = track.pictures[min(track.pictures, key=lambda at: abs(at - moment))]
    scene = track.scene.scenario
    if track.rock is not None:
        corners, height, target = track.rock[0], 0.8, (0.0, 0.0, 0.2)
    else:
        corners, height, target = _corners(*_SEAS[scene]), 0.5 if scene == "calm-spread" else 0.72, (2.0, 1.0, 0.2)
    high = int(WIDTH * height)
    canvas = Canvas(fitted_projection(np.array(EYES[scene]), np.array(target), corners, WIDTH, high), WIDTH, high)
    if track.rock is not None:
        canvas.triangles(*track.rock, (*ROCK, 255))
    canvas.spheres(particles["oil"], 0.6 * track.spacing, (*OIL, 255))
    if "ocean" in particles:
        canvas.water(particles["ocean"], track.spacing, (*SEA, 255), CLEARNESS)
    return canvas.image


def _corners(lower: tuple[float, float, float], upper: tuple[float, float, float]) -> NDArray[np.float64]:
    """Return the eight corners (8, 3) of a box."""
    return np.array(
        [[x, y, z] for x in (lower[0], upper[0]) for y in (lower[1], upper[1]) for z in (lower[2], upper[2])]
    )

"""Draw the chart of the exercise harbour-1km, an invented harbour: `python docs/harbour_chart.py` writes it beside the exercise's file.

It prints the fixed points that the file gives as `[site.chart] points`: where lines of latitude and longitude cross.
"""

from __future__ import annotations

import io
import sys
from itertools import pairwise
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from PIL import Image

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

from recordings.model.exercise import Site  # noqa: E402
from recordings.model.tangent_plane import longitude_latitude, world_points  # noqa: E402
from scenarios.spec.load import load_scenario  # noqa: E402

NAME = "harbour-1km"
WIDTH, HEIGHT, METRES = 1400, 1100, 1.8  # [px], [px], [m] a pixel
MIDDLE = (30.0, 0.0)  # (x, y) [m] of the world
COLORS = 48  # of the palette, which keeps the file small
LAND, EDGE, SHALLOW, INK, MAGENTA = "#f0dfae", "#6b5a2a", "#d3e6f5", "#2c2c2c", "#a3236f"
COAST = np.array(  # (x, y) [m] of the world, from north to south; the boom's ends are at y = 400 and -400, their anchors 30 m beyond
    [(1500, 1900), (1320, 1500), (1080, 1290), (930, 1060), (720, 940), (560, 770), (400, 690), (290, 580), (170, 520), (120, 476),
     (60, 462), (0, 452), (-70, 458), (-120, 442), (-150, 430), (-780, 430), (-820, 400), (-830, 120), (-880, 80), (-880, -90),
     (-830, -130), (-830, -390), (-790, -430), (-150, -430), (-110, -448), (-40, -456), (40, -452), (100, -470), (190, -560),
     (330, -610), (420, -740), (640, -820), (700, -990), (930, -1130), (1010, -1380), (1280, -1560), (1400, -1900)], float
)  # fmt: skip
BEHIND = np.array([(-2500, -1900), (-2500, 1900)], float)
WORDS = ((-400, 620, "OLD TOWN"), (-420, -640, "FISH DOCKS"), (-470, 0, "Berths"), (520, 0, "Outer road"))


def site() -> Site:
    """Return where the exercise lies."""
    found = load_scenario(NAME).scenario.site
    assert found is not None
    return found.recorded


def chart_points(where: Site, points: np.ndarray) -> np.ndarray:
    """Return the pixels (N, 2), right and down, of points (N, 2) [m] of the world."""
    turn = np.radians(where.bearing)
    x, y = (points - MIDDLE).T
    east, north = x * np.sin(turn) - y * np.cos(turn), x * np.cos(turn) + y * np.sin(turn)
    return np.stack([0.5 * WIDTH + east / METRES, 0.5 * HEIGHT - north / METRES], axis=-1)


def crossings(where: Site) -> tuple[np.ndarray, np.ndarray]:
    """Return the half minutes [degrees] of longitude and of latitude that the chart's frame holds."""
    corners = np.array([[column, row] for column in (70, WIDTH - 70) for row in (45, HEIGHT - 45)], float)
    turn = np.radians(where.bearing)
    east, north = (corners - (0.5 * WIDTH, 0.5 * HEIGHT)).T * METRES * np.array([[1.0], [-1.0]])
    world = (
        np.stack([east * np.sin(turn) + north * np.cos(turn), north * np.sin(turn) - east * np.cos(turn)], -1) + MIDDLE
    )
    found = [np.array([part.min(), part.max()]) * 120.0 for part in longitude_latitude(where, world)]
    longitude, latitude = (np.arange(np.ceil(low), np.floor(high) + 1) / 120.0 for low, high in found)
    return longitude, latitude


def in_minutes(degrees: float, names: str) -> str:
    """Write an angle as charts do: 57°39.5'N."""
    whole, minutes = divmod(round(abs(degrees) * 600.0) / 10.0, 60.0)
    return f"{whole:.0f}°{minutes:04.1f}'{names[int(degrees < 0.0)]}"


def draw_graticule(axes: Axes, where: Site) -> None:
    """Draw the lines of half minutes with their angles."""
    longitude, latitude = crossings(where)
    style = {"color": INK, "fontsize": 9, "family": "DejaVu Serif"}
    for degrees in longitude:
        column = chart_points(where, world_points(where, np.array([degrees]), np.array([where.latitude])))[0, 0]
        axes.plot((column, column), (4, HEIGHT - 32), color=INK, linewidth=0.45, zorder=3)
        axes.text(column, HEIGHT - 16, in_minutes(degrees, "EW"), ha="center", va="center", **style)
    for degrees in latitude:
        row = chart_points(where, world_points(where, np.array([where.longitude]), np.array([degrees])))[0, 1]
        axes.plot((32, WIDTH - 4), (row, row), color=INK, linewidth=0.45, zorder=3)
        axes.text(16, row, in_minutes(degrees, "NS"), ha="center", va="center", rotation=90, **style)


def draw_depths(axes: Axes, where: Site, depth: float) -> None:
    """Write the depth here and there on the water; the exercise has one depth everywhere."""
    rng = np.random.default_rng(4)
    grid = np.array([(x, y) for x in range(-760, 1500, 170) for y in range(-1100, 1200, 180)], float)
    grid += rng.uniform(-45.0, 45.0, grid.shape)
    water = mpl.path.Path(np.concatenate([COAST, BEHIND])).contains_points(grid, radius=0.0)
    near = np.linalg.norm(grid[:, None] - between(COAST), axis=-1).min(axis=1) < 95.0
    near |= (np.abs(grid[:, None] - [place[:2] for place in WORDS]) < (70.0, 110.0)).all(axis=-1).any(axis=1)
    for column, row in chart_points(where, grid[~water & ~near]):
        if 70 < column < WIDTH - 60 and 110 < row < HEIGHT - 110:
            axes.text(
                column,
                row,
                f"{depth:g}",
                color=INK,
                fontsize=8.5,
                ha="center",
                va="center",
                family="DejaVu Serif",
                style="italic",
            )


def between(line: np.ndarray) -> np.ndarray:
    """Return points (N, 2) [m] along a line, 100 to a side."""
    return np.concatenate([first + np.linspace(0, 1, 100)[:, None] * (last - first) for first, last in pairwise(line)])


def draw_marks(axes: Axes) -> None:
    """Draw title, warning, north arrow and scale bar."""
    serif = {"family": "DejaVu Serif", "color": INK, "ha": "center", "zorder": 6}
    box = {"facecolor": "white", "edgecolor": INK, "linewidth": 0.8, "boxstyle": "square,pad=0.6"}
    words = "HARBOUR MOUTH\nExercise chart, an invented place\nDepths in metres"
    axes.text(1180, 150, words, fontsize=12, va="center", linespacing=1.5, bbox=box, **serif)
    axes.text(0.5 * WIDTH, HEIGHT - 62, "NOT FOR NAVIGATION, exercise chart", fontsize=15, weight="bold", va="center",
              bbox=box, **{**serif, "color": MAGENTA})  # fmt: skip
    axes.annotate(
        "", (1320, 560), (1320, 680), arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.6}, zorder=6
    )
    axes.text(1320, 542, "N", fontsize=14, va="center", **serif)
    left, row, cable = 1000, 960, 185.2 / METRES
    for number in range(3):
        fill = INK if number % 2 == 0 else "white"
        axes.add_patch(
            mpl.patches.Rectangle((left + number * cable, row), cable, 7, facecolor=fill, edgecolor=INK, zorder=6)
        )
    for number in range(4):
        axes.text(left + number * cable, row - 12, f"{number}", fontsize=9, va="center", **serif)
    axes.text(left + 1.5 * cable, row + 20, "cables (185.2 m)", fontsize=9, va="center", **serif)


def draw(where: Site, depth: float) -> Figure:
    """Draw the chart."""
    figure = Figure(figsize=(WIDTH / 100.0, HEIGHT / 100.0), dpi=100, facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, WIDTH), ylim=(HEIGHT, 0))
    axes.axis("off")
    coast = chart_points(where, COAST)
    axes.plot(*coast.T, color=SHALLOW, linewidth=60, zorder=1, solid_joinstyle="round")
    axes.add_patch(
        mpl.patches.Polygon(
            chart_points(where, np.concatenate([COAST, BEHIND])),
            facecolor=LAND,
            edgecolor=EDGE,
            linewidth=1.6,
            zorder=2,
        )
    )
    frame = {"fill": False, "edgecolor": INK, "zorder": 5}
    axes.add_patch(mpl.patches.Rectangle((32, 4), WIDTH - 36, HEIGHT - 36, linewidth=1.6, **frame))
    axes.add_patch(mpl.patches.Rectangle((0, 0), 32, HEIGHT, facecolor="white", zorder=2.5))
    axes.add_patch(mpl.patches.Rectangle((0, HEIGHT - 32), WIDTH, 32, facecolor="white", zorder=2.5))
    draw_graticule(axes, where)
    draw_depths(axes, where, depth)
    for x, y, word in WORDS:
        column, row = chart_points(where, np.array([[x, y]], float))[0]
        text = axes.text(
            column, row, word, fontsize=12, ha="center", va="center", family="DejaVu Serif", color=INK, zorder=6
        )
        text.set_path_effects([withStroke(linewidth=3, foreground=LAND if word.isupper() else "white")])
    for end in ((100.0, 476.0), (80.0, -466.0)):
        axes.plot(*chart_points(where, np.array([end]))[0], marker="*", markersize=11, color=MAGENTA, zorder=6)
    draw_marks(axes)
    return figure


def main() -> None:
    """Write the chart, and print its fixed points."""
    where = site()
    depth = load_scenario(NAME).scenario.sea.depth
    assert depth is not None
    drawn = io.BytesIO()
    draw(where, depth).savefig(drawn, format="png")
    path = ROOT / "scenarios" / "library" / f"{NAME}.png"
    Image.open(drawn).convert("RGB").quantize(COLORS, dither=Image.Dither.NONE).save(path, optimize=True)
    print(path, f"{path.stat().st_size / 1e3:.0f} kB")
    longitude, latitude = crossings(where)
    for degrees in ((longitude[0], latitude[0]), (longitude[-1], latitude[-1]), (longitude[0], latitude[-1])):
        column, row = chart_points(where, world_points(where, *(np.array([part]) for part in degrees)))[0]
        print(f"  [{column:.1f}, {row:.1f}, {degrees[0]:.6f}, {degrees[1]:.6f}],")


if __name__ == "__main__":
    main()

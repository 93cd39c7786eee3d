"""The map of a run: the slick at the start and at the end, and the tracks of bodies, from above or from the side."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation
from matplotlib.transforms import Affine2D
from PIL import Image, ImageOps
from scipy.ndimage import gaussian_filter
from scipy.spatial import ConvexHull, KDTree, QhullError

from recordings.model import entity_paths, palette
from recordings.model.exercise import GROUND, ChartImage, is_ground
from recordings.model.frame import BodyFrame, Color, MeshDescription, RunDescription
from recordings.model.words import cause_in_words, three_figures
from recordings.pictures.style import EDGE, is_light
from recordings.replay.moments import Moment, placed_vertices
from recordings.replay.recording import Replay, Series

Points = npt.NDArray[np.floating]
_SAND, _SHOAL = "#efe4c6", "#c3dcea"  # dry land, and what lies under water
_FLAT = 0.2  # a scene is seen from the side if its width is less than this fraction of its length
_FEWEST = 10  # fewer particles than this get no outline
_OUTLINE_CELLS = 2.0  # cells of the outline's grid, in particle spacings
_USUAL = 0.9  # [1] of the parcels; the others are stragglers
_FAINT = 0.35
_DRAGGED = 0.5  # [m] from which a map shows that an anchor has dragged
_RIM = 0.3  # [points] of spots
_ROUNDING = 0.01  # [m] of the recorded points of a shore
_CHART_PIXELS = 1600  # of a chart's longer side; a debrief holds it
_NAME = "name of a vessel"  # mark of its text
WINDOW = "outline of a window of particles"  # mark of its patch
_APART = 2.0  # [pixels] between names
_ROUNDS = 50  # in which names are pushed apart, at most
_DISC = np.column_stack([wave(np.linspace(0.0, 2.0 * np.pi, 9)[:-1]) for wave in (np.cos, np.sin)])


def draw_map(axes: Axes, replay: Replay, moments: Sequence[Moment]) -> None:
    """Draw the last moment, with the slick outline of the first moment and all tracks."""
    first, last = moments[0], moments[-1]
    at_sea = replay.run.properties.get("boxes") in ("none", "windows")  # however long and narrow its slick is
    side = not at_sea and _seen_from_the_side(last)
    across = (0, 2) if side else (0, 1)
    run = replay.run
    for index, phase in enumerate(run.phases):
        color = palette.phase_color(phase, index)
        positions = last.positions.get(phase.name)
        if positions is None or not len(positions):
            continue
        if phase.is_oil:
            before = first.positions.get(phase.name, positions[:0])
            draw_outline(axes, before[:, across], run.particle_spacing, "dashed")
            draw_outline(axes, positions[:, across], run.particle_spacing, "solid")
        if phase.is_oil:
            draw_spots(axes, positions[:, across], last.radius.get(phase.name, 0.5 * run.particle_spacing), color)
        else:
            _draw_liquid(axes, positions[:, across], run.particle_spacing, color)
    for cause, positions in last.lost.items():
        radius = last.radius.get(cause, 0.5 * run.particle_spacing)
        draw_spots(axes, positions[:, across], radius, palette.cause_color(cause))
    for name, mesh in run.meshes.items():
        if is_ground(name):
            continue
        if name in first.bodies and _moves(first.bodies[name], last.bodies[name]):
            draw_body(axes, name, mesh, first.bodies[name], across, _FAINT)
        if name in last.bodies:
            draw_body(axes, name, mesh, last.bodies[name], across, 1.0)
    draw_tracks(axes, replay, across)
    draw_equipment(axes, last, across)
    if not side:
        draw_land(axes, run, last)
        draw_areas(axes, run)
    _draw_key(axes, run, last, draw_windows(axes, replay, last.time))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("z [m]" if side else "y [m]")
    view = "from the side" if side else "from above"
    axes.set_title(f"{view} at {last.time:.1f} s", loc="left", fontsize=10.5)
    if last.time > first.time and _has_past(run.oils, moments):
        past = f"dashed outline and faint bodies: {first.time:.1f} s"
        axes.set_title(past, loc="right", fontsize=9.0, color="#5c6b76", fontweight="normal")
    axes.set_axisbelow(True)
    axes.grid(color="#e3e8ec", linewidth=0.8)
    spread_names(axes)


def _draw_key(axes: Axes, run: RunDescription, last: Moment, windows: Sequence[Line2D]) -> None:
    """Say what the colours of oil, and the outlines of windows, mean, in a run that has lost oil or windows."""
    lost = [cause for cause, positions in last.lost.items() if len(positions)]
    if not lost and not windows and not last.radius:
        return
    shown = [
        (index, phase)
        for index, phase in enumerate(run.phases)
        if len(last.positions.get(phase.name, ())) and phase.is_oil
    ]
    tints = {f"{phase.name}, held or free": palette.phase_color(phase, index) for index, phase in shown}
    tints |= {f"oil {cause_in_words(cause)}": palette.cause_color(cause) for cause in lost}
    marks = [
        Line2D(
            [],
            [],
            color=tint,
            markeredgecolor=EDGE if is_light(tint) else tint,
            marker="o",
            markersize=5,
            linestyle="",
            label=label,
        )
        for label, tint in {label: palette.css(tint) for label, tint in tints.items()}.items()
    ]
    axes.legend(
        handles=[*marks, *windows], fontsize=8.5, loc="lower left", framealpha=0.85, edgecolor="none",
        title=palette.spot_in_words() if last.radius else None, title_fontsize=8.5, alignment="left",
    ).set_zorder(9)  # fmt: skip


def _has_past(oils: Sequence[str], moments: Sequence[Moment]) -> bool:
    """Tell whether the map shows something of the first moment: oil, or a body that has moved since."""
    first, last = moments[0], moments[-1]
    oil = any(name in oils and len(position) for name, position in first.positions.items())
    return oil or any(_moves(body, last.bodies[name]) for name, body in first.bodies.items())


def _seen_from_the_side(moment: Moment) -> bool:
    """Tell whether the map shows the scene from the side: a tank that is narrow, or nearly as deep as it is long."""
    parts = [position for position in moment.positions.values() if len(position)]
    if not parts:
        return False
    together = np.concatenate(parts)
    length, width, height = np.percentile(together, 99.5, axis=0) - np.percentile(together, 0.5, axis=0)
    return bool(width < _FLAT * length or height > 0.5 * max(length, width))


def _draw_liquid(axes: Axes, points: Points, spacing: float, color: Color) -> None:
    """Draw a fluid other than oil as a faint background."""
    tint = np.array(color[:3]) / 255.0
    amount, x_edges, y_edges = _density(points, 2.0 * spacing)
    full = np.percentile(amount[amount > 0.0], 90.0)
    image = np.empty((*amount.T.shape, 4))
    image[..., :3] = tint
    image[..., 3] = 0.55 * np.clip(amount.T / full, 0.0, 1.0)
    extent = (x_edges[0], x_edges[-1], y_edges[0], y_edges[-1])
    axes.imshow(image, origin="lower", extent=extent, interpolation="bilinear", zorder=1)


def draw_spots(axes: Axes, points: Points, radius: float | Points, color: Color) -> None:
    """Draw round spots (N, 2) [m] with one radius [m], or one each (N,), and a rim that is seen where they are small."""
    tint = np.array(color[:3]) / 255.0
    discs = points[:, None, :] + np.broadcast_to(radius, len(points))[:, None, None] * _DISC
    edge = EDGE if is_light(palette.css(color)) else tint
    axes.add_collection(
        PolyCollection([*discs], facecolors=[(*tint, 0.75)], edgecolors=edge, linewidths=_RIM, zorder=3)
    )


def draw_outline(axes: Axes, points: Points, spacing: float, style: str, color: str = "#5b3413") -> None:
    """Draw the outline of the oil (N, 2) [m]: the line at which half of the cells around hold oil.

    Cells are as wide as parcels lie apart, which may be farther than a particle's `spacing` [m].
    """
    if len(points) < _FEWEST:
        return
    amount, x_edges, y_edges = _density(points, _OUTLINE_CELLS * max(spacing, _apart(points)))
    smooth = gaussian_filter(np.minimum(amount, 1.0), 0.7)
    middle = (0.5 * (x_edges[1:] + x_edges[:-1]), 0.5 * (y_edges[1:] + y_edges[:-1]))
    axes.contour(*middle, smooth.T, levels=[0.5], colors=[color], linestyles=style, linewidths=1.1, zorder=4)


def _apart(points: Points) -> float:
    """Return the distance [m] to the nearest other point (N, 2) [m] that all but a tenth of them do not exceed."""
    return float(np.quantile(KDTree(points).query(points, k=2)[0][:, 1], _USUAL))


def _density(points: Points, cell: float) -> tuple[Points, Points, Points]:
    """Count the particles in each cell of a grid, which has a rim of empty cells for outlines."""
    lower, upper = points.min(axis=0) - 3.0 * cell, points.max(axis=0) + 3.0 * cell
    counts = np.clip(np.ceil((upper - lower) / cell).astype(int), 4, 600)
    box = np.column_stack([lower, upper])
    amount, x_edges, y_edges = np.histogram2d(points[:, 0], points[:, 1], bins=tuple(counts), range=box)
    return amount, x_edges, y_edges


def draw_body(
    axes: Axes, name: str, mesh: MeshDescription, body: BodyFrame, across: tuple[int, int], opacity: float
) -> None:
    """Draw a body's outline along the map's viewing direction: the convex hull of its vertices."""
    points = placed_vertices(mesh.vertices, body)[:, across]
    try:
        outline = points[ConvexHull(points).vertices]
    except QhullError:
        return
    tint = np.array(palette.body_color(name, mesh)[:3]) / 255.0
    face, edge = (*tint, 0.85 * opacity), (*(0.6 * tint), opacity)
    axes.add_patch(Polygon(outline, facecolor=face, edgecolor=edge, linewidth=0.8, zorder=5))
    if opacity == 1.0 and entity_paths.body_group(name) == entity_paths.VESSELS:
        label = name.partition("/")[2]
        place = (float(body.position[across[0]]), float(body.position[across[1]]))
        text = axes.annotate(label, place, (0.0, 0.0), textcoords="offset points", color="white", fontsize=9.5)
        text.set(fontweight="bold", ha="center", va="center", zorder=7, gid=_NAME)
        text.set_path_effects([withStroke(linewidth=2.2, foreground=tuple(0.45 * tint))])


def draw_land(axes: Axes, run: RunDescription, moment: Moment) -> None:
    """Draw the site's chart, what of a shore is dry in still water, land and shoals, without framing what is larger than the scene."""
    chart = None if run.site is None else run.site.chart
    if chart is not None:
        _draw_chart(axes, chart)
    faint: dict[str, Any] = {"alpha": 1.0 if chart is None else 0.3, "zorder": 0.5}
    for name in filter(is_ground, run.meshes.keys() & moment.bodies.keys()):
        points = placed_vertices(run.meshes[name].vertices, moment.bodies[name])
        level = run.exercise.water_level if run.exercise is not None else points[:, 2].max()
        dry = points[:, 2] >= level - _ROUNDING
        if name == GROUND and dry.sum() > 2:
            corners = points[dry, :2]
            axes.add_artist(
                Polygon(corners[ConvexHull(corners).vertices], facecolor=_SAND, edgecolor="#a58f5b", gid=name, **faint)
            )
        elif name != GROUND:
            corners = points[np.asarray(run.meshes[name].faces)]
            floor = points[:, 2].min() + _ROUNDING
            tops = corners[(np.ptp(corners[..., 2], axis=1) < _ROUNDING) & (corners[..., 2].min(axis=1) > floor)]
            tops = tops[np.argsort(tops[:, 0, 2])]  # the deepest of all before the others
            tints = [_SAND if top[0, 2] >= level - _ROUNDING else _SHOAL for top in tops]
            axes.add_artist(PolyCollection(list(tops[..., :2]), facecolor=tints, edgecolor="face", gid=name, **faint))


def _draw_chart(axes: Axes, chart: ChartImage) -> None:
    """Draw the image of a chart in its place, under all else and somewhat faint."""
    with Image.open(io.BytesIO(base64.b64decode(chart.image.partition(",")[2]))) as file:
        image = ImageOps.exif_transpose(file).convert("RGBA")
    width, height = image.size
    image.thumbnail((_CHART_PIXELS, _CHART_PIXELS))
    drawn = AxesImage(
        axes, extent=(0.0, width, height, 0.0), origin="upper", interpolation="none", alpha=0.8, zorder=0.3
    )
    drawn.set_data(np.asarray(image))
    (x, y), (east, north) = chart.origin, chart.along
    drawn.set_transform(Affine2D.from_values(east, north, north, -east, x, y) + axes.transData)
    axes.add_artist(drawn)


def draw_areas(axes: Axes, run: RunDescription) -> None:
    """Draw sensitive areas with their names, without framing them: they may lie far from the booms."""
    areas = run.exercise.areas if run.exercise is not None else {}
    for name, outlines in areas.items():
        for outline in outlines:
            axes.add_artist(
                Polygon(outline, facecolor="#17734a1f", edgecolor="#17734a", linewidth=1.2, zorder=0.6, gid=name)
            )
        x, y = np.mean(outlines[0], axis=0)
        note = axes.annotate(name, (x, y), color="#17734a", fontsize=8, ha="center", va="center", annotation_clip=True)
        note.set(zorder=7, path_effects=[withStroke(linewidth=2.2, foreground="white")], clip_on=True)


def draw_equipment(axes: Axes, moment: Moment, across: tuple[int, int] = (0, 1)) -> None:
    """Draw skimmers as rings, and mooring legs and ties as lines, with the names of skimmers and anchors, and the ways these dragged."""
    tint = palette.css(palette.EQUIPMENT)
    for one, strip in moment.equipment:
        axes.plot(*strip[:, across].T, color=tint, linewidth=1.5, zorder=6, gid=one.name)
        name = one.name
        if one.kind == "mooring":
            axes.plot(*strip[-1:, across].T, marker="$\\perp$", markersize=9, color=tint, zorder=6)
            way = np.array([one.ends[-1][1][:2], strip[-1, :2]])
            if (dragged := float(np.linalg.norm(way[1] - way[0]))) > _DRAGGED and across == (0, 1):
                axes.plot(*way.T, color=tint, linestyle=":", linewidth=1.5, zorder=6)
                name = f"{name}, dragged {three_figures(dragged)} m"
        if one.kind != "tie":
            x, y = strip[-1, across]
            note = axes.annotate(name, (x, y), (5.0, 5.0), textcoords="offset points", fontsize=8, color=tint)
            note.set(zorder=7, path_effects=[withStroke(linewidth=2.2, foreground="white")])


def draw_windows(axes: Axes, replay: Replay, time: float) -> list[Line2D]:
    """Draw the outline of each window of particles as it lay last at `time` [s]; return the mark for a legend, none without windows."""
    marks, tint = list[Line2D](), palette.css(palette.WINDOW)
    for window in replay.run.windows:
        series = [replay.scalars.get(name) for name in window.middle_series]
        x, y = (_last_value(one, time) for one in series)
        if x is None or y is None:
            continue
        corner = (x - 0.5 * window.size[0], y - 0.5 * window.size[1])
        outline = Rectangle(corner, *window.size, fill=False, edgecolor=tint, linewidth=1.4, zorder=4, gid=WINDOW)
        axes.add_patch(outline)
        label = "window" if len(replay.run.windows) == 1 else f"{window.name} window"
        text = f"{label}: particles {1000.0 * window.spacing:.3g} mm apart"
        marks.append(
            Line2D(
                [], [], color=tint, linewidth=1.4, marker="s", markersize=9, fillstyle="none", linestyle="", label=text
            )
        )
    return marks


def _last_value(series: Series | None, time: float) -> float | None:
    """Return the last value of a series up to `time` [s]; None without one."""
    row = -1 if series is None else int(np.searchsorted(series.time, time + 1e-9)) - 1
    return None if series is None or row < 0 else float(series.value[row])


def spread_names(axes: Axes) -> None:
    """Push names of vessels apart that would lie on each other; to be called once everything is drawn."""
    axes.apply_aspect()
    names = [text for text in axes.texts if isinstance(text, Annotation) and text.get_gid() == _NAME]
    places = [axes.transData.transform(text.xy) for text in names]
    sizes = [np.array(text.get_window_extent().size) + _APART for text in names]
    shift = np.zeros((len(names), 2))  # [pixels]
    for _ in range(_ROUNDS):
        pushed = False
        for one, other in combinations(range(len(names)), 2):
            way = places[other] + shift[other] - places[one] - shift[one]
            overlap = 0.5 * (sizes[one] + sizes[other]) - np.abs(way)
            if (overlap > 0.0).all():
                axis, pushed = int(np.argmin(overlap)), True
                push = 0.5 * (overlap[axis] + 1.0) * (1.0 if way[axis] >= 0.0 else -1.0)
                shift[one, axis] -= push
                shift[other, axis] += push
        if not pushed:
            break
    figure = axes.get_figure(root=True)
    points = 72.0 / (72.0 if figure is None else figure.dpi)  # of a pixel
    for text, (right, up) in zip(names, points * shift, strict=True):
        text.xyann = (right, up)


def draw_tracks(axes: Axes, replay: Replay, across: tuple[int, int]) -> None:
    """Draw the tracks of everything that moved; of a boom, only that of its middle."""
    groups: dict[str, list[str]] = {}
    for name in replay.bodies:
        groups.setdefault(entity_paths.body_group(name), []).append(name)
    boom = sorted(groups.get(entity_paths.BOOM, []))
    kept = [*groups.get(entity_paths.VESSELS, []), *groups.get(entity_paths.BODIES, [])]
    kept += boom[len(boom) // 2 : len(boom) // 2 + 1]
    for name in kept:
        series = replay.bodies[name]
        tint = np.array(palette.body_color(name, replay.run.meshes.get(name))[:3]) / 255.0
        axes.plot(*series.pose[:, across].T, color=0.8 * tint, linewidth=1.1, linestyle=(0, (4, 2)), zorder=6)


def _moves(before: BodyFrame, after: BodyFrame) -> bool:
    """Tell whether a body has moved."""
    return bool(np.linalg.norm(after.position - before.position) > 1e-3)

"""Draw the rooms of the six packages and the arrows between them, from the imports: ``python docs/architecture.py``.

Writes ``docs/architecture.svg``. A room is a folder of a package; a single module beside the folders is drawn as a small box. An
arrow means "imports". Arrows that follow from others are left out (transitive reduction), so that every import is a path downward.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path as FilePath

import grimp
import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch, Rectangle
from matplotlib.path import Path
from scipy.optimize import isotonic_regression

PICTURE = FilePath(__file__).with_name("architecture.svg")
FLOORS = (("scenarios",), ("booms", "vessels"), ("coupling",), ("oilsim", "recordings"))
SHARES = {"oilsim": 0.6, "recordings": 0.4, "booms": 0.6, "vessels": 0.4}  # of a floor's width
SAYS = {
    "scenarios": "a scenario file becomes a run; the oilsim command",
    "booms": "sections, deployment, containment scores",
    "vessels": "hulls, helmsmen",
    "coupling": "the co-simulation master, pybullet bodies, FMUs, the plugin",
    "oilsim": "the fluid core: numpy and numba only",
    "recordings": "what is recorded, replayed and exported",
}
HUES = {
    "scenarios": "#7a5195", "booms": "#b5651d", "vessels": "#8a6d1f", "coupling": "#2f6f4f", "oilsim": "#1f5f8b",
    "recordings": "#8b2f4f",
}  # fmt: skip
WIDTH, ROW, HEAD, GAP, MARGIN = 13.0, 0.52, 0.42, 0.34, 0.25  # [inch]
LANE = 0.3  # [inch] width of an arrow that passes a row
PADDING = 0.3  # [inch] beside a room, where its row has the place
SWEEPS = 60  # over the rows; the first half may change their order

Edges = dict[str, set[str]]
Item = str | tuple[str, str, int]  # a room, or the arrow (from, to) as it passes a row


@dataclass(frozen=True)
class Package:
    """Rooms by row, the lowest first, and the arrows to be drawn."""

    name: str
    rows: dict[str, int]
    arrows: Edges
    folders: frozenset[str]


def read_packages() -> tuple[dict[str, Package], set[tuple[str, str]]]:
    """The six packages, and the arrows between them that do not follow from others."""
    names = [name for floor in FLOORS for name in floor]
    graph = grimp.build_graph(*names)
    inside: dict[str, Edges] = {name: {} for name in names}
    folders: dict[str, set[str]] = {name: set() for name in names}
    between: Edges = {name: set() for name in names}
    for module in sorted(graph.modules):
        package, *rest = module.split(".")
        if not rest:
            continue
        inside[package].setdefault(rest[0], set())
        if rest[1:]:
            folders[package].add(rest[0])
        for target in graph.find_modules_directly_imported_by(module):
            other, *place = target.split(".")
            if other != package:
                between[package].add(other)
            elif place and place[0] != rest[0]:
                inside[package][rest[0]].add(place[0])
    found = {
        name: Package(name, rows_of(edges), reduced(edges), frozenset(folders[name])) for name, edges in inside.items()
    }
    return found, {(name, other) for name, others in reduced(between).items() for other in others}


def reachable(edges: Edges, start: str) -> set[str]:
    """Everything below `start`."""
    return set().union(*({end} | reachable(edges, end) for end in edges.get(start, ())))


def reduced(edges: Edges) -> Edges:
    """The arrows that do not follow from two or more others."""
    return {
        start: {end for end in ends if not any(end in reachable(edges, other) for other in ends - {end})}
        for start, ends in edges.items()
    }


def rows_of(edges: Edges) -> dict[str, int]:
    """Row of each room, 0 the lowest: one above the highest that it imports, then as near below whoever imports it as can be."""

    def height(room: str) -> int:
        return 1 + max((height(end) for end in edges.get(room, ())), default=-1)

    rows: dict[str, int] = {}
    for room in sorted(edges, key=lambda one: (-height(one), one)):
        above = [rows[start] for start, ends in edges.items() if room in ends]
        rows[room] = min(above, default=height(room) + 1) - 1
    return rows


def placed(package: Package, left: float, width: float) -> dict[Item, float]:
    """Middle of each room and of each passing arrow [inch], so that arrows cross seldom and run straight (Sugiyama et al. 1981)."""
    rows: list[list[Item]] = [[] for _ in range(1 + max(package.rows.values()))]
    neighbours: dict[Item, list[Item]] = {}
    for room, row in sorted(package.rows.items()):
        rows[row].append(room)
    for start, end in arrows_of(package):
        way = way_of(package, start, end)
        for item in way[1:-1]:
            rows[item[2]].append(item)  # type: ignore[index]
        for one, other in itertools.pairwise(way):
            neighbours.setdefault(one, []).append(other)
            neighbours.setdefault(other, []).append(one)
    middle = {item: left + width * (n + 0.5) / len(row) for row in rows for n, item in enumerate(row)}
    for sweep in range(SWEEPS):
        for row in rows if sweep % 2 == 0 else rows[::-1]:
            wanted = {
                item: mean([middle[other] for other in neighbours.get(item, ())], left + 0.5 * width) for item in row
            }
            if sweep < SWEEPS // 2:
                row.sort(key=wanted.__getitem__)
            middle |= spread(row, wanted, left, width)
    shift = left + 0.5 * width - 0.5 * (min(middle.values()) + max(middle.values()))
    return {item: x + shift for item, x in middle.items()}


def spread(row: list[Item], wanted: dict[Item, float], left: float, width: float) -> dict[Item, float]:
    """Place the items of a row in their order, as near to where they are wanted as their widths and the band allow."""
    taken = np.array([half_width(item) for item in row])
    gap = (width - 2.0 * float(taken.sum())) / len(row)
    half = taken + min(0.5 * gap, PADDING)
    offset = np.concatenate([[0.0], np.cumsum(half[:-1] + half[1:])])
    first = isotonic_regression([wanted[item] for item in row] - offset).x
    places = offset + np.clip(first, left + half[0], max(left + half[0], left + width - half[-1] - offset[-1]))
    return dict(zip(row, places.tolist(), strict=True))


def half_width(item: Item) -> float:
    """Half of the width that an item takes in its row [inch]."""
    return 0.5 * LANE if isinstance(item, tuple) else 0.048 * len(item) + 0.18


def mean(values: Iterable[float], default: float) -> float:
    """Mean of the values; `default` if there are none."""
    listed = list(values)
    return sum(listed) / len(listed) if listed else default


def arrows_of(package: Package) -> list[tuple[str, str]]:
    """All arrows that are drawn, in a fixed order."""
    return sorted((start, end) for start, ends in package.arrows.items() for end in ends)


def way_of(package: Package, start: str, end: str) -> list[Item]:
    """The items through which an arrow goes, from above."""
    return [start, *((start, end, row) for row in range(package.rows[start] - 1, package.rows[end], -1)), end]


def draw_package(axes: Axes, package: Package, left: float, bottom: float, width: float, height: float) -> None:
    """The package's band with its rooms and arrows."""
    hue = HUES[package.name]
    axes.add_patch(
        FancyBboxPatch(
            (left, bottom), width, height, boxstyle="round,pad=0,rounding_size=0.12", facecolor=hue, alpha=0.10, linewidth=0
        )
    )  # fmt: skip
    axes.text(left + 0.18, bottom + height - 0.29, f"{package.name}/", color=hue, weight="bold", size=13)
    axes.text(
        left + 0.45 + 0.118 * len(package.name), bottom + height - 0.28, SAYS[package.name], color="#555555", size=9.5
    )
    place: dict[Item, tuple[float, float]] = {}
    for item, x in placed(package, left + 0.1, width - 0.2).items():
        row = item[2] if isinstance(item, tuple) else package.rows[item]
        place[item] = x, bottom + 0.30 + ROW * row
    for room in package.rows:
        draw_room(axes, package, room, place[room])
    for start, end in arrows_of(package):
        draw_arrow(axes, [place[item] for item in way_of(package, start, end)], hue, f"{package.name}.{start}>{end}")


def draw_room(axes: Axes, package: Package, room: str, at: tuple[float, float]) -> None:
    """A folder as a filled box, a module as a small outlined one."""
    hue, folder = HUES[package.name], room in package.folders
    size = 10.5 if folder else 8.5
    half = (0.048 if folder else 0.04) * len(room) + (0.13 if folder else 0.09), 0.155 if folder else 0.125
    axes.add_patch(
        FancyBboxPatch(
            (at[0] - half[0], at[1] - half[1]), 2 * half[0], 2 * half[1], boxstyle="round,pad=0,rounding_size=0.06",
            facecolor=hue if folder else "white", edgecolor=hue, linewidth=0.8, zorder=3, gid=f"{package.name}.{room}",
        )
    )  # fmt: skip
    axes.text(*at, room, ha="center", va="center_baseline", size=size, color="white" if folder else hue, zorder=4)


def draw_arrow(axes: Axes, way: list[tuple[float, float]], hue: str, name: str) -> None:
    """A smooth line down through the places of `way`, with a head at its end."""
    points = [(way[0][0], way[0][1] - 0.14), *way[1:-1], (way[-1][0], way[-1][1] + 0.15)]
    vertices, codes = [points[0]], [Path.MOVETO]
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        bend = 0.5 * (y0 - y1)
        vertices += [(x0, y0 - bend), (x1, y1 + bend), (x1, y1)]
        codes += [Path.CURVE4] * 3
    axes.add_patch(
        FancyArrowPatch(
            path=Path(vertices, codes), arrowstyle="-|>,head_length=3.5,head_width=1.6", color=hue, linewidth=0.8, alpha=0.6,
            zorder=2, gid=name,
        )
    )  # fmt: skip


def draw() -> Figure:
    """The whole picture."""
    packages, between = read_packages()
    heights = [max(ROW * (1 + max(packages[name].rows.values())) for name in floor) + HEAD + 0.12 for floor in FLOORS]
    total = sum(heights) + GAP * (len(FLOORS) - 1) + 2 * MARGIN
    figure = Figure(figsize=(WIDTH, total), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, WIDTH), ylim=(0.0, total))
    axes.axis("off")
    axes.add_patch(Rectangle((0.0, 0.0), WIDTH, total, color="white", zorder=-1))
    top, bands = total - MARGIN, {}
    for floor, height in zip(FLOORS, heights, strict=True):
        left = MARGIN
        for name in floor:
            width = SHARES.get(name, 1.0) * (WIDTH - 2 * MARGIN - 0.2 * (len(floor) - 1))
            bands[name] = (left, top - height, width, height)
            draw_package(axes, packages[name], *bands[name])
            left += width + 0.2
        top -= height + GAP
    for start, end in sorted(between):
        draw_fall(axes, bands[start], bands[end], f"{start}>{end}")
    return figure


def draw_fall(axes: Axes, above: tuple[float, ...], below: tuple[float, ...], name: str) -> None:
    """A broad arrow from a package to one on the floor below, where both lie under each other."""
    left, right = max(above[0], below[0]), min(above[0] + above[2], below[0] + below[2])
    x, y0, y1 = 0.5 * (left + right), above[1], below[1] + below[3]
    axes.add_patch(
        FancyArrowPatch(
            (x, y0 + 0.02), (x, y1 - 0.02), arrowstyle="simple,head_length=9,head_width=22,tail_width=10", shrinkA=0, shrinkB=0,
            color="#9aa5b1", linewidth=0, zorder=5, gid=name,
        )
    )  # fmt: skip


if __name__ == "__main__":
    with mpl.rc_context({"svg.hashsalt": "oilsim", "font.family": "DejaVu Sans"}):
        draw().savefig(PICTURE, metadata={"Date": None})
    print(f"wrote {PICTURE}")

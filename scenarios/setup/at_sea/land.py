"""Land and shoals of a school's own harbour: their outlines from corners or GeoJSON, the stream along them, and what vessels run on."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from booms.deployment import PlacedBody
from coupling.participants.plan_barriers import SIDE
from coupling.solids.bodies import mass_properties
from oilsim.sea.stream import Stream
from oilsim.slick.barriers import Outline
from recordings.model.exercise import LAND
from recordings.model.tangent_plane import world_points
from scenarios.schema.run_settings import SiteSettings
from scenarios.schema.sea import AreaSettings, LandSettings
from scenarios.setup.solids.placed_solids import HELD_DENSITY, Solid
from scenarios.text.problems import Problem, reason_of

Double = NDArray[np.float64]
Corners = tuple[tuple[float, float], ...]
Polygon = tuple[Corners, float]  # corners (x, y) [m], and the still water [m] over what is within them; 0: land

# cells of the stream's grid along its longer side; numerical; a circular island's stream is within 2 % with them
CELLS = 240
# parts of a cell along each axis in which land is looked for; numerical; thinner walls would leak
PARTS = 4
# widths of all land that the grid reaches beyond it; numerical
BEYOND = 1.0
# [1] pull on psi to 0, of which water that land encloses has nothing else; numerical
ENCLOSED = 1e-10
# properties of a feature that tell the water [m] over it: the plain word, and that of depth areas of electronic charts (S-57, DEPARE)
DEPTHS = ("depth", "DRVAL1")
# [m] of land from the origin; numerical; the tangent plane is some metres wrong there
FARTHEST = 20e3
# [m2] of land; numerical; a bollard's
SMALLEST = 0.1
# [m] that land rises above the still water in pictures, and where hulls meet it
RISE = 3.0
# red, green, blue, opacity of land in pictures
GRASS = (158, 170, 122, 255)


@dataclass(frozen=True)
class Land:
    """Land and shoals in plan: polygons without their first corner again at the end; capacity [m3/m] of oil along dry land."""

    polygons: tuple[Polygon, ...]
    capacity: float

    @property
    def outlines(self) -> tuple[Corners, ...]:
        """The outlines of what is dry."""
        return tuple(corners for corners, depth in self.polygons if depth == 0.0)

    def barriers(self, name: str) -> list[Outline]:
        """Return the outlines to which oil sticks, in sides of a few metres, each with its own room."""
        return [
            Outline(name=f"{LAND}{name}/{number}", nodes=_divided(outline), capacity=self.capacity, carries=False)
            for number, outline in enumerate(self.outlines, 1)
        ]

    def solid(self, name: str, level: float, depth: float) -> Solid:
        """Return land and shoals as a fixed body with steep sides on the sea's floor, under water of `depth` and a `level` [m]."""
        from manifold3d import CrossSection, FillRule, Manifold

        by_height: dict[float, list[Double]] = {}
        for corners, water in self.polygons:
            ring = np.array(corners)[:: 1 if _area(corners) > 0.0 else -1]  # what overlaps is land all the same
            by_height.setdefault(depth - water if water else depth + RISE, []).append(ring)
        parts = [CrossSection(rings, FillRule.Positive).extrude(height) for height, rings in by_height.items()]
        built = sum(parts, Manifold()).to_mesh()
        mesh = trimesh.Trimesh(np.asarray(built.vert_properties)[:, :3], np.asarray(built.tri_verts))
        middle = mesh.center_mass
        mesh.apply_translation(-middle)
        placed = PlacedBody(
            name=f"{LAND}{name}",
            mesh=mesh,
            mass_properties=mass_properties(mesh, density=HELD_DENSITY),
            position=middle + np.array([0.0, 0.0, level - depth]),
            orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        )
        return Solid(placed=placed, motion="fixed", contact=True, wetted=False, color=GRASS)


def polygons_of(land: Mapping[str, Land]) -> tuple[Polygon, ...]:
    """Return the polygons of all land and shoals."""
    return tuple(chain.from_iterable(one.polygons for one in land.values()))


def _divided(outline: Corners) -> Double:
    """Return the corners (S, 2) [m] of an outline with sides of at most `SIDE`."""
    corners = np.array(outline)
    ways = np.roll(corners, -1, axis=0) - corners
    parts = np.maximum(np.ceil(np.hypot(*ways.T) / SIDE).astype(int), 1)
    return np.concatenate(
        [
            start + np.arange(count)[:, None] / count * way
            for start, way, count in zip(corners, ways, parts, strict=True)
        ]
    )


def read_land(
    settings: Mapping[str, LandSettings], site: SiteSettings | None, depth: float, problems: list[Problem]
) -> dict[str, Land]:
    """Return land and shoals by name; what is wrong with an outline or a file is added to `problems`.

    depth [m] of the sea: polygons of a file that lie as deep are the sea itself, and left out.
    """
    found = {}
    for name, polygons in read_polygons("land", settings, site, problems).items():
        own = settings[name].depth
        with_depths = [(corners, own if water is None else max(water, 0.0)) for corners, water in polygons]
        shallow = tuple(one for one in with_depths if one[1] < depth)
        if not shallow:
            key, least = ("file", min(water for _, water in with_depths)) if settings[name].file else ("depth", own)
            problems.append(
                Problem(f"land.{name}.{key}", f"is {least:g} m of water, allowed: less than the sea's {depth:g} m")
            )
        found[name] = Land(shallow, settings[name].capacity)
    return found


def read_polygons(
    table: str, settings: Mapping[str, AreaSettings], site: SiteSettings | None, problems: list[Problem]
) -> dict[str, list[tuple[Corners, float | None]]]:
    """Return the corners [m] of each entry of a table, and the water [m] over them where a file tells it.

    What is wrong with an entry or with a file is added to `problems`.
    """
    found = {}
    for name, one in settings.items():
        key, file = ("outline", "") if one.outline else ("file", f"{Path(one.file).name}: ")
        try:
            given: Iterable[tuple[Corners, float | None]] = [(one.outline, None)]
            polygons = list(given if one.outline else _polygons(Path(one.file), site))
            for number, (outline, _) in enumerate(polygons, 1):
                _require_land(f"polygon {number} " if file else "", outline)
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            problems.append(Problem(f"{table}.{name}.{key}", f"{file}{reason_of(error)}"))
            continue
        found[name] = polygons
    return found


def _area(outline: Corners) -> float:
    """Compute the area [m2] within an outline, positive if it runs counter-clockwise."""
    x, y = np.array(outline).T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def _require_land(what: str, outline: Corners) -> None:
    """Raise ValueError, whose text begins with `what`, for an outline that is too far away, or encloses hardly anything."""
    farthest, area = np.abs(outline).max(), abs(_area(outline))
    if farthest > FARTHEST:
        raise ValueError(f"{what}reaches {farthest / 1e3:.4g} km from the origin, allowed: up to {FARTHEST / 1e3:g} km")
    if area < SMALLEST:
        raise ValueError(f"{what}encloses {area:.3g} m2, allowed: {SMALLEST:g} m2 or more")


def _polygons(file: Path, site: SiteSettings | None) -> Iterator[tuple[Corners, float | None]]:
    """Yield the outer rings [m] of the polygons of a GeoJSON file (RFC 7946), and their depths [m] where it tells them.

    Raises ValueError for a file without any, or with other numbers.
    """
    assert site is not None  # the checks between tables ask for it
    rings = list(_rings(json.loads(file.read_text(encoding="utf-8")), None))
    if not rings:
        raise ValueError("holds no Polygon or MultiPolygon, allowed: GeoJSON with one or more")
    for number, (ring, depth) in enumerate(rings, 1):
        degrees = np.array([corner[:2] for corner in ring], np.float64)
        if (
            degrees.ndim != 2
            or len(degrees) < 4
            or not np.isfinite(degrees).all()
            or (np.abs(degrees) > (360.0, 90.0)).any()
        ):
            raise ValueError(f"polygon {number} is no ring of 4 or more positions [longitude, latitude] in degrees")
        if not (depth is None or (isinstance(depth, int | float) and np.isfinite(depth))):
            raise ValueError(f"polygon {number} has the depth {depth!r}, allowed: a number of metres")
        yield tuple(map(tuple, world_points(site.recorded, degrees[:-1, 0], degrees[:-1, 1]).tolist())), depth


def _rings(data: Mapping[str, Any], depth: Any) -> Iterator[tuple[Sequence[Any], Any]]:
    """Yield the outer rings of a GeoJSON object, and the depth of their feature; holes, which are lakes, are land here."""
    kind = data.get("type")
    if kind == "Polygon":
        yield data["coordinates"][0], depth
    elif kind == "MultiPolygon":
        yield from ((polygon[0], depth) for polygon in data["coordinates"])
    elif kind == "Feature":
        properties = data.get("properties") or {}
        own = next((properties[key] for key in DEPTHS if properties.get(key) is not None), None)
        yield from _rings(data["geometry"] or {}, own)
    else:
        inner = data.get("features", data.get("geometries", ()))
        yield from chain.from_iterable(_rings(one, depth) for one in inner)


@cache
def stream_along(polygons: tuple[Polygon, ...], depth: float) -> Stream:
    """Solve for the stream along all land and over all shoals, in a sea of `depth` [m] elsewhere.

    Finite volumes on square cells, for what land adds to a unit current e far out, psi = phi - e . x. The flow between the middles of two
    cells runs in lines side by side, each with the harmonic mean of the depths along it: none where it meets land, so that no wall of a
    quarter of a cell leaks. psi decays as that of a dipole: n . grad psi = -psi n . r / r^2 at the grid's sides, r from the land's middle.
    """
    water, lower, spacing = _water(polygons, depth)
    ways, shares = (
        [_with_open_sides(_mean_depths(one)), _with_open_sides(_mean_depths(one.T)).T]
        for one in (water, (water > 0.0).astype(np.float64))
    )
    shape = ways[0].shape[0] - 1, ways[0].shape[1]
    corners = list(chain.from_iterable(one for one, _ in polygons))
    decay = _decay(shape, (np.mean(corners, axis=0) - lower) / spacing)
    psi = _solved(ways, decay, shape)
    parts = water.reshape(shape[0], PARTS, shape[1], PARTS)
    openness = (parts > 0.0).mean(axis=(1, 3))
    depths = parts.mean(axis=(1, 3)) / np.maximum(openness, 0.5 / PARTS**2)  # of the part of a cell that is water
    response = np.empty((*shape, 2, 2))
    for axis, (way, share) in enumerate(zip(ways, shares, strict=True)):
        rise = np.diff(
            psi, axis=axis, prepend=np.nan, append=np.nan
        )  # what is added at each face, in units of the spacing
        first, last = (np.take(psi, end, axis) * np.take(decay[axis], end, axis)[..., None] for end in (0, -1))
        np.moveaxis(rise, axis, 0)[0], np.moveaxis(rise, axis, 0)[-1] = first, -last
        flux = way[..., None] * (rise + np.eye(2)[axis])
        low, high = (np.take(share, range(end, share.shape[axis] - 1 + end), axis) for end in (0, 1))
        total = sum(np.take(flux, range(end, way.shape[axis] - 1 + end), axis) for end in (0, 1))
        section = 2.0 * np.maximum(low, high) * depths
        response[:, :, axis] = total / np.maximum(section, np.finfo(float).tiny)[..., None]
    reached = shares[0][:-1] + shares[0][1:] + shares[1][:, :-1] + shares[1][:, 1:] > 0.0
    return Stream(lower, spacing, response, np.where(reached, openness, 0.0))


def _water(polygons: tuple[Polygon, ...], depth: float) -> tuple[Double, Double, float]:
    """Return the depth of the parts of cells over that of the sea [1], and the grid's lower corner (2,) and spacing [m]."""
    from matplotlib.path import Path as Outline

    corners = np.array(list(chain.from_iterable(one for one, _ in polygons)))
    size = np.ptp(corners, axis=0)
    reach = BEYOND * size.max()
    lower, size = corners.min(axis=0) - reach, size + 2.0 * reach
    spacing = float(size.max()) / CELLS
    count = np.ceil(size / spacing).astype(int) * PARTS
    x, y = (lower[axis] + (np.arange(count[axis]) + 0.5) * spacing / PARTS for axis in (0, 1))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    water = np.ones(len(points))
    for outline, own in polygons:
        within = Outline(np.array([*outline, outline[0]]), closed=True).contains_points(points)
        water[within] = np.minimum(water[within], own / depth)
    return water.reshape(count), lower, spacing


def _mean_depths(water: Double) -> Double:
    """Return the depths (N - 1, M) [1] of the ways along the first axis from one cell's middle to the next, over lines side by side."""
    half, (across, up) = PARTS // 2, (length // PARTS for length in water.shape)
    between = water[half:-half].reshape(across - 1, PARTS, up, PARTS)
    with np.errstate(divide="ignore"):
        return np.asarray((PARTS / (1.0 / between).sum(axis=1)).mean(axis=-1))


def _with_open_sides(ways: Double) -> Double:
    """Add the ways through the sides of the grid, beyond which the sea is open."""
    return np.pad(ways, ((1, 1), (0, 0)), constant_values=1.0)


def _decay(shape: tuple[int, int], middle: Double) -> list[Double]:
    """Return, by axis, by how much of psi at a middle (N, M) psi falls outwards over a spacing at the grid's sides [1]."""
    place = np.stack(np.meshgrid(*(np.arange(count) + 0.5 for count in shape), indexing="ij"), axis=-1) - middle
    rate = np.abs(place) / (place**2).sum(axis=-1, keepdims=True)
    rate /= 1.0 + 0.5 * rate
    return [rate[..., 0], rate[..., 1]]


def _solved(ways: list[Double], decay: list[Double], shape: tuple[int, int]) -> Double:
    """Return psi (N, M, 2), over the spacing, for unit currents along x and y."""
    from scipy.sparse import coo_array
    from scipy.sparse.linalg import splu

    number = np.arange(shape[0] * shape[1]).reshape(shape)
    diagonal, right = np.full(shape, -ENCLOSED), np.zeros((*shape, 2))
    rows, columns, values = list[Any](), list[Any](), list[Any]()
    for axis, way in enumerate(ways):
        inner = np.take(way, range(1, way.shape[axis] - 1), axis)
        low, high = (np.take(number, range(end, shape[axis] - 1 + end), axis) for end in (0, 1))
        rows += [low.ravel(), high.ravel()]
        columns += [high.ravel(), low.ravel()]
        values += [inner.ravel(), inner.ravel()]
        np.subtract.at(diagonal.reshape(-1), np.concatenate(rows[-2:]), np.concatenate(values[-2:]))
        right[..., axis] -= np.diff(way, axis=axis)
        for end in (0, -1):
            np.moveaxis(diagonal, axis, 0)[end] -= np.take(decay[axis], end, axis)
    matrix = coo_array(
        (
            np.concatenate([*values, diagonal.ravel()]),
            (np.concatenate([*rows, number.ravel()]), np.concatenate([*columns, number.ravel()])),
        )
    )
    return np.asarray(splu(matrix.tocsc()).solve(right.reshape(-1, 2)).reshape(*shape, 2))

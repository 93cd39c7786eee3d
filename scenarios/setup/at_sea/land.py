"""Land of a school's own harbour: its outlines from corners or GeoJSON, the stream along it, and the ground that vessels run on."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
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

# cells of the stream's grid along its longer side; numerical; a circular island's stream is within 2 % with them
CELLS = 240
# parts of a cell along each axis in which land is looked for; numerical; thinner walls would leak
PARTS = 4
# widths of all land that the grid reaches beyond it; numerical
BEYOND = 1.0
# [1] pull on psi to 0, of which water that land encloses has nothing else; numerical
ENCLOSED = 1e-10
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
    """Land in plan: outlines, each (K, 2) [m], without their first corner again at the end; capacity [m3/m] of oil along them."""

    outlines: tuple[Corners, ...]
    capacity: float

    def barriers(self, name: str) -> list[Outline]:
        """Return the outlines to which oil sticks, in sides of a few metres, each with its own room."""
        return [
            Outline(name=f"{LAND}{name}/{number}", nodes=_divided(outline), capacity=self.capacity, carries=False)
            for number, outline in enumerate(self.outlines, 1)
        ]

    def solid(self, name: str, level: float, depth: float) -> Solid:
        """Return the land as a fixed body with steep sides, from the sea's floor to above the water's level [m]."""
        from manifold3d import CrossSection, FillRule

        rings = [
            np.array(one)[:: 1 if _area(one) > 0.0 else -1] for one in self.outlines
        ]  # what overlaps is land all the same
        built = CrossSection(rings, FillRule.Positive).extrude(depth + RISE).to_mesh()
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


def outlines_of(land: Mapping[str, Land]) -> tuple[Corners, ...]:
    """Return the outlines of all land."""
    return tuple(chain.from_iterable(one.outlines for one in land.values()))


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
    settings: Mapping[str, LandSettings], site: SiteSettings | None, problems: list[Problem]
) -> dict[str, Land]:
    """Return all land by name; what is wrong with an outline or a file is added to `problems`."""
    found = read_outlines("land", settings, site, problems)
    return {name: Land(outlines, settings[name].capacity) for name, outlines in found.items()}


def read_outlines(
    table: str, settings: Mapping[str, AreaSettings], site: SiteSettings | None, problems: list[Problem]
) -> dict[str, tuple[Corners, ...]]:
    """Return the outlines [m] of each entry of a table; what is wrong with one or with a file is added to `problems`."""
    found = {}
    for name, one in settings.items():
        key, file = ("outline", "") if one.outline else ("file", f"{Path(one.file).name}: ")
        try:
            outlines = (one.outline,) if one.outline else tuple(_outlines(Path(one.file), site))
            for number, outline in enumerate(outlines, 1):
                _require_land(f"polygon {number} " if file else "", outline)
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            problems.append(Problem(f"{table}.{name}.{key}", f"{file}{reason_of(error)}"))
            continue
        found[name] = outlines
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


def _outlines(file: Path, site: SiteSettings | None) -> Iterator[Corners]:
    """Yield the outer rings [m] of the polygons of a GeoJSON file (RFC 7946); ValueError for a file without any, or with other numbers."""
    assert site is not None  # the checks between tables ask for it
    rings = list(_rings(json.loads(file.read_text(encoding="utf-8"))))
    if not rings:
        raise ValueError("holds no Polygon or MultiPolygon, allowed: GeoJSON with one or more")
    for number, ring in enumerate(rings, 1):
        degrees = np.array([corner[:2] for corner in ring], np.float64)
        if (
            degrees.ndim != 2
            or len(degrees) < 4
            or not np.isfinite(degrees).all()
            or (np.abs(degrees) > (360.0, 90.0)).any()
        ):
            raise ValueError(f"polygon {number} is no ring of 4 or more positions [longitude, latitude] in degrees")
        yield tuple(map(tuple, world_points(site.recorded, degrees[:-1, 0], degrees[:-1, 1]).tolist()))


def _rings(data: Mapping[str, Any]) -> Iterator[Sequence[Any]]:
    """Yield the outer rings of a GeoJSON object; holes, which are lakes, are land here."""
    kind = data.get("type")
    if kind == "Polygon":
        yield data["coordinates"][0]
    elif kind == "MultiPolygon":
        yield from (polygon[0] for polygon in data["coordinates"])
    elif kind == "Feature":
        yield from _rings(data["geometry"] or {})
    else:
        yield from chain.from_iterable(_rings(one) for one in data.get("features", data.get("geometries", ())))


@cache
def stream_along(outlines: tuple[Corners, ...]) -> Stream:
    """Solve for the stream along all land; outlines as in `Land`.

    Finite volumes on square cells, for what land adds to a unit current e far out, psi = phi - e . x. The flow between the middles of two
    cells passes through the share of the way that is water all along, so that no wall of a quarter of a cell leaks. psi decays as that of a
    dipole: n . grad psi = -psi n . r / r^2 at the grid's sides, with r from the land's middle.
    """
    water, lower, spacing = _water(outlines)
    ways = [np.pad(_open_ways(water), ((1, 1), (0, 0)), constant_values=1.0)]
    ways.append(np.pad(_open_ways(water.T), ((1, 1), (0, 0)), constant_values=1.0).T)
    shape = ways[0].shape[0] - 1, ways[0].shape[1]
    middle = (np.mean(list(chain.from_iterable(outlines)), axis=0) - lower) / spacing
    decay = _decay(shape, middle)
    psi = _solved(ways, decay, shape)
    cells = water.reshape(shape[0], PARTS, shape[1], PARTS).mean(axis=(1, 3))
    response = np.empty((*shape, 2, 2))
    for axis, way in enumerate(ways):
        rise = np.diff(
            psi, axis=axis, prepend=np.nan, append=np.nan
        )  # what is added at each face, in units of the spacing
        first, last = (np.take(psi, end, axis) * np.take(decay[axis], end, axis)[..., None] for end in (0, -1))
        np.moveaxis(rise, axis, 0)[0], np.moveaxis(rise, axis, 0)[-1] = first, -last
        flux = way[..., None] * (rise + np.eye(2)[axis])
        low, high = (np.take(way, range(end, way.shape[axis] - 1 + end), axis) for end in (0, 1))
        total = sum(np.take(flux, range(end, way.shape[axis] - 1 + end), axis) for end in (0, 1))
        response[:, :, axis] = total / np.maximum(2.0 * np.maximum(low, high), np.finfo(float).tiny)[..., None]
    reached = ways[0][:-1] + ways[0][1:] + ways[1][:, :-1] + ways[1][:, 1:] > 0.0
    return Stream(lower, spacing, response, np.where(reached, cells, 0.0))


def _water(outlines: tuple[Corners, ...]) -> tuple[NDArray[np.bool_], Double, float]:
    """Mark the parts of cells that are water, and return the grid's lower corner (2,) and spacing [m]."""
    from matplotlib.path import Path as Polygon

    corners = np.array(list(chain.from_iterable(outlines)))
    size = np.ptp(corners, axis=0)
    reach = BEYOND * size.max()
    lower, size = corners.min(axis=0) - reach, size + 2.0 * reach
    spacing = float(size.max()) / CELLS
    count = np.ceil(size / spacing).astype(int) * PARTS
    x, y = (lower[axis] + (np.arange(count[axis]) + 0.5) * spacing / PARTS for axis in (0, 1))
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    dry = np.zeros(len(points), bool)
    for outline in outlines:
        dry |= Polygon(np.array([*outline, outline[0]]), closed=True).contains_points(points)
    return ~dry.reshape(count), lower, spacing


def _open_ways(water: NDArray[np.bool_]) -> Double:
    """Return the open share (N - 1, M) [1] of the ways along the first axis from one cell's middle to the next."""
    half, (across, up) = PARTS // 2, (length // PARTS for length in water.shape)
    between = water[half:-half].reshape(across - 1, PARTS, up, PARTS)
    return np.asarray(between.all(axis=1).mean(axis=-1))


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

"""The start positions of the particles in a scenario's regions of liquid: points of one lattice, so that regions fit together.

The lattice has the particle spacing as its edge, stands on the tank's floor and is centred sideways. A region takes the points inside
it. Faces of blocks, slabs and cylinders snap to the nearest lattice plane, and a thin region keeps one layer, so that a scenario
still works with another particle spacing. Only a block with an inset has a lattice of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from oilsim.backend.arrays import Array
from recordings.model.words import volume_in_words
from scenarios.schema.liquid import BlockFill, CylinderFill, Fill, SlabFill, Tank
from scenarios.schema.parsing.quantity_fields import Vector
from scenarios.text.problems import Problem, ScenarioError

TOO_NEAR = 0.9  # of a spacing: particles of an earlier region that are nearer to a later one's give way
LATTICE_SLACK = 1e-6  # of a spacing
DISORDER = 0.3  # spacings: with 0.2 waves of half a spacing lose 8 to 16 % a period, with this 4 to 5 %
OFF = 0.05  # of a spacing, by which a region's particles may end above or below its top without a word
MISFIT = 0.03  # of a region's volume, by which its particles may differ from its shape without a word


class Lattice:
    """The lattice of a tank: the number of particles on each axis, and the position [m] of the first; points are (N, 3)."""

    def __init__(self, tank: Tank, spacing: float, dimension: int) -> None:
        lower, upper = np.array(tank.lower), np.array(tank.upper)
        self.spacing = spacing
        self.dimension = dimension
        self.count = np.maximum(1, np.floor((upper - lower) / spacing + LATTICE_SLACK)).astype(int)
        slack = upper - lower - self.count * spacing
        self.corner = lower + np.where([True, True, False], 0.5 * slack, 0.0)

    def planes(self, axis: int, low: float, high: float) -> Array:
        """Return the coordinates [m] of the lattice planes between two faces that snap to the lattice; at least one plane."""
        first, last = ((edge - self.corner[axis]) / self.spacing for edge in (low, high))
        begin = int(np.clip(_nearest(first), 0, self.count[axis] - 1))
        end = int(np.clip(_nearest(last), begin + 1, self.count[axis]))
        return self.corner[axis] + (np.arange(begin, end) + 0.5) * self.spacing

    def box(self, lower: Vector, upper: Vector) -> Array:
        """Return the points (N, 3) [m] of a box; in two dimensions its range in y has no planes, however long it is."""
        axes = [
            np.zeros(1) if axis == 1 and self.dimension == 2 else self.planes(axis, low, high)
            for axis, (low, high) in enumerate(zip(lower, upper, strict=True))
        ]
        return _grid(axes)


def _nearest(number: float) -> int:
    """Round to the nearest whole number, halves upwards in spite of rounding errors."""
    return int(np.floor(number + 0.5 + LATTICE_SLACK))


def _grid(axes: Sequence[Array]) -> Array:
    """Build the points (N, 3) of a product of axes."""
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def region_points(fill: Fill, tank: Tank, spacing: float, dimension: int) -> Array:
    """Return the positions (N, 3) [m] of the particles of one region."""
    lattice = Lattice(tank, spacing, dimension)
    if isinstance(fill, BlockFill):
        return _inset_block(fill, spacing, dimension) if fill.inset else lattice.box(fill.lower, fill.upper)
    if isinstance(fill, SlabFill):
        return lattice.box((*tank.lower[:2], fill.bottom), (*tank.upper[:2], fill.top))
    return _cylinder(fill, lattice)


def _cylinder(fill: CylinderFill, lattice: Lattice) -> Array:
    """Return the points of an upright cylinder, in whole layers."""
    x, y, z = fill.base
    r = fill.radius
    everything = lattice.box((x - r, y - r, z), (x + r, y + r, z + fill.height))
    return everything[np.linalg.norm(everything[:, :2] - (x, y), axis=1) <= r]


def _inset_block(fill: BlockFill, spacing: float, dimension: int) -> Array:
    """Return round(extent / d - 2 inset) points along each axis, centred sideways, on the lower face."""
    axes: list[Array] = []
    for axis in range(3):
        if axis == 1 and dimension == 2:
            axes.append(np.zeros(1))
            continue
        extent = fill.upper[axis] - fill.lower[axis]
        fitting = np.floor(extent / spacing + LATTICE_SLACK)
        count = max(1, min(int(fitting), _nearest(extent / spacing - 2.0 * fill.inset)))
        slack = 0.0 if axis == 2 else 0.5 * (extent - count * spacing)
        axes.append(fill.lower[axis] + slack + (np.arange(count, dtype=np.float64) + 0.5) * spacing)
    return _grid(axes)


def starting_positions(regions: Mapping[str, Fill], tank: Tank, spacing: float, dimension: int) -> dict[str, Array]:
    """Return positions (N, 3) [m] by region, as `placed_regions` does; ScenarioError for a region without a particle."""
    placed = placed_regions(regions, tank, spacing, dimension)
    problems = list(empty_regions(regions, placed, tank, spacing, dimension))
    if problems:
        raise ScenarioError(problems)
    return placed


def placed_regions(regions: Mapping[str, Fill], tank: Tank, spacing: float, dimension: int) -> dict[str, Array]:
    """Return positions (N, 3) [m] by region; particles of earlier regions give way to those of later ones."""
    placed: dict[str, Array] = {}
    for name, fill in regions.items():
        points = region_points(fill, tank, spacing, dimension)
        for earlier, others in placed.items():
            if len(points):
                placed[earlier] = _away_from(points, others, TOO_NEAR * spacing)
        placed[name] = points
    return placed


def off_lattice(regions: Mapping[str, Array], spacing: float, dimension: int, seed: int) -> dict[str, Array]:
    """Return the positions (N, 3) [m] by region with each point moved by up to DISORDER spacings along each axis, by the run's seed.

    A lattice is stiff against waves lower than a spacing, and takes a fifth of their height a period until it has melted.
    """
    random, axes = np.random.default_rng(seed), (1.0, float(dimension == 3), 1.0)
    return {
        name: points + DISORDER * spacing * random.uniform(-1.0, 1.0, points.shape) * axes
        for name, points in regions.items()
    }


def _away_from(points: Array, others: Array, distance: float) -> Array:
    """Select the `others` (M, 3) [m] that have none of the points (N, 3) [m], one or more, nearer than `distance` [m].

    Only what lies in the other's bounding box is searched: regions of many millions of particles mostly meet in a layer.
    """
    near = within(others, points.min(axis=0) - distance, points.max(axis=0) + distance)
    if not near.size:
        return others
    reach = others[near]
    tree = cKDTree(points[within(points, reach.min(axis=0) - distance, reach.max(axis=0) + distance)])
    found, _ = tree.query(reach, distance_upper_bound=distance)
    kept = np.ones(len(others), bool)
    kept[near[np.isfinite(found)]] = False
    return others[kept]


def within(points: Array, lower: Array, upper: Array) -> NDArray[np.intp]:
    """Return the indices of the points (N, 3) [m] inside a box from `lower` to `upper`, (3,) [m]; axis by axis, which is faster."""
    found = np.flatnonzero((points[:, 0] > lower[0]) & (points[:, 0] < upper[0]))
    for axis in (1, 2):
        place = points[found, axis]
        found = found[(place > lower[axis]) & (place < upper[axis])]
    return found


def empty_regions(
    regions: Mapping[str, Fill], placed: Mapping[str, Array], tank: Tank, spacing: float, dimension: int
) -> Iterator[Problem]:
    """Yield a problem for each region without a particle: it is too small, or regions that come later cover it.

    placed: positions (N, 3) [m] by region; spacing [m].
    """
    for number, (name, fill) in enumerate(regions.items()):
        if len(placed[name]):
            continue
        points = region_points(fill, tank, spacing, dimension)
        later = list(regions)[number + 1 :] if len(points) > 1 else []
        covers = [f"fill.{other}" for other in later if _covers_some(placed[other], points, spacing)]
        if covers:
            text = f"is covered by {' and '.join(covers)}, which comes later; allowed: the other order, or places of its own"
        else:
            text = f"has no particle at fluid.particle_spacing = {spacing:g} m, allowed: a larger region, or a smaller spacing"
        yield Problem(f"fill.{name}", text)


def _covers_some(points: Array, others: Array, spacing: float) -> bool:
    """Tell whether some of the `others` (M, 3) [m] have to give way to points (N, 3) [m]."""
    return bool(len(points) and len(others) and len(_away_from(points, others, TOO_NEAR * spacing)) < len(others))


def misfits(regions: Mapping[str, Fill], tank: Tank, spacing: float, dimension: int) -> dict[str, str]:
    """Say by how much a region's particles exceed or fall short of its shape, by its name, where that is more than `MISFIT`.

    A block with an inset leaves space on purpose, and is left out.
    """
    told = {}
    for name, fill in regions.items():
        if isinstance(fill, BlockFill) and fill.inset:
            continue
        shape = _content(fill, tank, dimension)
        found = len(region_points(fill, tank, spacing, dimension)) * spacing**dimension
        if found and abs(found - shape) > MISFIT * shape:
            more = f"{found / shape:.2f} times" if found < 2.0 * shape else f"{found / shape:.2g} times"
            text = f"fill.{name}: its particles hold {volume_in_words(found)}, {more} the {volume_in_words(shape)} of its shape"
            reason = (
                f"sizes are rounded to whole particles of fluid.particle_spacing = {spacing:g} m, one layer at least"
            )
            told[name] = f"{text}; {reason}"
    return told


def surface_off(regions: Mapping[str, Fill], tank: Tank, spacing: float, dimension: int) -> Iterator[str]:
    """Say how far the particles of the highest region end from its top, where bodies that are placed by that top feel it.

    A region's height is rounded to whole layers; blocks with an inset have spaces on purpose, and cylinders are drops.
    """
    lattice, tops = Lattice(tank, spacing, dimension), {}
    for name, fill in regions.items():
        if isinstance(fill, SlabFill) or (isinstance(fill, BlockFill) and not fill.inset):
            bottom, top = (fill.bottom, fill.top) if isinstance(fill, SlabFill) else (fill.lower[2], fill.upper[2])
            tops[name] = top, float(lattice.planes(2, bottom, top)[-1]) + 0.5 * spacing
    if not tops:
        return
    name, (top, found) = max(tops.items(), key=lambda entry: entry[1][0])
    if abs(found - top) > OFF * spacing:
        way, kick = ("above", "up") if found > top else ("below", "down")
        yield (
            f"fill.{name}: its particles end at {found:.4g} m, {abs(found - top):.2g} m {way} its top of {top:g} m, in whole layers of"
            f" {spacing:g} m; bodies placed afloat by that top move {kick} at the start, allowed without a word: a top of {found:.4g} m"
        )


def _content(fill: Fill, tank: Tank, dimension: int) -> float:
    """Compute the volume [m3] of a region's shape within the tank; a plane is one metre thick."""
    if isinstance(fill, CylinderFill):
        return fill.radius * fill.height * (2.0 if dimension == 2 else math.pi * fill.radius)
    low, high = (fill.lower, fill.upper) if isinstance(fill, BlockFill) else (tank.lower, tank.upper)
    sides = [b - a for a, b in zip(low, high, strict=True)]
    if isinstance(fill, SlabFill):
        sides[2] = fill.top - fill.bottom
    return sides[0] * sides[2] * (1.0 if dimension == 2 else sides[1])

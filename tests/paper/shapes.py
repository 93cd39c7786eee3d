"""How oil lies on the water, and on a rock: areas, axes and what hangs on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from scipy.spatial import cKDTree

Points = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Footprint:
    """The oil of one moment, seen from above.

    area           [m2] of the square cells that hold oil
    axis_ratio     longer over shorter principal axis of the covered area; 1 for a circle and for a square
    angle          [degrees] of the longer axis to x, from -90 to 90
    corner_ratio   mean reach towards the diagonals over that along x and y: 1 for a circle, 1.2 for a square
    center         (2,) [m] centre of the oil's volume
    patches        number of pieces that do not touch, of four cells or more
    """

    area: float
    axis_ratio: float
    angle: float
    corner_ratio: float
    center: tuple[float, float]
    patches: int


def footprint(places: Points, cell: float) -> Footprint:
    """Measure oil whose particles stand at `places` (N, 2) [m] with square cells of an edge [m]; ValueError without a particle."""
    if len(places) == 0:
        raise ValueError("footprint: there is no oil")
    filled = np.unique(np.floor(places / cell).astype(np.int64), axis=0)
    cells = (filled + 0.5) * cell
    moments = np.cov(cells.T, bias=True) + np.eye(2) * cell**2 / 12.0  # a cell has moments of its own
    size, axes = np.linalg.eigh(moments)
    angle = math.degrees(math.atan2(axes[1, 1], axes[0, 1]))
    return Footprint(
        area=len(cells) * cell**2,
        axis_ratio=math.sqrt(size[1] / size[0]),
        angle=(angle + 90.0) % 180.0 - 90.0,
        corner_ratio=_corner_ratio(cells),
        center=tuple(np.mean(places, axis=0).tolist()),
        patches=_patches(filled),
    )


def _corner_ratio(cells: Points) -> float:
    """Compare the reach of covered cells (M, 2) [m] towards the diagonals with that along the axes, each the mean of four directions."""
    away = cells - cells.mean(axis=0)
    distance, turn = np.hypot(*away.T), np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    reaches = []
    for direction in np.arange(8) * 45.0:
        near = np.abs((turn - direction + 180.0) % 360.0 - 180.0) <= 22.5
        reaches.append(float(np.percentile(distance[near], 95.0)) if near.any() else 0.0)
    along = sum(reaches[0::2])
    return sum(reaches[1::2]) / along if along > 0.0 else math.inf


def _patches(filled: NDArray[np.int64]) -> int:
    """Count the pieces of covered cells, given as rows of numbers (M, 2), that hold four cells or more."""
    picture = np.zeros(np.ptp(filled, axis=0) + 1, bool)
    picture[tuple((filled - filled.min(axis=0)).T)] = True
    pieces, count = label(picture, structure=np.ones((3, 3)))
    return int(sum(np.count_nonzero(pieces == number) >= 4 for number in range(1, count + 1)))


@dataclass(frozen=True, kw_only=True)
class Coating:
    """Oil that hangs on a rock: the share of its surface that oil touches, and the oil's volume [m3]."""

    covered: float
    volume: float


def coating(oil: Points, surface: Points, spacing: float, least_height: float) -> Coating:
    """Measure the oil that hangs on a rock higher than `least_height` [m], above the pool.

    oil (N, 3) and even points of the rock's surface (M, 3) [m]. A particle hangs on the rock if a point of the surface lies within one and
    a half `spacing` [m]; a point of the surface is covered if a particle lies so near to it.
    """
    high, dry = oil[oil[:, 2] > least_height], surface[surface[:, 2] > least_height]
    if not len(high) or not len(dry):
        return Coating(covered=0.0, volume=0.0)
    near = 1.5 * spacing
    hanging = cKDTree(dry).query(high, distance_upper_bound=near)[0] <= near
    covered = cKDTree(high).query(dry, distance_upper_bound=near)[0] <= near
    return Coating(covered=float(covered.mean()), volume=float(hanging.sum()) * spacing**3)

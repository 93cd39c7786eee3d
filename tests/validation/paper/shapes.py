"""How oil lies on the water, and on a rock: areas, axes, thickness, and what hangs on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

Points = NDArray[np.floating]


@dataclass(frozen=True, kw_only=True)
class Footprint:
    """The oil of one moment, seen from above.

    area               [m2] of the square cells that hold oil
    axis_ratio         longer over shorter principal axis of the covered area; 1 for a circle and for a square
    width_over_length  extent of the covered area along y over that along x; an ellipse along x has less than 1
    corner_ratio       mean reach towards the diagonals over that along x and y: 1 for a circle, 1.2 for a square
    center             (2,) [m] centre of the oil's volume
    """

    area: float
    axis_ratio: float
    width_over_length: float
    corner_ratio: float
    center: tuple[float, float]


def footprint(places: Points, cell: float) -> Footprint:
    """Measure oil whose particles stand at `places` (N, 2) [m] with square cells of an edge [m]; ValueError without a particle."""
    if len(places) == 0:
        raise ValueError("footprint: there is no oil")
    cells = (np.unique(np.floor(places / cell), axis=0) + 0.5) * cell
    moments = np.cov(cells.T, bias=True) + np.eye(2) * cell**2 / 12.0  # a cell has moments of its own
    shorter, longer = np.linalg.eigvalsh(moments)
    return Footprint(
        area=len(cells) * cell**2,
        axis_ratio=math.sqrt(longer / shorter),
        width_over_length=math.sqrt(moments[1, 1] / moments[0, 0]),
        corner_ratio=_corner_ratio(cells),
        center=tuple(np.mean(places, axis=0).tolist()),
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


def thickness(places: Points, volume: float, extent: tuple[float, float, float, float], cell: float) -> Points:
    """Spread particles at `places` (N, 2) [m] of a volume [m3] each over square cells of an edge [m], by a Gaussian as wide as a cell.

    extent: range of both coordinates [m], the first in columns. Returns the volume over the area of each cell [m]; all of it stays inside.
    """
    x0, x1, y0, y1 = extent
    shape = round((y1 - y0) / cell), round((x1 - x0) / cell)
    counts = np.histogram2d(places[:, 1], places[:, 0], bins=shape, range=((y0, y1), (x0, x1)))[0]
    return np.asarray(volume / cell**2 * gaussian_filter(counts, 1.0, mode="reflect"))


def covered(oil: Points, surface: Points, near: float, least_height: float) -> float:
    """Return the share of even points of a rock's surface (M, 3) [m] above a height [m] that have an oil particle (N, 3) [m] `near` [m]."""
    high, dry = oil[oil[:, 2] > least_height], surface[surface[:, 2] > least_height]
    if not len(high) or not len(dry):
        return 0.0
    return float(np.mean(cKDTree(high).query(dry, distance_upper_bound=near)[0] <= near))

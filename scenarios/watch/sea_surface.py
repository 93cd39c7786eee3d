"""The surface of a sea by formulas, as it is recorded: fine around the exercise, coarser to the horizon, with the oil on it as a film."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from oilsim.backend.arrays import Array, Flags, Ints, Real
from oilsim.sea import Sea
from recordings.model.surface import FilmFrame, SurfaceFrame
from scenarios.watch.slick_oil import spots_of_slick

if TYPE_CHECKING:
    from oilsim.slick.barriers import Barriers
    from oilsim.slick.slick import Slick


INNER_LINES = 33  # [1] grid lines across the exercise: 4 a wave length show waves longer than an eighth of it at their full height
OUTER_LINES = 6  # [1] to each side beyond
GROWTH = 2.6  # [1] of the outer spacings, one to the next; the last line is 500 inner spacings away
MARGIN = 0.15  # [1] of the exercise's extent, around it
SNAP = 0.25  # [1] of its extent, by which the box moves at once, so that the grid seldom moves
LEAST_EXTENT = 10.0  # [m]
FAR_OIL = 2.0  # [1] percent of the parcels at each end that the box may leave out
SOFT = 0.16  # [1] share of a difference between neighbouring cells that a pass of the smoothing exchanges, which closes gaps between spots
PASSES = 2  # [1] of it: as a Gaussian of 0.8 cells
FILM_CELLS = 96  # [1] across the box
ROUND_OFF = 1e-12  # [m] that sums of thicknesses may leave where no oil is; a thousandth of a layer of molecules


class SeaSurface:
    """Makes frames of a sea's surface; it has no state, so that equal bodies and parcels give equal frames."""

    def frame(self, sea: Sea, time: float, places: Array) -> SurfaceFrame:
        """Return the surface at `time` [s] around the places (N, 2) [m] of bodies and oil."""
        box = box_around(places)
        x, y = (grid_lines(box[axis], box[axis + 2]) for axis in (0, 1))
        return SurfaceFrame(x=x, y=y, height=sea.grid_elevation(x, y, time).astype(np.float32), box=box)

    def film(self, surface: SurfaceFrame, slick: Slick) -> FilmFrame:
        """Return the oil of a slick as a film over the surface's box."""
        spots = spots_of_slick(slick).astype(np.float64)
        return FilmFrame(thickness=film_of(spots, surface.box, slick.barriers), box=surface.box)


def box_around(places: Array) -> tuple[float, float, float, float]:
    """Return a box (x and y from, x and y to) [m] around most of the places (N, 2) [m] with some margin, on a coarse raster."""
    low, high = np.percentile(places, [FAR_OIL, 100.0 - FAR_OIL], axis=0) if len(places) else np.zeros((2, 2))
    extent = max(float((high - low).max()), LEAST_EXTENT)
    step = SNAP * 2.0 ** np.ceil(np.log2(extent))
    low, high = np.floor((low - MARGIN * extent) / step) * step, np.ceil((high + MARGIN * extent) / step) * step
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def grid_lines(low: float, high: float) -> Array:
    """Return the N = INNER_LINES + 2 OUTER_LINES grid lines (N,) [m]: even from `low` to `high` [m], and then farther and farther apart."""
    inner = np.linspace(low, high, INNER_LINES)
    beyond = np.cumsum((inner[1] - inner[0]) * GROWTH ** np.arange(1, OUTER_LINES + 1))
    return np.concatenate([low - beyond[::-1], inner, high + beyond])


def film_of(spots: Array, box: tuple[float, float, float, float], barriers: Barriers | None = None) -> Real:
    """Return the thickness (R, C) [m] of round spots (N, 5) in the cells of a box: x, y, radius, thickness [m], fate.

    Each spot lays its thickness on the cells whose centres it covers; a spot smaller than a cell lays its volume on the nearest one, and
    none across a barrier. The outermost cells stay clear, because the viewer continues them beyond the box.
    """
    shape = np.array([FILM_CELLS, FILM_CELLS])
    low, cell = np.array(box[:2]), (np.array(box[2:]) - np.array(box[:2])) / shape
    center, radius = (spots[:, :2] - low) / cell - 0.5, spots[:, 2:3] / cell  # in cells
    small = (radius < 0.75).all(axis=1)
    nearest = _nearest_cells(center[small], low, cell, barriers)
    film = np.zeros(FILM_CELLS**2)
    _lay(film, nearest, (spots[:, 3] * np.pi * spots[:, 2] ** 2 / cell.prod())[small])
    film = film.reshape(FILM_CELLS, FILM_CELLS) + _discs(center[~small], radius[~small], spots[~small, 3])
    square = _smoothed(film, *_links(low, cell, barriers))
    square[[0, -1], :] = square[:, [0, -1]] = 0.0
    return square.astype(np.float32)


def _nearest_cells(center: Array, low: Array, cell: Array, barriers: Barriers | None) -> Ints:
    """Return the cells (N, 2) whose centres are nearest to places (N, 2) [cells], if there is one across no barrier."""
    corners = np.floor(center)[:, None, :] + np.array([(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])
    far = np.linalg.norm(corners - center[:, None, :], axis=2)
    far += 10.0 * _parted(np.broadcast_to(center[:, None, :], corners.shape), corners, low, cell, barriers)
    chosen = np.take_along_axis(corners, far.argmin(axis=1)[:, None, None], axis=1)[:, 0]
    return chosen.astype(np.int64)


def _links(low: Array, cell: Array, barriers: Barriers | None) -> tuple[Flags, Flags]:
    """Return which neighbouring cells, along x (R - 1, C) and along y (R, C - 1), no barrier parts."""
    places = np.stack(np.meshgrid(*2 * [np.arange(float(FILM_CELLS))], indexing="ij"), axis=2)
    along_x, along_y = (places[:-1], places[1:]), (places[:, :-1], places[:, 1:])
    return ~_parted(*along_x, low, cell, barriers), ~_parted(*along_y, low, cell, barriers)


def _parted(origin: Array, target: Array, low: Array, cell: Array, barriers: Barriers | None) -> Flags:
    """Return whether a barrier lies between places (..., 2) [cells] and others."""
    if barriers is None or not len(barriers.start):
        return np.zeros(origin.shape[:-1], np.bool_)
    from oilsim.slick.crossing import first_crossings, resting_sweep

    begin, end = (low + (place.reshape(-1, 2) + 0.5) * cell for place in (origin, target))
    met = first_crossings(begin, end, resting_sweep(barriers)).segment >= 0
    return np.asarray(met).reshape(origin.shape[:-1])


def _smoothed(film: Array, open_x: Flags, open_y: Flags) -> Array:
    """Return a film (R, C) [m] whose neighbouring cells have exchanged oil where nothing parts them; the volume stays."""
    square = film.copy()
    for _ in range(PASSES):
        for axis, is_open in enumerate((open_x, open_y)):
            flow = SOFT * is_open * np.diff(square, axis=axis)
            square += np.diff(flow, axis=axis, prepend=0.0, append=0.0)
    return square


def _discs(center: Array, radius: Array, thickness: Array) -> Array:
    """Return the film (R, C) [m] of discs: center (N, 2) and half axes (N, 2) in cells, thickness (N,) [m].

    A disc covers a span of cells in each row, and adds its thickness where the span begins and takes it away where it ends. The cost does
    not depend on the radius: a sheen of a few molecules may be wider than the box.
    """
    film = np.empty((FILM_CELLS, FILM_CELLS))
    for row in range(FILM_CELLS):
        part = 1.0 - ((row - center[:, 0]) / radius[:, 0]) ** 2
        met = part >= 0.0
        half = radius[met, 1] * np.sqrt(part[met])
        first = np.clip(np.ceil(center[met, 1] - half), 0, FILM_CELLS).astype(np.int64)
        after = np.clip(np.floor(center[met, 1] + half) + 1, 0, FILM_CELLS).astype(np.int64)
        change = [np.bincount(at, weights=thickness[met], minlength=FILM_CELLS + 1) for at in (first, after)]
        film[row] = np.cumsum(change[0] - change[1])[:-1]
    return np.where(film > ROUND_OFF, film, 0.0)


def _lay(film: Array, at: Ints, thickness: Array) -> None:
    """Add thicknesses (N,) [m] to the cells at (N, 2) that lie in the film."""
    inside = ((at >= 0) & (at < FILM_CELLS)).all(axis=1)
    film += np.bincount(at[inside] @ (FILM_CELLS, 1), weights=thickness[inside], minlength=film.size)

"""The surface of water that consists of particles, as a height over a grid: of a tank, or of a window inside a sea by formulas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter

from oilsim.backend.arrays import Array, Ints
from oilsim.sea import Sea
from recordings.model.surface import SurfaceFrame
from scenarios.watch.sea_surface import INNER_LINES, OUTER_LINES, box_around, grid_lines

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator

    from oilsim.window.window import Window


CELL = 2.0  # [1] width of a grid's cells, in particle spacings, where the grid needs no more than `MOST_LINES`
MOST_LINES = 65  # [1] of a tank's grid, to each side
WINDOW_CELLS = 32  # [1] of the grid across a window, to each side, besides those of the sea
HALF_FULL = 0.5  # [1] part of a layer of particles from which on it lies in the water; as in a volume of fluid (Hirt and Nichols 1981)
UPPER = 3.0  # [1] spacings below the level at rest, down to which a window's particles are looked at; the others cost time only
SIDE = 1e-4  # [1] offset of a side's foot, in widths of the tank: nothing, but a grid's lines must differ
SOFT = 0.7  # [1] width of the smoothing in cells, which takes away the unevenness of single particles


def tank_surface(places: Array, spacing: float, lower: Sequence[float], upper: Sequence[float]) -> SurfaceFrame:
    """Return the clear surface of the water in a tank between two corners (3,) [m], of particles at places (N, 3) [m], `spacing` [m] apart.

    The surface lies on the floor where no water is. The outermost lines lie there, too: the water has sides down to the floor.
    """
    x, y = (_even_lines(lower[axis], upper[axis], spacing) for axis in (0, 1))
    height = water_height(places, x, y, spacing)
    smooth = gaussian_filter(np.where(np.isnan(height), lower[2], height), SOFT, mode="nearest")
    box = (float(x[0]), float(y[0]), float(x[-1]), float(y[-1]))
    with_sides = np.pad(smooth, 1, constant_values=lower[2])
    return SurfaceFrame(
        x=_with_sides(x), y=_with_sides(y), height=with_sides.astype(np.float32), box=box, is_clear=True
    )


def sea_with_windows(sea: Sea, time: float, places: Array, windows: Sequence[Window]) -> SurfaceFrame:
    """Return the surface of a sea at `time` [s] around places (N, 2) [m], with that of the windows' particles in it, the finest first."""
    (low, high), box = _corners(windows[0], time), box_around(places)
    x, y = (lines_with_window(box[axis], box[axis + 2], low[axis], high[axis]) for axis in (0, 1))
    height = sea.grid_elevation(x, y, time)
    crossings = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    raised = np.zeros(height.shape)
    for window in reversed(windows):
        own, share = np.moveaxis(_raised(sea, time, window)(crossings), -1, 0)
        raised = (1.0 - share) * raised + own
    height += raised
    return SurfaceFrame(x=x, y=y, height=height.astype(np.float32), box=box)


def _corners(window: Window, time: float) -> tuple[Array, Array]:
    """Return the lower and the upper corner (2,) [m] of a window at `time` [s], where its water is now."""
    middle = window.middle(time)
    half = 0.5 * np.array(window.settings.whole_size)
    return middle - half, middle + half


def _raised(sea: Sea, time: float, window: Window) -> RegularGridInterpolator:
    """Return, as a function of places, how far [m] the water of a window stands above the sea times its share [1], and the share.

    The share is 1 in the middle, falls across the rim and is 0 outside. Where a body takes all of a column, the sea's water stands for it.
    """
    from scipy.interpolate import RegularGridInterpolator  # a twentieth of a second, for runs with a window

    spacing, (low, high) = window.settings.spacing, _corners(window, time)
    rest = window.rim.about_center(window.fluid.particles.position.T)
    upper = rest[rest[:, 2] > sea.description.level - UPPER * spacing]
    x, y = (_even_lines(low[axis], high[axis], spacing) for axis in (0, 1))
    own = water_height(window.motion.in_sea(upper, time), x, y, spacing) - sea.grid_elevation(x, y, time)
    inward = [np.minimum(at - at[0], at[-1] - at) for at in (x, y)]
    share = np.clip(np.minimum.outer(*inward) / window.settings.width, 0.0, 1.0)
    smooth = share * gaussian_filter(np.where(np.isnan(own), 0.0, own), SOFT, mode="nearest")
    return RegularGridInterpolator((x, y), np.stack([smooth, share], axis=-1), bounds_error=False, fill_value=0.0)


def water_height(places: Array, x: Array, y: Array, spacing: float) -> Array:
    """Return the height (N, M) [m] of water of particles at places (P, 3) [m] around crossings of grid lines; NaN where no water is.

    Each crossing has a column of layers, one spacing high. The surface lies in the uppermost layer that is half full: half a layer above
    the mean height of its particles if it is full, less if it is not, and higher by the particles of the layer above. Drops above that
    are left out.
    """
    edges = [np.concatenate([lines[:1], 0.5 * (lines[1:] + lines[:-1]), lines[-1:]]) for lines in (x, y)]
    at = [np.searchsorted(edge, places[:, axis], side="right") - 1 for axis, edge in enumerate(edges)]
    inside = (at[0] >= 0) & (at[0] < len(x)) & (at[1] >= 0) & (at[1] < len(y))
    z = places[inside, 2]
    if not len(z):
        return np.full((len(x), len(y)), np.nan)
    low = float(z.min()) - 0.5 * spacing
    layer = ((z - low) / spacing).astype(np.int64)
    layers = int(layer.max()) + 2
    number = (at[0][inside] * len(y) + at[1][inside]) * layers + layer
    size = len(x) * len(y) * layers
    shape = (len(x), len(y), layers)
    counts = np.bincount(number, minlength=size).reshape(shape)
    means = np.bincount(number, weights=z, minlength=size).reshape(shape) / np.maximum(counts, 1)
    full = np.multiply.outer(np.diff(edges[0]), np.diff(edges[1]))[..., None] / spacing**2
    part = np.minimum(counts / full, 1.0)
    top = layers - 1 - np.argmax(part[..., ::-1] >= HALF_FULL, axis=-1)[..., None]

    def taken(values: Array, layer: Ints) -> Array:
        return np.asarray(np.take_along_axis(values, layer, axis=-1)[..., 0])

    above = np.where(top[..., 0] < layers - 1, taken(part, np.minimum(top + 1, layers - 1)), 0.0)
    height = taken(means, top) + spacing * (0.5 * taken(part, top) + above)
    return np.where((part >= HALF_FULL).any(axis=-1), height, np.nan)


def lines_with_window(low: float, high: float, first: float, last: float) -> Array:
    """Return grid lines (N,) [m]: those of the box from `low` to `high` [m], with `WINDOW_CELLS` cells more from `first` to `last`.

    Their number does not depend on places. A window that reaches beyond the box makes it larger.
    """
    low, high = min(low, first), max(high, last)
    ends = np.unique([low, high, first, last])
    middle = 0.5 * (ends[1:] + ends[:-1])
    density = np.full(len(middle), (INNER_LINES - 1) / (high - low))  # [1/m] of cells
    density += np.where((middle > first) & (middle < last), WINDOW_CELLS / (last - first), 0.0)
    before = np.concatenate([[0.0], np.cumsum(density * np.diff(ends))])
    inner = np.interp(np.linspace(0.0, before[-1], INNER_LINES + WINDOW_CELLS), before, ends)
    outer = grid_lines(low, high)
    return np.concatenate([outer[:OUTER_LINES], inner, outer[-OUTER_LINES:]])


def _even_lines(low: float, high: float, spacing: float) -> Array:
    cells = int(np.clip(round((high - low) / (CELL * spacing)), 1, MOST_LINES - 1))
    return np.linspace(low, high, cells + 1)


def _with_sides(lines: Array) -> Array:
    """Return grid lines [m] with one more beside the first and the last."""
    offset = SIDE * (lines[-1] - lines[0])
    return np.concatenate([[lines[0] - offset], lines, [lines[-1] + offset]])

"""Whitecaps on a drawn sea: as much of it is white as the wind makes, and where waves break. They are drawn, no run models them."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter, map_coordinates, zoom

from recordings.model.surface import SurfaceFrame
from recordings.pictures.raster import FINER, on_grid

Floats = npt.NDArray[np.floating]
_ONSET = 3.4  # [m/s] of wind from which there are whitecaps: Beaufort 3 (WMO)
_NODES = 512  # of the pattern, to each side, after which it repeats
_NODE = 0.5  # [m] between them
_LENGTHS = (0.5, 1.5)  # [m] of whitecaps along the wind and across it; chosen
_FINE = 2.7  # times as fine: the pattern that makes edges ragged, and repeats elsewhere
_FINE_PART = 0.3  # of its variance
_STILL = 1e-6  # [m, 1] least standard deviation of heights and slopes that is no still sea
_BY_WAVES = 0.6  # correlation of foam with the drawn waves; the rest is by waves too short to be drawn; chosen
_CREST_SPEED = 0.5  # of breaking waves, in speeds of the wind; chosen
_EDGES = np.array(
    [1.756, 0.5]
)  # white shares where foam begins and is whole; their logarithmic mean is 1, because tails fall exponentially


def white_share(speed: float) -> float:
    """Return the share of an open sea [1] that is white in a wind [m/s] at 10 m: 3.84e-6 U^3.41 (Monahan and O'Muircheartaigh 1980)."""
    return min(3.84e-6 * speed**3.41, 1.0) if speed >= _ONSET else 0.0


def whitecaps(surface: SurfaceFrame, wind: Floats, time: float, places: Floats, pixels: Floats) -> Floats:
    """Return how white (K,) [1] the sea is at places (K, 2) [m], seen through pixels that are (K,) [m] long there.

    Foam lies before the crests of the drawn waves, in patches across the wind (2,) [m/s] that run with it for a `time` [s]. Pixels
    longer than a patch share its white with the water round it.
    """
    speed = float(np.hypot(*wind))
    share = white_share(speed)
    if share == 0.0 or not len(places):
        return np.zeros(len(places))
    along = wind / speed
    axes = np.array([along, [-along[1], along[0]]])
    nodes = (places @ axes.T - [_CREST_SPEED * speed * time, 0.0]) / _NODE
    pattern = np.sqrt(1.0 - _FINE_PART) * _sample(nodes) + np.sqrt(_FINE_PART) * _sample(_FINE * nodes)
    waves, part = _before_crests(surface, along, places)
    breaking = _BY_WAVES * waves + np.sqrt(1.0 - (_BY_WAVES * part) ** 2) * pattern
    bare, whole = np.quantile(breaking, np.maximum(1.0 - share * _EDGES, 0.0))
    foam = np.clip((breaking - bare) / max(whole - bare, _STILL), 0.0, 1.0)
    return np.asarray(share + np.minimum(_LENGTHS[0] / pixels, 1.0) * (foam - share))


def _before_crests(surface: SurfaceFrame, along: Floats, places: Floats) -> tuple[Floats, Floats]:
    """Return how much places (K, 2) [m] lie before crests, by height and fall along the wind (2,), and how well waves are seen there.

    The first (K,) is in standard deviations where waves are seen well, and 0 where they are not, or none are.
    """
    seen, height, *slopes = surface.waves
    fall = -along[0] * slopes[0] - along[1] * slopes[1]
    before = np.zeros_like(seen)
    for one in (height, fall):
        away = one - np.average(one, weights=seen)
        before += away / max(float(np.average(away**2, weights=seen)) ** 0.5, _STILL)
    before *= seen * np.sqrt(0.5)
    return on_grid(surface, zoom(before, FINER), places), on_grid(surface, seen, places)


@cache
def _pattern() -> Floats:
    """Return a smooth random pattern (N, N) of variance 1 that goes on over its edges: rows along the wind, columns across it."""
    noise = np.random.default_rng(1).normal(size=(_NODES, _NODES))
    smooth = gaussian_filter(noise, [length / _NODE for length in _LENGTHS], mode="wrap")
    return np.asarray(smooth / smooth.std())


def _sample(nodes: Floats) -> Floats:
    """Return the pattern (K,) between its nodes at (K, 2)."""
    return np.asarray(map_coordinates(_pattern(), nodes.T, order=1, mode="grid-wrap"))

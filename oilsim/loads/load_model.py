"""Description of a floating body for loads without particles: parts that displace water, and stations that are dragged.

All in the body's own axes, with the origin at its centre of mass. A part is a closed piece of the body's mesh, short against the waves:
a segment of a boom, a strip of a hull. A station is a place with areas on which water or wind presses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """A piece of a body that displaces water.

    triangles      (T, 3, 3) [m] closed surface, outward
    added_mass     (3,) [kg] along the body's axes, at the design waterline
    wave_damping   (3,) [kg/s] along the body's axes, at the design waterline: force by relative speed, from the waves that it makes
    design_volume  [m3] wetted at the design waterline: added mass and damping fade with the wetted volume below it
    """

    triangles: Array
    added_mass: Array
    wave_damping: Array
    design_volume: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Station:
    """A place of a body on which moving water and air press.

    place        (3,) [m]
    drag_area    (3,) [m2] C_d A of water along each of the body's axes, fully wetted
    wind_area    (3,) [m2] C_d A of air along each of the body's axes, fully dry
    half_height  [m] half the vertical extent of these areas, over which a station gets wet
    """

    place: Array
    drag_area: Array
    wind_area: Array
    half_height: float


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadModel:
    """Parts and stations of one body; ValueError for a part with no volume, or numbers that are not finite."""

    parts: tuple[Part, ...]
    stations: tuple[Station, ...] = ()

    def __post_init__(self) -> None:
        for index, part in enumerate(self.parts):
            numbers = (part.triangles, part.added_mass, part.wave_damping)
            if not all(np.isfinite(values).all() for values in numbers):
                raise ValueError(f"loads: part {index} has numbers that are not finite, allowed: finite numbers")
            if not part.design_volume > 0.0:
                raise ValueError(
                    f"loads: part {index} wets {part.design_volume:g} m3 at the design waterline, allowed: above 0 m3"
                )


class StackedParts(NamedTuple):
    """Parts of all bodies, see `Part`: body (P,), first (P + 1,) triangle, triangles (T, 3, 3), center (P, 3) [m] of the part's bounds."""

    body: Ints
    first: Ints
    triangles: Array
    center: Array
    added_mass: Array
    wave_damping: Array
    design_volume: Array


class StackedStations(NamedTuple):
    """Stations of all bodies, see `Station`: body (S,), place (S, 3) [m], drag_area, wind_area (S, 3) [m2], half_height (S,) [m]."""

    body: Ints
    place: Array
    drag_area: Array
    wind_area: Array
    half_height: Array


def stacked_parts(models: Sequence[LoadModel]) -> StackedParts:
    """Return the parts of all bodies as arrays."""
    parts = [(index, part) for index, model in enumerate(models) for part in model.parts]
    counts = [len(part.triangles) for _, part in parts]
    return StackedParts(
        body=np.array([index for index, _ in parts], dtype=np.int64),
        first=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        triangles=np.concatenate([part.triangles for _, part in parts]) if parts else np.zeros((0, 3, 3)),
        center=np.array(
            [0.5 * (part.triangles.min(axis=(0, 1)) + part.triangles.max(axis=(0, 1))) for _, part in parts]
        ).reshape(-1, 3),
        added_mass=np.array([part.added_mass for _, part in parts], dtype=np.float64).reshape(-1, 3),
        wave_damping=np.array([part.wave_damping for _, part in parts], dtype=np.float64).reshape(-1, 3),
        design_volume=np.array([part.design_volume for _, part in parts], dtype=np.float64),
    )


def stacked_stations(models: Sequence[LoadModel]) -> StackedStations:
    """Return the stations of all bodies as arrays."""
    stations = [(index, station) for index, model in enumerate(models) for station in model.stations]
    return StackedStations(
        body=np.array([index for index, _ in stations], dtype=np.int64),
        place=np.array([station.place for _, station in stations], dtype=np.float64).reshape(-1, 3),
        drag_area=np.array([station.drag_area for _, station in stations], dtype=np.float64).reshape(-1, 3),
        wind_area=np.array([station.wind_area for _, station in stations], dtype=np.float64).reshape(-1, 3),
        half_height=np.array([station.half_height for _, station in stations], dtype=np.float64),
    )

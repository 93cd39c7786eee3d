"""Description of a floating body for loads without particles: parts that displace water, and stations that are dragged.

All along the model's axes, which are the body's own or turned from them, with the origin at the body's centre of mass. A part is a closed
piece of the body's mesh, short against the waves: a segment of a boom, a strip of a hull, a cell of a crate. A station is a place with
areas on which water or wind presses; they press on the skin of a part, too, where it has one.

Added mass and wave damping of a floating section, per metre of its length.

A section of beam B and draft T that is half an ellipse, afloat in deep water (Newman 1977, Marine Hydrodynamics, sections 4.13 and 6.18):

    heave  a_33 = rho pi / 8 B^2   the limit of fast motion, where the surface has the pressure of air
    sway   a_22 = rho pi / 2 T^2   the limit of slow motion, where the surface acts as a wall; a plate has the same

Between these limits added mass depends on the frequency: that of a half-immersed cylinder in heave falls to 0.6 of the limit
about k B / 2 = 0.8. The limits are used at every frequency.

The waves that a section sends out take away energy. With A the height of the waves over that of the motion,
b_33 = rho g^2 A^2 / omega^3, and A = 2 sin(k B / 2) exp(-k T), k = omega^2 / g (Yamamoto, Fujino and Fukasawa 1980).

Wrenches of forces that act beside the centre of mass.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from oilsim.backend.arrays import Array, Ints
from oilsim.backend.jit import njit
from oilsim.core.physical_constants import GRAVITY


@njit(nogil=True, cache=True, error_model="numpy")
def add_force_at(wrench: Array, arm: Array, force: Array) -> None:
    """Add `force` (3,) [N] at `arm` (3,) [m] from the centre of mass to a wrench (6,) [N, N m] about it."""
    for axis in range(3):
        after, before = (axis + 1) % 3, (axis + 2) % 3
        wrench[axis] += force[axis]
        wrench[3 + axis] += arm[after] * force[before] - arm[before] * force[after]


def heave_added_mass(density: float, beam: float) -> float:
    """Return a_33 [kg/m] of a section of `beam` [m] in water of `density` [kg/m3]."""
    return density * math.pi / 8.0 * beam**2


def sway_added_mass(density: float, draft: float) -> float:
    """Return a_22 [kg/m] of a section of `draft` [m] in water of `density` [kg/m3]."""
    return density * math.pi / 2.0 * draft**2


def heave_wave_damping(density: float, beam: float, draft: float, frequency: float) -> float:
    """Return b_33 [kg/s per m] of a section of `beam` and `draft` [m] that heaves at `frequency` [rad/s]."""
    wave_number = frequency**2 / GRAVITY
    height = 2.0 * math.sin(min(0.5 * wave_number * beam, 0.5 * math.pi)) * math.exp(-wave_number * draft)
    return density * GRAVITY**2 * height**2 / frequency**3


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """A piece of a body that displaces water.

    triangles      (T, 3, 3) [m] closed surface, outward
    added_mass     (3,) [kg] along the model's axes, at the design waterline
    wave_damping   (3,) [kg/s] along the model's axes, at the design waterline: force by relative speed, from the waves that it makes
    design_volume  [m3] wetted at the design waterline: added mass and damping fade with the wetted volume below it
    plate          foot and draft [m] of a plate whose added mass is that along the model's second axis: its foot's place along the third
                   axis, and its depth at the design waterline; None: it is the volume's
    skin           (N, 3, 3) [m] pieces of the body's own surface, outward, on which water and air press and rub
    skin_drag      (2,) [1] C_n of the flow across the skin and C_f of that along it
    """

    triangles: Array
    added_mass: Array
    wave_damping: Array
    design_volume: float
    plate: tuple[float, float] | None = None
    skin: Array = field(default_factory=lambda: np.zeros((0, 3, 3)))
    skin_drag: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Station:
    """A place of a body on which moving water and air press.

    place        (3,) [m]
    drag_area    (3,) [m2] C_d A of water along each of the model's axes, fully wetted
    wind_area    (3,) [m2] C_d A of air along each of the model's axes, fully dry
    half_height  [m] half the vertical extent of these areas, over which a station gets wet
    """

    place: Array
    drag_area: Array
    wind_area: Array
    half_height: float


@dataclass(frozen=True, kw_only=True, eq=False)
class LoadModel:
    """Parts and stations of one body; ValueError for a part with no volume, or numbers that are not finite.

    axes  (3, 3) [1] the model's axes, one a column, along the body's axes
    """

    parts: tuple[Part, ...]
    stations: tuple[Station, ...] = ()
    axes: Array = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        for index, part in enumerate(self.parts):
            numbers = (part.triangles, part.added_mass, part.wave_damping, part.skin)
            if not all(np.isfinite(values).all() for values in numbers):
                raise ValueError(f"loads: part {index} has numbers that are not finite, allowed: finite numbers")
            if not part.design_volume > 0.0:
                raise ValueError(
                    f"loads: part {index} wets {part.design_volume:g} m3 at the design waterline, allowed: above 0 m3"
                )


class StackedParts(NamedTuple):
    """Parts of all bodies, see `Part`: body (P,), first (P + 1,) triangle, triangles (T, 3, 3), center (P, 3) [m] of the part's bounds.

    plate (P, 2) [m]: foot and draft, the draft 0 without one.
    """

    body: Ints
    first: Ints
    triangles: Array
    center: Array
    added_mass: Array
    wave_damping: Array
    design_volume: Array
    plate: Array


class StackedStations(NamedTuple):
    """Stations of all bodies, see `Station`: body (S,), place (S, 3) [m], drag_area, wind_area (S, 3) [m2], half_height (S,) [m]."""

    body: Ints
    place: Array
    drag_area: Array
    wind_area: Array
    half_height: Array


class StackedSkin(NamedTuple):
    """Skins of all parts, see `Part`: part (N,), corners (N, 3, 3) and center (N, 3) [m], normal (N, 3), area (N,) [m2], drag (P, 2)."""

    part: Ints
    corners: Array
    center: Array
    normal: Array
    area: Array
    drag: Array


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
        plate=np.array([part.plate or (0.0, 0.0) for _, part in parts], dtype=np.float64).reshape(-1, 2),
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


def stacked_skin(models: Sequence[LoadModel]) -> StackedSkin:
    """Return the skins of all parts of all bodies as arrays, without pieces that have no area."""
    parts = [part for model in models for part in model.parts]
    corners = np.concatenate([np.zeros((0, 3, 3)), *(part.skin for part in parts)])
    owner = np.repeat(np.arange(len(parts), dtype=np.int64), [len(part.skin) for part in parts])
    twice = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(twice, axis=1)
    kept = size > 0.0
    return StackedSkin(
        part=owner[kept],
        corners=np.ascontiguousarray(corners[kept]),
        center=corners[kept].mean(axis=1),
        normal=twice[kept] / size[kept, None],
        area=0.5 * size[kept],
        drag=np.array([part.skin_drag for part in parts], dtype=np.float64).reshape(-1, 2),
    )

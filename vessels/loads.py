"""Loads of a sea on a hull without particles, strip by strip.

The mesh is cut across into strips that are short against the waves. Each carries its own buoyancy and wave pressure, the added mass and
wave damping of its section (`oilsim.loads.load_model`), cross-flow drag in sway and heave, and wind. Along the hull acts
friction by the line of the ITTC 1957 with a form factor. What a vessel under way feels besides, is in `vessels.hull_forces`.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import trimesh

from coupling.solids.hydrostatics import hydrostatics
from oilsim.core.physical_constants import GRAVITY
from oilsim.loads.load_model import LoadModel, Part, Station, heave_added_mass, heave_wave_damping, sway_added_mass
from vessels.hull import Hull

# [1] strips along a hull; numerical; 15 m of hull in waves of 12 m leave 8 strips a wave
STRIPS = 10
# [1] surge: share of the displacement that is carried along; paper (Brix 1993, Manoeuvring Technical Manual: 0.03 to 0.06)
SURGE = 0.05
# [1] drag of a section across; paper (Faltinsen 1990, Sea Loads on Ships, section 6.4: 0.8 to 1.2 for ships)
CROSS_FLOW = 1.0
# [1] drag of freeboard and deck house in wind from the side, from ahead; paper (Isherwood 1973: 0.8 to 1.1 and 0.7 to 0.9)
WIND_ACROSS, WIND_ALONG = 1.0, 0.8
# [1] form factor on friction; paper (ITTC 7.5-02-02-02: 0.1 to 0.3)
FORM = 0.2
# [m2/s] kinematic viscosity of sea water; paper (ITTC 7.5-02-01-03); 15 degrees C
VISCOSITY = 1.19e-6
# [m/s] speed at which friction is evaluated; numerical; from 0.5 to 2 m/s the line's C_F changes by 25 %
FRICTION_SPEED = 1.0
# [B] of two stations of a strip from the centreline; theory; two Gauss points over the beam
GAUSS = 0.5 / math.sqrt(3.0)


@dataclass(frozen=True, kw_only=True)
class _Section:
    """A strip: closed mesh, its length, and beam and draft at the waterline [m], middle and displaced volume [m, m3]."""

    mesh: trimesh.Trimesh
    length: float
    beam: float
    draft: float
    middle: float
    volume: float


def ittc_friction(speed: float, length: float) -> float:
    """Return C_F [1] of the ITTC 1957 line, 0.075 / (log10 Re - 2)^2, at `speed` [m/s] over `length` [m]."""
    return 0.075 / (math.log10(speed * length / VISCOSITY) - 2.0) ** 2


def hull_loads(hull: Hull) -> LoadModel:
    """Return the load model of a hull cut into `STRIPS`."""
    sections = _sections(hull)
    density, displaced = hull.water_density, hull.hydrostatics.displaced_volume
    carried = sum(heave_added_mass(density, section.beam) * section.length for section in sections)
    stiffness = density * GRAVITY * hull.hydrostatics.waterplane_area
    frequency = math.sqrt(stiffness / (hull.mass_properties.mass + carried))
    friction = (1.0 + FORM) * ittc_friction(FRICTION_SPEED, hull.length) * wetted_area(hull)
    parts = tuple(_part(section, density, frequency) for section in sections)
    stations = [
        station for section in sections for station in _stations(section, hull, friction * section.volume / displaced)
    ]
    return LoadModel(parts=parts, stations=tuple(stations))


def with_superstructure(model: LoadModel, area: float, drag: float, center: tuple[float, float, float]) -> LoadModel:
    """Return the load model of a hull with what stands on its deck in the wind, the same from every side.

    area [m2] and its drag coefficient; center (3,) [m] in the body frame.
    """
    above = Station(
        place=np.array(center),
        drag_area=np.zeros(3),
        wind_area=drag * area * np.array([1.0, 1.0, 0.0]),
        half_height=0.5 * math.sqrt(area),
    )
    return LoadModel(parts=model.parts, stations=(*model.stations, above))


def _sections(hull: Hull) -> tuple[_Section, ...]:
    """Cut the hull across; strips that stay dry at the design waterline are joined to none and left to the weight of the hull."""
    vertices, faces = np.asarray(hull.mesh.vertices, np.float64), np.asarray(hull.mesh.faces, np.int64)
    return _cut(vertices.tobytes(), faces.tobytes(), hull.waterline)


@lru_cache(
    maxsize=32
)  # a cut hull takes a tenth of a second, and a check, a run and those of a sweep have the same ones
def _cut(vertices: bytes, faces: bytes, waterline: float) -> tuple[_Section, ...]:
    """Cut the mesh of these vertices (V, 3) and faces (F, 3), as bytes of float64 and int64."""
    places, corners = np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(faces, np.int64).reshape(-1, 3)
    whole = trimesh.Trimesh(places, corners, process=False)
    low, high = whole.bounds[:, 0]
    edges = np.linspace(low, high, STRIPS + 1)
    found = []
    for aft, fore in itertools.pairwise(edges):
        mesh = whole
        for point, normal in ((aft, 1.0), (fore, -1.0)):
            if point not in (low, high):
                mesh = trimesh.intersections.slice_mesh_plane(mesh, (normal, 0.0, 0.0), (point, 0.0, 0.0), cap=True)
        wet = mesh.vertices[mesh.vertices[:, 2] <= waterline + 1e-9]
        if len(wet) == 0:
            continue
        afloat = hydrostatics(mesh, waterline)
        length = float(fore - aft)
        found.append(
            _Section(
                mesh=mesh,
                length=length,
                beam=afloat.waterplane_area / length,
                draft=waterline - float(wet[:, 2].min()),
                middle=float(0.5 * (aft + fore)),
                volume=afloat.displaced_volume,
            )
        )
    return tuple(found)


def _part(section: _Section, density: float, frequency: float) -> Part:
    added = (
        SURGE * density * section.volume,
        sway_added_mass(density, section.draft) * section.length,
        heave_added_mass(density, section.beam) * section.length,
    )
    damping = heave_wave_damping(density, section.beam, section.draft, frequency) * section.length
    return Part(
        triangles=np.array(section.mesh.triangles, dtype=np.float64),
        added_mass=np.array(added),
        wave_damping=np.array([0.0, 0.0, damping]),
        design_volume=section.volume,
    )


def _stations(section: _Section, hull: Hull, friction: float) -> list[Station]:
    """Return the stations of a strip: two at the bilges and one on the freeboard; friction: C A [m2] along the hull."""
    freeboard = hull.depth - hull.draft
    side = CROSS_FLOW * section.draft * section.length
    bottom = CROSS_FLOW * section.beam * section.length
    bilges = [
        Station(
            place=np.array([section.middle, across * section.beam, hull.waterline - 0.5 * section.draft]),
            drag_area=0.5 * np.array([friction, side, bottom]),
            wind_area=np.zeros(3),
            half_height=0.5 * section.draft,
        )
        for across in (-GAUSS, GAUSS)
    ]
    windage = np.array([WIND_ALONG * section.beam * section.length / hull.length, WIND_ACROSS * section.length, 0.0])
    above = Station(
        place=np.array([section.middle, 0.0, hull.waterline + 0.5 * freeboard]),
        drag_area=np.zeros(3),
        wind_area=freeboard * windage,
        half_height=0.5 * freeboard,
    )
    return [*bilges, above]


def wetted_area(hull: Hull) -> float:
    """Return the area [m2] of the hull below its design waterline."""
    below = trimesh.intersections.slice_mesh_plane(hull.mesh, (0.0, 0.0, -1.0), (0.0, 0.0, hull.waterline))
    return float(below.area)

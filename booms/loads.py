"""Loads of a sea on a boom's segment without particles.

The segment's mesh as built carries buoyancy and wave pressure. Added mass is that of its section (`oilsim.loads.load_model`):
the skirt is a plate of full draft in sway, whatever of the float is wet, the float half an ellipse in heave. Water drags the skirt with
C_d = 1.88, the rule 26 A V^2 of the US Navy (F in kgf, V in knots), and along it with skin friction; wind presses on the freeboard with
the coefficient of the rule 26 A (V / 40)^2.
"""

from __future__ import annotations

import math

import numpy as np

from booms.boom import Boom
from booms.segments import BoomSegment
from oilsim.core.physical_constants import AIR_DENSITY, GRAVITY, KNOT, STANDARD_GRAVITY
from oilsim.loads.load_model import LoadModel, Part, Station, heave_added_mass, heave_wave_damping, sway_added_mass

# [kgf/(m2 kn2)] force of water on a skirt; paper (US Navy Ship Salvage Manual, volume 6, appendix E)
NAVY_RULE = 26.0
# [1] speed of wind that presses as water does at speed 1; paper (the same)
NAVY_WIND = 40.0
# [1] skin friction of wetted fabric; paper (flat plate, ITTC-57 at Re 1e6 and a rough surface: 0.0044 to 0.008 a side)
FRICTION = 0.0075
# [1] drag of a float across its axis; paper (circular cylinder, subcritical; Hoerner 1965)
FLOAT_DRAG = 1.1
# [L] of two Gauss points on a segment from its middle; theory; integrates a load quadratic along it
GAUSS = 0.5 / math.sqrt(3.0)
# stations over the draft; numerical; the moment of a plate's drag to 4 % at any lean
LEVELS = 3


def skirt_drag(water_density: float) -> float:
    """Return C_d of the Navy's rule [1] in water of `water_density` [kg/m3]: 1.88 in sea water."""
    return NAVY_RULE * STANDARD_GRAVITY / (0.5 * water_density * KNOT**2)


def freeboard_drag() -> float:
    """Return C_d of the Navy's rule for the freeboard in wind [1]: 0.98."""
    return NAVY_RULE * STANDARD_GRAVITY / (0.5 * AIR_DENSITY * (NAVY_WIND * KNOT) ** 2)


def segment_loads(segment: BoomSegment, boom: Boom) -> LoadModel:
    """Return the load model of a boom's segment as built, with two stations along it at each of several heights."""
    length, density = boom.segment_length, boom.water_density
    added = (
        np.array([0.0, sway_added_mass(density, boom.skirt_depth), heave_added_mass(density, boom.float_width)])
        * length
    )
    mass = segment.mass_properties.mass + added[2]
    frequency = math.sqrt(density * GRAVITY * segment.hydrostatics.waterplane_area / mass)
    damping = heave_wave_damping(density, boom.float_width, boom.float_draft, frequency) * length
    part = Part(
        triangles=np.array(segment.mesh.triangles, dtype=np.float64),
        added_mass=added,
        wave_damping=np.array([0.0, 0.0, damping]),
        design_volume=segment.hydrostatics.displaced_volume,
        plate=(segment.waterline - boom.skirt_depth, boom.skirt_depth),
    )
    stations = [station for side in (-GAUSS, GAUSS) for station in _stations(segment, boom, side * length)]
    return LoadModel(parts=(part,), stations=tuple(stations))


def _stations(segment: BoomSegment, boom: Boom, along: float) -> list[Station]:
    """Return the stations of half a segment: over the draft, and the freeboard above them."""
    half, height = 0.5 * boom.segment_length, boom.skirt_depth / LEVELS
    friction, normal = 2.0 * FRICTION, skirt_drag(boom.water_density)
    skirt = [
        Station(
            place=np.array([along, 0.0, segment.waterline - (level + 0.5) * height]),
            drag_area=np.array(
                [
                    friction * height * half,
                    normal * height * half,
                    FLOAT_DRAG * boom.float_width * half / LEVELS,
                ]
            ),
            wind_area=np.array([0.0, freeboard_drag() * height * half, 0.0]),
            half_height=0.5 * height,
        )
        for level in range(LEVELS)
    ]
    dry = boom.freeboard * half
    freeboard = Station(
        place=np.array([along, 0.0, segment.waterline + 0.5 * boom.freeboard]),
        drag_area=np.array([friction * dry, normal * dry, 0.0]),
        wind_area=np.array([friction * dry, freeboard_drag() * dry, 0.0]),
        half_height=0.5 * boom.freeboard,
    )
    return [*skirt, freeboard]

"""The registry of cases, by number."""

from __future__ import annotations

from tests.validation.bodies.boom_in_waves import BOOM_IN_WAVES
from tests.validation.bodies.boom_losses import BOOM_LOSSES, BOOM_RAMP
from tests.validation.bodies.boom_slice import BOOM_HELD_OUT, BOOM_ROUNDING, BOOM_SLICE
from tests.validation.bodies.floating import ARCHIMEDES, SUBMERGED
from tests.validation.bodies.flumes.boom_flume import BOOM_FLUME
from tests.validation.bodies.flumes.floating_boom import FLOATING_BOOM
from tests.validation.bodies.flumes.harbour_flume import HARBOUR_FLUME
from tests.validation.bodies.nested_window import NESTED_WINDOW
from tests.validation.bodies.released import HEAVE_DECAY, HEAVE_IN_SPACE, PLANE_RELEASE, RELEASE, SURFACING
from tests.validation.bodies.towed_cylinder import TOWED_CYLINDER
from tests.validation.bodies.towing import TOWED_PLATE, TOWED_SKIRT
from tests.validation.bodies.wave_flume import WAVE_FLUME
from tests.validation.bodies.window_agreement import WINDOW_AGREEMENT
from tests.validation.bodies.without_particles import WITHOUT_PARTICLES
from tests.validation.case import Case
from tests.validation.liquids.channel import LAYERED, START_UP
from tests.validation.liquids.corner_jet import CORNER_JET
from tests.validation.liquids.dam_break import DAM_FRONT, DAM_PRESSURE
from tests.validation.liquids.drop import CONSERVATION, ELLIPTICAL_DROP
from tests.validation.liquids.hydrostatics import STILL_COLUMN
from tests.validation.liquids.interfaces import LOCK_EXCHANGE, RAYLEIGH_TAYLOR
from tests.validation.liquids.planar_slick import PLANAR_SLICK
from tests.validation.liquids.spreading import OIL_SLICK, VISCOUS_CURRENT
from tests.validation.liquids.tension.between_liquids import INTERFACE_SHEAR, INTERFACIAL_DROP, RISING_BUBBLE
from tests.validation.liquids.tension.contact_angle import CONTACT_ANGLE
from tests.validation.liquids.tension.drop_in_air import DROP_IN_AIR
from tests.validation.liquids.tension.front_in_air import FRONT_IN_AIR
from tests.validation.liquids.thick_liquid import SETTLING_SPHERE, THICK_REST, THICK_TOW
from tests.validation.liquids.two_layers import TWO_LAYERS
from tests.validation.liquids.viscous import INVISCID_SHEAR, SHEAR_WAVE, TAYLOR_GREEN
from tests.validation.liquids.wave_drift import WAVE_DRIFT
from tests.validation.liquids.waves import INTERFACE_WAVE, STANDING_WAVE
from tests.validation.liquids.window_rim import WINDOW_RIM
from tests.validation.paper.rock import PAPER_ROCK
from tests.validation.paper.spreading import PAPER_CALM, PAPER_WIND
from tests.validation.paper.timing import PAPER_TIMING

CASES: tuple[Case, ...] = tuple(
    sorted(
        (
            STILL_COLUMN, TWO_LAYERS, CONSERVATION, SHEAR_WAVE, INVISCID_SHEAR, START_UP, LAYERED, ELLIPTICAL_DROP, TAYLOR_GREEN,
            STANDING_WAVE, DAM_FRONT, DAM_PRESSURE, INTERFACE_WAVE, RAYLEIGH_TAYLOR, LOCK_EXCHANGE, VISCOUS_CURRENT, OIL_SLICK,
            PLANAR_SLICK, ARCHIMEDES, SUBMERGED, RELEASE, PLANE_RELEASE, SURFACING, BOOM_IN_WAVES, HEAVE_DECAY, HEAVE_IN_SPACE, TOWED_PLATE,
            TOWED_SKIRT, TOWED_CYLINDER, BOOM_FLUME, BOOM_LOSSES, BOOM_RAMP, BOOM_SLICE, BOOM_ROUNDING, HARBOUR_FLUME, BOOM_HELD_OUT,
            THICK_REST, SETTLING_SPHERE, WAVE_DRIFT, WITHOUT_PARTICLES, WINDOW_RIM, WINDOW_AGREEMENT, INTERFACIAL_DROP, RISING_BUBBLE,
            INTERFACE_SHEAR, CONTACT_ANGLE, DROP_IN_AIR, FRONT_IN_AIR, WAVE_FLUME, THICK_TOW, CORNER_JET, FLOATING_BOOM, NESTED_WINDOW,
            PAPER_CALM, PAPER_WIND, PAPER_ROCK, PAPER_TIMING,
        ),
        key=lambda case: case.number,
    )
)  # fmt: skip


def select(names: str) -> list[Case]:
    """The cases named or numbered in a comma-separated list, all for an empty one; ValueError for one that does not exist."""
    wanted = [name.strip() for name in names.split(",") if name.strip()]
    known = {case.name: case for case in CASES} | {str(case.number): case for case in CASES}
    for name in wanted:
        if name not in known:
            raise ValueError(f"case {name!r} does not exist, allowed: {', '.join(case.name for case in CASES)}")
    return [case for case in CASES if not wanted or case.name in wanted or str(case.number) in wanted]


# gates, by case and quantity, that the finest spacing is known to miss; docs/known-errors.md has the reasons
KNOWN_MISSES = frozenset(
    {
        ("still-column", "the same, off its lattice"),
        ("inviscid-shear", "growth of it from dt to dt/4, / (U d)"),
        ("dam-break-front", "rms, Martin and Moyce, a = 1.125 in"),
        ("dam-break-pressure", "impulse / measured, 80 mm"),
        ("interface-wave", "period"),
        ("interface-shear", "largest speed over the first, tension 1.5 of the cut-off's"),
        ("interfacial-drop", "unrest"),
        ("oil-slick", "exponent"),
        ("towed-plate", "drag coefficient"),
        ("towed-skirt", "exponent of speed"),
        ("settling-sphere", "largest speed at Re 1.5 / measured"),
        ("settling-sphere", "largest speed at Re 31.9 / measured"),
        ("boom-ramp", "speed of the first loss"),
        ("paper-calm", "axis ratio before the sides, paper's scheme"),
        ("paper-wind", "width over length along the wind, paper's scheme"),
        ("paper-wind", "width over length along the wind, split scheme"),
        ("window-agreement", "shape, in an outer one"),
        ("nested-window", "wave that comes back, nested"),
        *(
            ("window-agreement", f"tension, {place}")
            for place in ("on the apex", "1 m upstream", "a third larger", "around the U")
        ),
    }
)

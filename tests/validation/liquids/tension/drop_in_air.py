"""Case 55: a drop of water in air, whose surface has tension because air fills the box."""

from __future__ import annotations

import math

from oilsim import Phase
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity
from tests.validation.liquids.tension.drops import DISORDER, RESTING, STRETCH, SWINGS, Drop, rest, swing

RADIUS = 0.005  # m
AIR = Phase(
    name="air", rest_density=10.0, dynamic_viscosity=1e-3, interfacial_tension=0.0728
)  # water's tension at 20 C
THICK, THIN = 0.05, 0.01  # Pa s: of the drop at rest, and of the one that swings


def water_drop(viscosity: float) -> Drop:
    """A drop of `viscosity` [Pa s], with the density of water, in air."""
    return Drop(Phase(name="water", rest_density=1000.0, dynamic_viscosity=viscosity), AIR, RADIUS)


def drop_in_air(resolution: int, bench: Bench) -> Outcome:
    """Case 55: Laplace's pressure and unrest of a drop at rest, period and decay of one that swings."""
    still, loose = water_drop(THICK), water_drop(THIN)
    bench.plan(RESTING * still.capillary_time + SWINGS * 2.0 * math.pi / loose.swinging(2).imag)
    pressure, unrest, wind = rest(bench, still, resolution)
    values, traces = swing(bench, loose, resolution)
    values |= {"pressure over Laplace's": pressure, "unrest of the water": unrest, "unrest of the air": wind}
    return Outcome(values=values, traces=traces)


DROP_IN_AIR = Case(
    number=55,
    name="drop-in-air",
    title="A drop of water in air, held together by surface tension",
    source="Laplace's pressure sigma / R; exact rate of small swings of viscous drops (`Drop.swinging`), which is Lamb's 1932, art. 275, "
    "without viscosity",
    setup=f"plane drop of radius {RADIUS:g} m, 1000 kg/m3, in air of {AIR.rest_density:g} kg/m3 and {AIR.dynamic_viscosity:g} Pa s, "
    f"sigma {AIR.interfacial_tension:g} N/m, without weight, in a box of 6 R that repeats. At rest: {THICK:g} Pa s, particles "
    f"disordered by {DISORDER:g} d, {RESTING:g} sqrt(rho R^3 / sigma). Swinging: {THIN:g} Pa s, axes {100 * STRETCH:g} % from the radius, "
    f"{SWINGS:g} periods",
    length=RADIUS,
    length_symbol="R",
    resolutions=(8, 12, 16),
    spacings=2,
    quantities=(
        Quantity(name="pressure over Laplace's", unit="1", reference=1.0, gate=0.03),
        Quantity(name="unrest of the water", unit="sigma / mu", reference=0.0, scale=1.0, gate=1e-3),
        Quantity(name="unrest of the air", unit="sigma / mu", reference=0.0, scale=1.0),
        Quantity(name="period over theory", unit="1", reference=1.0, gate=0.03),
        Quantity(name="decay over theory", unit="1", reference=1.0),
    ),
    panels=(Panel("swing", "t / period", "(<x2> - <z2>) / (<x2> + <z2>)"),),
    run=drop_in_air,
    note="unrest is the fastest particle's speed, mean of the last two fifths. The air is eight times as heavy as real air and as thick as "
    "water: thinner air moves at speeds of its own beside the interface, and lighter air takes shorter steps (docs/numerics.md, Air). In "
    "real air the exact period is 1.1 % shorter.",
)

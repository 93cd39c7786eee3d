"""Case 20 in the plane: an oil slick in a channel, which can be followed further than a round one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from oilsim import Fluid, FluidConfig, block, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.liquids.slicks import REDUCED, SHARE, follow, launch
from tests.validation.measure import power_law
from tests.validation.scenes import GRAVITY, oil_and_water, position

Double = NDArray[np.float64]

AREA, FIRST_LENGTH, LAST_LENGTH = 1.0, 2.0, 8.0  # m2 of the whole slick; m, half of its length
DEPTH, SIDE = 4.0, 10.0  # m
# Self-similar slicks: u = 2 x / 3 t asks for the slope h' = 2 x / 9 Delta g t^2, and the front moves at Fr (Delta g h)^(1/2). One that
# keeps its energy over deep water has Fr^2 = 2 (von Karman 1940, Benjamin 1968), and the area gives
# L^3 = A Delta g t^2 / (8 / 9 Fr^2 - 4 / 27) = (3 / 2)^3 A Delta g t^2, Hoult's coefficient (1972).
COEFFICIENT = 1.5
STRENGTH = REDUCED * GRAVITY * AREA  # Delta g A [m3/s2]
FIRST_AGE, LAST_AGE = ((length / COEFFICIENT) ** 1.5 / math.sqrt(STRENGTH) for length in (FIRST_LENGTH, LAST_LENGTH))
LONGEST = 1.1 * LAST_AGE  # s; the front is late by what it loses while its head forms
FITTED = 1.5 * FIRST_LENGTH  # m, half length from which on the fit counts
READING = 0.05  # s between readings


def self_similar_thickness(x: Double) -> Double:
    """Thickness [m] at x [m] from the middle of the self-similar slick of FIRST_AGE."""
    h = (2.0 * FIRST_LENGTH**2 - (FIRST_LENGTH**2 - x**2)) / (9.0 * REDUCED * GRAVITY * FIRST_AGE**2)
    return np.where(x < FIRST_LENGTH, h, 0.0)


def planar_slick(bench: Bench, spacing: float) -> tuple[Fluid, float]:
    """Half of a self-similar slick beside a wall that is its plane of symmetry, in motion; and the whole slick's area [m2]."""
    room = 4.0 * spacing
    fluid = bench.fluid(
        FluidConfig(
            particle_spacing=spacing, phases=oil_and_water(), dimension=2, lower=(-room, -1.0, -room),
            upper=(SIDE + room, 1.0, 1.3 * DEPTH),
        )
    )  # fmt: skip
    fluid.add_boundary(tank_walls((0, 0, 0), (SIDE, 0, 1.2 * DEPTH), spacing, sides=("-x", "+x", "-z"), dimension=2))
    points = block((0, 0, 0), (SIDE, 0, math.ceil(1.1 * DEPTH / spacing) * spacing), spacing, 2)
    thickness = self_similar_thickness(points[:, 0])
    count = launch(bench, fluid, points, thickness, DEPTH, (2.0 / (3.0 * FIRST_AGE), 0.0))  # u = 2 x / 3 t
    return fluid, 2.0 * count * spacing**2


def half_length(fluid: Fluid) -> float:
    """Half length [m] of the even slick that holds the same SHARE of the oil within the same distance."""
    return float(np.quantile(position(fluid)[0][fluid.particles.phase == 0], SHARE)) / SHARE


def oil_in_channel(resolution: int, bench: Bench) -> Outcome:
    """Case 20 in the plane: coefficient of a slick's length."""
    bench.plan(LONGEST - FIRST_AGE)
    fluid, area = planar_slick(bench, math.sqrt(AREA) / resolution)
    age, length = follow(bench, fluid, half_length, (FIRST_AGE, LONGEST), LAST_LENGTH, READING)
    strength, late = STRENGTH * area / AREA, length > FITTED
    slope, constant = np.polyfit(age[late], length[late] ** 1.5, 1)  # L^(3/2) = C^(3/2) (Delta g A)^(1/2) (t + t_0)
    straight = length[late] ** 1.5 / (slope * age[late] + constant) - 1.0
    return Outcome(
        values={
            "coefficient": float((slope**2 / strength) ** (1.0 / 3.0)),
            "L^(3/2) off a straight line, rms": float(np.sqrt(np.mean(straight**2))),
            "virtual origin": float(constant / slope),
            "power of the age": power_law(age[late], length[late])[0],
        },
        traces=(
            trace("length", age, length),
            trace("length", age, COEFFICIENT * (strength * age**2) ** (1.0 / 3.0), "1.5 (Delta g A t^2)^(1/3)", reference=True),
        ),
    )  # fmt: skip


PLANAR_SLICK = Case(
    number=20,
    name="planar-slick",
    title="Oil slick in a channel, gravity against inertia",
    source="Hoult 1972, L = 1.5 (Delta g A t^2)^(1/3), with the front of von Karman 1940 and Benjamin 1968, Fr^2 = 2",
    setup=f"half of a slick of 1 m2 of oil 840 on {DEPTH:g} m of sea water, inviscid, in a plane tank {SIDE:g} m long, from the "
    f"self-similar solution of that coefficient; half length L from {FIRST_LENGTH:g} to {LAST_LENGTH:g} m",
    length=math.sqrt(AREA),
    length_symbol="A^(1/2)",
    resolutions=(20, 30, 40),
    quantities=(
        Quantity(name="coefficient", unit="1", reference=COEFFICIENT, gate=0.1),
        Quantity(name="L^(3/2) off a straight line, rms", unit="1", reference=0.0, scale=1.0, gate=0.03),
        Quantity(name="virtual origin", unit="s", reference=0.0, scale=1.0),
        Quantity(name="power of the age", unit="1", reference=2.0 / 3.0, scale=1.0),
    ),
    panels=(Panel("length", "age t [s]", "L [m]", log_x=True, log_y=True),),
    run=oil_in_channel,
    note="fitted from 1.5 first lengths on. The front is held up while its head forms, and a power of the age tells of that as long as "
    "it is followed; the coefficient, of the slope of L^(3/2), does not depend on the origin.",
)

"""Cases 19 and 20: liquids that spread. A viscous gravity current on a floor, an oil slick on water."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import beta, gamma

from oilsim import Fluid, FluidConfig, block, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.liquids.slicks import REDUCED, SHARE, follow, launch
from tests.validation.measure import front_position, power_law
from tests.validation.scenes import (
    GRAVITY,
    SAMPLE,
    liquid,
    oil_and_water,
    position,
)

Double = NDArray[np.float64]

# viscous gravity current of constant volume (Huppert 1982, alpha = 0)
# eta_N = [ (1/5) (3/10)^(1/3) sqrt(pi) Gamma(1/3) / Gamma(5/6) ]^(-3/5) = 1.411
ETA = (0.2 * 0.3 ** (1.0 / 3.0) * math.sqrt(math.pi) * gamma(1.0 / 3.0) / gamma(5.0 / 6.0)) ** -0.6
AREA = 0.01  # m2
FIRST, LAST = 0.25, 0.375  # m, front at the start and at the end
START = 1.0  # s, age of the similarity solution at the start
END = START * (LAST / FIRST) ** 5
VISCOSITY = GRAVITY * AREA**3 * START / 3.0 * (ETA / FIRST) ** 5  # m2/s, from FIRST = eta_N (g A^3 START / 3 nu)^(1/5)
FILLED = 0.5 * beta(0.5, 4.0 / 3.0)  # integral of (1 - y^2)^(1/3) over 0 to 1
SETTLED = 1.1 * FIRST  # m, front from which on the fit counts


def similarity_profile(x: Double, front: float) -> Double:
    """Height [m] of the current at x [m], (1 - y^2)^(1/3) with y = x / front."""
    return AREA / (FILLED * front) * np.maximum(0.0, 1.0 - (x / front) ** 2) ** (1.0 / 3.0)


def current(bench: Bench, spacing: float) -> Fluid:
    """Half a current on a no-slip floor, beside a free-slip wall that is its plane of symmetry."""
    room, length, height = 4.0 * spacing, 0.5, 0.1
    oil = liquid(900.0, VISCOSITY, "oil")
    fluid = bench.fluid(
        FluidConfig(
            particle_spacing=spacing, phases=(oil,), dimension=2, lower=(-room, -1.0, -room), upper=(length, 1.0, height)
        )
    )  # fmt: skip
    walls = tank_walls((0, 0, 0), (length, 0, height), spacing, sides=("-x", "-z"), dimension=2)
    floor = walls.position[:, 2] < 0.0
    for chosen, no_slip in ((floor, True), (~floor, False)):
        name = "floor" if no_slip else "side"
        fluid.add_boundary(replace(walls.part(name, chosen), no_slip=no_slip))
    points = block((0, 0, 0), (LAST, 0, height), spacing, 2)
    inside = points[:, 2] < similarity_profile(points[:, 0], FIRST)
    fluid.add_particles(points[inside], phase="oil")
    return fluid


def viscous_current(resolution: int, bench: Bench) -> Outcome:
    """Case 19: exponent and coefficient of the front of half a constant area."""
    spacing = math.sqrt(AREA) / resolution
    bench.plan(END - START)
    fluid = current(bench, spacing)
    area = fluid.particle_count * spacing**2
    strength = GRAVITY * area**3 / (3.0 * VISCOSITY)
    rows = []
    for step in range(round((END - START) / SAMPLE)):
        bench.advance(fluid, SAMPLE)
        x, _, z = position(fluid)
        # <x^2> = front^2 B(3/2, 4/3) / B(1/2, 4/3) = 3/11 front^2 for the similarity profile
        moment = math.sqrt(11.0 / 3.0 * float((x**2).mean()))
        rows.append((START + (step + 1) * SAMPLE, front_position(x[z < 2.0 * spacing], spacing), moment))
    time, front, moment = np.array(rows).T
    late = front > SETTLED
    exponent = power_law(time[late], front[late])[0] if np.count_nonzero(late) > 10 else math.nan
    age, nodes = np.linspace(START, END, 100), np.linspace(0.0, LAST, 200)
    return Outcome(
        values={
            "exponent": exponent,
            "coefficient": float((front[late] / (strength * time[late]) ** 0.2).mean()) if late.any() else math.nan,
            "exponent, from the second moment": power_law(time[late], moment[late])[0] if late.any() else math.nan,
        },
        traces=(
            trace("front", time, front, "front"),
            trace("front", time, moment, "second moment"),
            trace("front", age, ETA * (strength * age) ** 0.2, "1.411 (g A^3 t / 3 nu)^(1/5)", reference=True),
            trace("shape", *_surface(fluid, spacing)),
            trace("shape", nodes, similarity_profile(nodes, LAST), "similarity solution at the end", reference=True),
        ),
    )


def _surface(fluid: Fluid, spacing: float) -> tuple[Double, Double]:
    """Height [m] of the current over x [m], from the area in columns two spacings wide."""
    x = position(fluid)[0]
    edges = np.arange(0.0, x.max() + 2.0 * spacing, 2.0 * spacing)
    return 0.5 * (edges[1:] + edges[:-1]), np.histogram(x, edges)[0] * spacing / 2.0


# oil slick, gravity against inertia
VOLUME, FIRST_RADIUS, LAST_RADIUS = 1.0, 1.0, 2.1  # m3, m
DEPTH, SIDE = 3.2, 2.8  # m
FAY = 1.14  # his coefficient, 1969
# Self-similar slicks (Hoult 1972): u = r / 2 t asks for the slope h' = r / 4 Delta g t^2, the front moves at Fr (Delta g h)^(1/2), and with
# the volume pi (1 / 4 Fr^2 - 1 / 16) R^4 / Delta g t^2 that of Fay's coefficient has Fr = 1.00.
INVERSE_FROUDE_SQUARED = 4.0 / (math.pi * FAY**4) + 0.25
SPREADING = math.sqrt(REDUCED * GRAVITY * VOLUME)  # (Delta g V)^(1/2) [m2/s]
FIRST_AGE, LAST_AGE = (radius**2 / (FAY**2 * SPREADING) for radius in (FIRST_RADIUS, LAST_RADIUS))
FITTED = 1.3 * FIRST_RADIUS  # m, radius from which on the fit counts
READING = 0.02  # s between readings


def self_similar_thickness(r: Double) -> Double:
    """Thickness [m] at radius r [m] of the self-similar slick of FIRST_AGE."""
    scale = 4.0 * REDUCED * GRAVITY * FIRST_AGE**2
    h = (INVERSE_FROUDE_SQUARED * FIRST_RADIUS**2 - 0.5 * (FIRST_RADIUS**2 - r**2)) / scale
    return np.where(r < FIRST_RADIUS, h, 0.0)


def slick(bench: Bench, spacing: float) -> tuple[Fluid, float]:
    """A quarter of a self-similar slick in a square tank, its axis in a corner, in motion; and the whole slick's volume [m3]."""
    room = 4.0 * spacing
    fluid = bench.fluid(
        FluidConfig(
            particle_spacing=spacing,
            phases=oil_and_water(),
            lower=(-room,) * 3,
            upper=(SIDE + room, SIDE + room, 1.3 * DEPTH),
        )
    )
    sides = ("-x", "+x", "-y", "+y", "-z")
    fluid.add_boundary(tank_walls((0, 0, 0), (SIDE, SIDE, 1.2 * DEPTH), spacing, sides=sides))
    points = block((0, 0, 0), (SIDE, SIDE, math.ceil(1.1 * DEPTH / spacing) * spacing), spacing)
    thickness = self_similar_thickness(np.hypot(points[:, 0], points[:, 1]))
    strain = 0.5 / FIRST_AGE  # of u = r / 2 t
    count = launch(bench, fluid, points, thickness, DEPTH, (strain, strain))
    return fluid, 4.0 * count * spacing**3


def slick_radius(fluid: Fluid) -> float:
    """Radius [m] of the even disc that holds the same SHARE of the oil within the same distance."""
    x, y, _ = position(fluid)[:, fluid.particles.phase == 0]
    return float(np.quantile(np.hypot(x, y), SHARE)) / math.sqrt(SHARE)


def oil_slick(resolution: int, bench: Bench) -> Outcome:
    """Case 20: exponent and coefficient of a slick's radius."""
    spacing = VOLUME ** (1.0 / 3.0) / resolution
    bench.plan(LAST_AGE - FIRST_AGE)
    fluid, volume = slick(bench, spacing)
    age, radius = follow(bench, fluid, slick_radius, (FIRST_AGE, LAST_AGE), math.inf, READING)
    strength = SPREADING * math.sqrt(volume / VOLUME)
    late = radius > FITTED
    slope, constant = np.polyfit(age[late], radius[late] ** 2, 1)  # R^2 = C^2 (Delta g V)^(1/2) (t + t_0)
    return Outcome(
        values={
            "exponent": power_law(age[late], radius[late])[0],
            "coefficient": math.sqrt(slope / strength),
            "virtual origin": constant / slope,
        },
        traces=(
            trace("radius", age, radius),
            trace("radius", age, FAY * np.sqrt(strength * age), "1.14 (Delta g V t^2)^(1/4)", reference=True),
        ),
    )


VISCOUS_CURRENT = Case(
    number=19,
    name="viscous-current",
    title="Viscous gravity current",
    source="similarity solution of lubrication theory (Huppert 1982), x_N = 1.411 (g A^3 / 3 nu)^(1/5) t^(1/5)",
    setup=f"area 0.01 m2 beside a plane of symmetry, nu {VISCOSITY:.3g} m2/s, no-slip floor; front from 0.25 to 0.375 m, from the "
    "similarity profile",
    length=math.sqrt(AREA),
    length_symbol="A^(1/2)",
    resolutions=(16, 32, 64),
    quantities=(
        Quantity(name="exponent", unit="1", reference=0.2, scale=1.0, gate=0.01),
        Quantity(name="coefficient", unit="1", reference=float(ETA), gate=0.03),
        Quantity(name="exponent, from the second moment", unit="1", reference=0.2, scale=1.0),
    ),
    panels=(Panel("front", "age t [s]", "front [m]", log_x=True, log_y=True), Panel("shape", "x [m]", "height [m]")),
    run=viscous_current,
    note="constant area, A half of it by symmetry. Ages count from the similarity solution's own origin; the first tenth of the way is "
    "left out. Lubrication theory itself is good to (h / x)^2, 3 % at the start and 1 % at the end.",
)

OIL_SLICK = Case(
    number=20,
    name="oil-slick",
    title="Oil slick, gravity against inertia",
    source="Fay 1969: R = 1.14 (Delta g V t^2)^(1/4)",
    setup=f"a quarter of a slick of 1 m3 of oil 840 on {DEPTH:g} m of sea water, inviscid, in a tank of {SIDE:g} m x {SIDE:g} m, three "
    f"dimensions, from the self-similar solution of that coefficient; R from {FIRST_RADIUS:g} to {LAST_RADIUS:g} m",
    length=VOLUME ** (1.0 / 3.0),
    length_symbol="V^(1/3)",
    resolutions=(15, 20, 25),
    quantities=(
        Quantity(name="exponent", unit="1", reference=0.5, scale=1.0, gate=0.03),
        Quantity(name="coefficient", unit="1", reference=FAY, gate=0.1),
        Quantity(name="virtual origin", unit="s", reference=0.0, scale=1.0),
    ),
    panels=(Panel("radius", "age t [s]", "R [m]", log_x=True, log_y=True),),
    run=oil_slick,
    note="fitted from 1.3 first radii on, when the solution's square front has become one; ages count from its own origin. The "
    "coefficient is that of the slope of R^2, which does not depend on the origin. Radius: of an even disc with the same share of oil "
    "within the same distance. In shallow water slicks are slower, by a tenth in 1.6 m.",
)

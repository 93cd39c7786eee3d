"""Case 54: a drop of oil on a floor under water meets it at the contact angle."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from oilsim import Fluid, FluidConfig, Phase, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace

RADIUS, TENSION, DENSITY, VISCOSITY = (
    0.01,
    0.07,
    1000.0,
    0.2,
)  # m, N/m, kg/m3, Pa s; the radius of a disc of half the area
ANGLES = (30.0, 60.0, 90.0, 120.0, 150.0)  # degrees
AWAY = 20.0  # degrees towards 90 at the start
LENGTH, HEIGHT = 8.0, 3.0  # R
UNIT = math.sqrt(2.0 * DENSITY * RADIUS**3 / TENSION)  # s
RESTING, SAMPLES = 8.0, 16


def segment_area(angle: float) -> float:
    """Area [1] of a segment of a circle of radius 1 that meets its chord at `angle` [rad]."""
    return angle - 0.5 * math.sin(2.0 * angle)


def centre_height(angle: float) -> float:
    """Height of a segment's centre over its chord, as a share of the root of its area [1]; `angle` [rad] as in `segment_area`."""
    area = segment_area(angle)
    return (2.0 * math.sin(angle) ** 3 / (3.0 * area) - math.cos(angle)) / math.sqrt(area)


def sessile_drop(bench: Bench, resolution: int, angle: float) -> Fluid:
    """A drop without weight on a floor that it meets at `angle` [degrees] in the end, under water that fills a box."""
    spacing = RADIUS / resolution
    half, height = 0.5 * LENGTH * RADIUS, HEIGHT * RADIUS
    liquids = (
        Phase(name="water", rest_density=DENSITY, dynamic_viscosity=VISCOSITY),
        Phase(name="oil", rest_density=DENSITY, dynamic_viscosity=VISCOSITY, interfacial_tension=TENSION),
    )
    room = 4.0 * spacing
    config = FluidConfig(
        particle_spacing=spacing, phases=liquids, dimension=2, lower=(-half, -1.0, -room), upper=(half, 1.0, height + room),
        periodic=(True, False, False), gravity=(0.0, 0.0, 0.0),
    )  # fmt: skip
    fluid = bench.fluid(config)
    walls = tank_walls(
        (-half, 0.0, 0.0), (half, 0.0, height), spacing, sides=("-z", "+z"), periodic=(True, False, False), dimension=2
    )
    fluid.add_boundary(replace(walls, contact_angle=angle))
    along, up = (np.arange(round(length / spacing)) + 0.5 for length in (2.0 * half, height))
    x, z = (grid.ravel() for grid in np.meshgrid(along * spacing - half, up * spacing, indexing="ij"))
    points = np.stack([x, np.zeros_like(x), z], axis=1)
    start = math.radians(angle + math.copysign(AWAY, 90.0 - angle))
    curvature = math.sqrt(segment_area(start) / (0.5 * math.pi)) / RADIUS
    inside = np.hypot(x, z + math.cos(start) / curvature) < 1.0 / curvature
    fluid.add_particles(points[inside], phase="oil")
    fluid.add_particles(points[~inside], phase="water")
    return fluid


def angle_of(fluid: Fluid) -> float:
    """Angle [degrees] of the segment of a circle that has the drop's area and its centre's height."""
    oil = fluid.phase_positions("oil").astype(np.float64)
    height = oil[:, 2].mean() / math.sqrt(len(oil) * fluid.config.rest_volume)
    return math.degrees(brentq(lambda angle: centre_height(angle) - height, 0.05, 0.99 * math.pi))


def contact_angle(resolution: int, bench: Bench) -> Outcome:
    """Case 54: the angle at which drops come to rest, for walls of five contact angles."""
    bench.plan(len(ANGLES) * RESTING * UNIT)
    values, curves = dict[str, float](), []
    for angle in ANGLES:
        fluid = sessile_drop(bench, resolution, angle)
        rows = []
        for _ in range(SAMPLES):
            bench.advance(fluid, RESTING / SAMPLES * UNIT)
            rows.append((fluid.time / UNIT, angle_of(fluid)))
        fluid.close()
        time, found = np.array(rows).T
        values[f"{angle:g} degrees"] = float(found[SAMPLES // 2 :].mean())
        curves += [
            trace("angle", time, found, f"{angle:g} degrees"),
            trace("angle", time, np.full_like(time, angle), "set", reference=True),
        ]
    return Outcome(values=values, traces=tuple(curves))


CONTACT_ANGLE = Case(
    number=54,
    name="contact-angle",
    title="Drops of oil on a floor under water, at five contact angles",
    source="Young's law: a drop without weight is a segment of a circle that meets the floor at the contact angle",
    setup=f"plane drops in a box of 8 R x 3 R full of water of the same density; R = {RADIUS:g} m, radius of a disc of half the area; "
    f"sigma {TENSION:g} N/m, {VISCOSITY:g} Pa s, slippery floor, without weight; they begin {AWAY:g} degrees nearer to 90",
    length=RADIUS,
    length_symbol="R",
    resolutions=(8, 12, 16),
    quantities=tuple(
        Quantity(name=f"{angle:g} degrees", unit="degrees", reference=angle, scale=1.0, gate=5.0) for angle in ANGLES
    ),
    panels=(Panel("angle", "t / sqrt(2 rho R^3 / sigma)", "angle [degrees]"),),
    run=contact_angle,
    note="the angle is that of the segment with the drop's area and its centre's height, mean of the second half",
)

"""Cases 30, 31 and 58: thick, heavy liquid between walls that it sticks to: at rest, and round bodies that settle or are led down in it.

Gravity, pressure and viscosity must balance at every step. Where one of them acts alone before viscosity does, liquid at rest slides
along the walls at a share of g dt, and a body in it has too little lift.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from coupling.solids.bodies import mass_properties, sphere
from coupling.solids.surface_sampling import boundary_particles
from oilsim import Fluid, FluidConfig, Phase, block, tank_walls
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.rigid import CLEARANCE, Body, disc, disordered, outside
from tests.validation.scenes import GRAVITY, SAMPLE, rms_speed

Double = NDArray[np.float64]

SIDE = 0.4  # m, of the square tank of liquid at rest
DENSITY = 970.0  # kg/m3
VISCOSITIES = (0.373, 10.0)  # Pa s
REST, COUNTED = 1.0, 0.5  # s: of a run, and of its end that is counted
STILL = math.sqrt(GRAVITY * SIDE)  # m/s, that speeds are measured by
LEAN = math.radians(45.0)  # by which the second tank is turned: its walls slope


def thick_tank(bench: Bench, spacing: float, viscosity: float, lean: float, longest_step: float) -> Fluid:
    """A plane square tank, turned by `lean` [rad] about its lowest corner, with no-slip walls and still empty."""
    phase = Phase(name="oil", rest_density=DENSITY, dynamic_viscosity=viscosity)
    config = FluidConfig(
        particle_spacing=spacing, phases=(phase,), dimension=2, lower=(-2.0 * SIDE, -1.0, -0.5 * SIDE),
        upper=(2.0 * SIDE, 1.0, 2.0 * SIDE), maximum_time_step=longest_step,
    )  # fmt: skip
    fluid = bench.fluid(config)
    sides = ("-x", "+x", "-z")
    walls = tank_walls((0, 0, 0), (SIDE, 0, 1.5 * SIDE), spacing, sides=sides, dimension=2, no_slip=True)
    fluid.add_boundary(replace(walls, position=turned(walls.position, lean)))
    return fluid


def turned(points: Double, lean: float) -> Double:
    """Points (n, 3) turned by `lean` [rad] from x towards z, about the origin."""
    x, y, z = points.T
    return np.column_stack([x * math.cos(lean) - z * math.sin(lean), y, x * math.sin(lean) + z * math.cos(lean)])


def settled(bench: Bench, fluid: Fluid) -> float:
    """Run liquid that begins at rest; root mean square of its speed [m/s] in the part of the run that counts."""
    squares = []
    for n in range(round(REST / SAMPLE)):
        bench.advance(fluid, SAMPLE)
        if (n + 1) * SAMPLE > REST - COUNTED:
            squares.append(rms_speed(fluid) ** 2)
    return math.sqrt(float(np.mean(squares)))


def still_in_tank(bench: Bench, spacing: float, viscosity: float, lean: float, step: float) -> tuple[float, float]:
    """rms speed over sqrt(g L), and pressure three spacings above the lowest place over rho g h, with h by the liquid's area."""
    fluid = thick_tank(bench, spacing, viscosity, lean, step)
    points = turned(block((0, 0, 0), (SIDE, 0, 1.5 * SIDE), spacing, 2), lean)
    level = SIDE if lean == 0.0 else SIDE * math.sin(lean)
    points = points[points[:, 2] < level]
    fluid.add_particles(points, phase="oil")
    speed = settled(bench, fluid)
    deep = 3.0 * spacing
    x = 0.5 * SIDE if lean == 0.0 else 0.0
    area = len(points) * spacing**2
    surface = area / SIDE if lean == 0.0 else math.sqrt(area)  # a corner of 45 degrees to both sides holds h^2
    pressure = float(fluid.pressure_at([[x, 0.0, deep]])[0])
    return speed / STILL, pressure / (DENSITY * GRAVITY * (surface - deep))


def held_in_tank(bench: Bench, spacing: float, viscosity: float, step: float) -> float:
    """Lift over Archimedes' of a no-slip cylinder that is held under the surface."""
    fluid, radius, center = (
        thick_tank(bench, spacing, viscosity, 0.0, step),
        0.15 * SIDE,
        np.array([0.5, 0.0, 0.5]) * SIDE,
    )
    points = block((0, 0, 0), (SIDE, 0, SIDE), spacing, 2)
    fluid.add_particles(points[np.linalg.norm(points - center, axis=1) > radius + CLEARANCE * spacing], phase="oil")
    body = Body(fluid, replace(disc(radius, spacing), no_slip=True), 1.0, np.zeros((3, 3)), center)
    lift = [body.advance(bench, SAMPLE)[2] for _ in range(round(REST / SAMPLE))]
    return float(np.mean(lift[round((REST - COUNTED) / SAMPLE) :])) / (DENSITY * GRAVITY * math.pi * radius**2)


STEPS = {"10 ms": 0.01, "5 ms": 0.005}  # longest steps


def thick_rest(resolution: int, bench: Bench) -> Outcome:
    """Case 30: both tanks and the held cylinder, both oils, at two steps."""
    spacing, values = SIDE / resolution, {}
    bench.plan(3 * len(VISCOSITIES) * len(STEPS) * REST)
    for viscosity in VISCOSITIES:
        for label, step in STEPS.items():
            of = f"{viscosity:g} Pa s, {label}"
            for walls, lean in (("upright", 0.0), ("sloping", LEAN)):
                speed, pressure = still_in_tank(bench, spacing, viscosity, lean, step)
                values[f"rms speed / sqrt(g L), {walls} walls, {of}"] = speed
                values[f"pressure / (rho g h), {walls} walls, {of}"] = pressure
            values[f"lift of a held cylinder / Archimedes', {of}"] = held_in_tank(bench, spacing, viscosity, step)
    return Outcome(values=values)


def _rest_quantities() -> tuple[Quantity, ...]:
    found = []
    for viscosity in VISCOSITIES:
        for label in STEPS:
            of = f"{viscosity:g} Pa s, {label}"
            for walls in ("upright", "sloping"):
                name = f"rms speed / sqrt(g L), {walls} walls, {of}"
                found.append(Quantity(name=name, unit="1", reference=0.0, scale=1.0, gate=0.002))
                found.append(
                    Quantity(name=f"pressure / (rho g h), {walls} walls, {of}", unit="1", reference=1.0, gate=0.005)
                )
            found.append(
                Quantity(name=f"lift of a held cylinder / Archimedes', {of}", unit="1", reference=1.0, gate=0.02)
            )
    return tuple(found)


THICK_REST = Case(
    number=30,
    name="thick-rest",
    title="Thick liquid at rest between walls that it sticks to",
    source="hydrostatics: nothing moves, p = rho g h, Archimedes' lift",
    setup=f"plane tank of side L = {SIDE:g} m, upright and turned by 45 degrees, all walls no-slip; cylinder of 0.3 L held in its middle; "
    f"oil of {DENSITY:g} kg/m3; mean over the last {COUNTED:g} s of {REST:g} s",
    length=SIDE,
    length_symbol="L",
    resolutions=(12, 20, 32),
    quantities=_rest_quantities(),
    panels=(),
    run=thick_rest,
)

BEATS = 20  # samples while a sphere goes its diameter
BALL, HEAVY = 0.015, 1120.0  # m, kg/m3: diameter and density of the sphere
BOX, FALL = (0.1, 0.1, 0.16), 0.12  # m: the box; height of the sphere's lowest point over the floor at the start
# liquids: density [kg/m3], dynamic viscosity [Pa s], and the largest speed of the sphere [m/s] with its Reynolds number
LIQUIDS = {1.5: (970.0, 0.373, 0.947 * 0.038), 31.9: (960.0, 0.058, 0.955 * 0.128)}


def has_settled(speeds: Double) -> bool:
    """Tell whether a sphere falls steadily: it has gone one diameter, and half a diameter has made it faster by a thousandth at most."""
    if len(speeds) <= BEATS:
        return False
    before, now = speeds[-BEATS:].reshape(2, -1).mean(axis=1)
    return bool(now <= 1.001 * before)


def settling(bench: Bench, resolution: int, reynolds: float) -> tuple[Double, Double]:
    """Time [s] and speed of fall [m/s] of the sphere in one of the LIQUIDS, until it falls steadily or has come down by half its way."""
    density, viscosity, expected = LIQUIDS[reynolds]
    spacing = BALL / resolution
    counts = np.round(np.array(BOX) / spacing)
    width, _, height = counts * spacing
    room = 4.0 * spacing
    config = FluidConfig(
        particle_spacing=spacing, phases=(Phase(name="oil", rest_density=density, dynamic_viscosity=viscosity),),
        lower=(-room,) * 3, upper=(width + room, width + room, height + room),
    )  # fmt: skip
    fluid = bench.fluid(config)
    fluid.add_boundary(tank_walls((0, 0, 0), (width, width, height), spacing, no_slip=True))
    mesh, start = sphere(0.5 * BALL), np.array([0.5 * width, 0.5 * width, FALL + 0.5 * BALL])
    points = block((0, 0, 0), (width, width, height), spacing)
    fluid.add_particles(outside(points, mesh, start, spacing), phase="oil")
    properties = mass_properties(mesh, density=HEAVY)
    boundary = boundary_particles("ball", mesh, spacing, no_slip=True)
    body = Body(fluid, boundary, properties.mass, np.linalg.inv(properties.inertia), start)
    body.freedoms[:3] = 1.0
    beat = BALL / expected / BEATS
    rows = [(0.0, 0.0)]
    while body.position[2] > 0.5 * FALL and not has_settled(np.array(rows)[:, 1]):
        body.advance(bench, beat)
        rows.append((rows[-1][0] + beat, -float(body.twist[2])))
    return np.array(rows).T


def settling_sphere(resolution: int, bench: Bench) -> Outcome:
    """Case 31: largest speed of the sphere at each Reynolds number."""
    values, traces = {}, []
    bench.plan(sum(3.0 * BALL / liquid[2] for liquid in LIQUIDS.values()))
    for reynolds, (_, _, expected) in LIQUIDS.items():
        times, speeds = settling(bench, resolution, reynolds)
        values[f"largest speed at Re {reynolds:g} / measured"] = float(np.sort(speeds)[-BEATS // 2 :].mean()) / expected
        traces.append(trace("fall", times * expected / BALL, speeds / expected, f"Re {reynolds:g}"))
    return Outcome(values=values, traces=tuple(traces))


SETTLING_SPHERE = Case(
    number=31,
    name="settling-sphere",
    title="A sphere settles in silicon oil",
    source="largest speeds measured by ten Cate, Nieuwstad, Derksen and Van den Akker 2002 (Phys. Fluids 14, 4012), in a box",
    setup=f"sphere of D = {BALL:g} m and {HEAVY:g} kg/m3 in a closed box of {BOX[0]:g} x {BOX[1]:g} x {BOX[2]:g} m, "
    f"from {FALL:g} m over its floor",
    length=BALL,
    length_symbol="D",
    resolutions=(4, 6, 8),
    quantities=tuple(
        Quantity(name=f"largest speed at Re {reynolds:g} / measured", unit="1", reference=1.0, gate=0.04)
        for reynolds in LIQUIDS
    ),
    panels=(Panel("fall", "t U / D", "speed / measured"),),
    run=settling_sphere,
)


TOWED, TRAVEL, COUNTED_TRAVEL = 0.036, 2.5, 1.5  # m/s; diameters: its whole way, and the part of it that is counted


def towed_drag(bench: Bench, resolution: int, gravity: float) -> float:
    """Drag [N/m] of a plane cylinder of BALL's diameter that is led down through the box of the sphere, less its lift."""
    density, viscosity, _ = LIQUIDS[1.5]
    spacing = BALL / resolution
    width, height = (round(side / spacing) * spacing for side in (BOX[0], BOX[2]))
    room = 4.0 * spacing
    config = FluidConfig(
        particle_spacing=spacing, phases=(Phase(name="oil", rest_density=density, dynamic_viscosity=viscosity),), dimension=2,
        lower=(-room, -1.0, -room), upper=(width + room, 1.0, height + room), gravity=(0.0, 0.0, -gravity),
    )  # fmt: skip
    fluid = bench.fluid(config)
    sides = ("-x", "+x", "-z", "+z")
    fluid.add_boundary(tank_walls((0, 0, 0), (width, 0, height), spacing, sides=sides, dimension=2, no_slip=True))
    start = np.array([0.5 * width, 0.0, FALL])
    points = disordered(block((0, 0, 0), (width, 0, height), spacing, 2), spacing) * (1.0, 0.0, 1.0)
    outside_it = np.linalg.norm(points - start, axis=1) > 0.5 * BALL + CLEARANCE * spacing
    fluid.add_particles(points[outside_it], phase="oil")
    body = Body(fluid, replace(disc(0.5 * BALL, spacing), no_slip=True), 1.0, np.zeros((3, 3)), start)
    body.twist[2] = -TOWED
    beat = BALL / TOWED / BEATS
    forces = [body.advance(bench, beat)[2] for _ in range(round(TRAVEL * BEATS))]
    return float(np.mean(forces[-round(COUNTED_TRAVEL * BEATS) :])) - density * gravity * 0.25 * math.pi * BALL**2


def thick_tow(resolution: int, bench: Bench) -> Outcome:
    """Case 58: the drag with gravity over the one without."""
    bench.plan(2.0 * TRAVEL * BALL / TOWED)
    weightless, heavy = (towed_drag(bench, resolution, gravity) for gravity in (0.0, GRAVITY))
    return Outcome(values={"drag with gravity / without": heavy / weightless})


THICK_TOW = Case(
    number=58,
    name="thick-tow",
    title="A cylinder is led down through thick oil",
    source="weight adds lift to a body, and no drag",
    setup=f"plane cylinder of D = {BALL:g} m, led at {TOWED:g} m/s down the closed box of case 31 in its oil of {LIQUIDS[1.5][1]:g} Pa s; "
    f"particles begin off their lattice; mean over the last {COUNTED_TRAVEL:g} of {TRAVEL:g} D, less Archimedes' lift",
    length=BALL,
    length_symbol="D",
    resolutions=(4, 6, 8),
    quantities=(Quantity(name="drag with gravity / without", unit="1", reference=1.0, gate=0.04),),
    panels=(),
    run=thick_tow,
    note="the pressure is 800 times the stress of viscosity, so what pressure leaves of an elastic force is felt as drag.",
)

"""Cases 10 and 21: light bodies let go under water, and the heave of a half-immersed cylinder."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from coupling.solids.bodies import sphere
from oilsim import FluidConfig, block, tank_walls
from tests.validation import heave_theory
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.rigid import CLEARANCE, Body, disc, extruded, outside, put_solid, solid_tank
from tests.validation.scenes import GRAVITY, SAMPLE, liquid, open_tank, read_table

Double = NDArray[np.float64]

WATER = 1000.0  # kg/m3
DIAMETER = 0.4  # m, of the sphere
SIDE, DEPTH = 2.5 * DIAMETER, 2.5 * DIAMETER  # of its tank; the sphere starts in the middle
RATIOS = (0.02, 0.05, 0.1, 0.5)
SETTLE, BEAT, BEATS = (
    0.3,
    0.002,
    5,
)  # s held before the release; s between samples after it, and how many give the acceleration
STEPS, SURFACING_TIME = 1000, 9.0  # of the fluid from the release through the surface, and about how long they take [s]
REFLECTIONS = 12  # of images that are counted, to each side
CHANNEL = 3.0 * DIAMETER  # m: width and depth of the tank of a cylinder that is let go in its middle
RADIUS = 0.25  # m, of the cylinder that heaves
RELEASED = 1.0 / 3.0  # of the radius: how high above its waterline it is let go
HALF_WIDTH, WATER_DEPTH = 14.0, 6.0  # of the radius: not far, so theory is told of them
LAST = 11.5  # of sqrt(R / g): length of the run
ROWS = 9  # of particles along a cylinder in space


def mirrored(below: float, above: float) -> list[tuple[float, float]]:
    """Heights [m] over a body's own of its images across floor and surface, `below` and `above` it, and their share of its speed.

    The floor, which no water passes, reverses what moves up and down; the surface, where there is no pressure, does not.
    """
    images = []
    for n in range(-REFLECTIONS, REFLECTIONS + 1):
        period, sign = 2.0 * n * (below + above), (-1.0) ** n
        images += [(period, sign)] * (n != 0) + [(period - 2.0 * below, -sign)]
    return images


def sphere_added_mass(radius: float, side: float, below: float, above: float) -> float:
    """Added mass coefficient of a sphere that starts to rise in the middle of a square tank, all lengths [m].

    An image that moves with s U, at (r, theta) from the axis of motion, adds s U a^3 (3 cos^2 theta - 1) / (2 r^3) to the water's velocity.
    All of them together add -e (1 + x) U, and as much as that, x = e (1 + x), to the strength that each of them has. Against such water a
    sphere has C_a = (1 + 3 x) / 2, as it has exactly in the middle of a hollow sphere.
    """
    backflow = 0.0
    for i, j in itertools.product(range(-REFLECTIONS, REFLECTIONS + 1), repeat=2):
        for height, sign in [(0.0, 1.0), *mirrored(below, above)]:
            square = (i * side) ** 2 + (j * side) ** 2 + height**2
            if square > 0.0:
                backflow -= sign * radius**3 * (3.0 * height**2 / square - 1.0) / (2.0 * square**1.5)
    return 0.5 * (1.0 + 3.0 * backflow / (1.0 - backflow))


def cylinder_added_mass(radius: float, width: float, below: float, above: float) -> float:
    """The same of a cylinder across a channel, whose images add s U a^2 cos(2 theta) / r^2: C_a = 1 + 2 x.

    A row of them, mirrored by the sides, adds s U (pi a / width)^2 / sinh^2(pi z / width) at a height z from it, and the cylinder's own
    row -U (pi a / width)^2 / 3.
    """
    rows = sum(sign / math.sinh(math.pi * height / width) ** 2 for height, sign in mirrored(below, above))
    backflow = (math.pi * radius / width) ** 2 * (1.0 / 3.0 - rows)
    return 1.0 + 2.0 * backflow / (1.0 - backflow)


def held_sphere(bench: Bench, ratio: float, spacing: float, **options: float) -> Body:
    """A light sphere in the middle of its tank, held until the water about it has settled, and free from now on to heave and to turn.

    The tank holds water only: a sphere that leaps and drifts would come down beside it.
    """
    mesh, start = sphere(0.5 * DIAMETER), np.array([0.5 * SIDE, 0.5 * SIDE, 0.5 * DEPTH])
    fluid, points = solid_tank(bench, SIDE, DEPTH, spacing, (liquid(WATER),), **options)
    body = put_solid(fluid, mesh, ratio * WATER, start)
    fluid.add_particles(outside(points, mesh, start, spacing), phase="water")
    for _ in range(round(SETTLE / SAMPLE)):
        body.advance(bench, SAMPLE)
    body.freedoms[2:] = 1.0
    return body


def held_cylinder(bench: Bench, ratio: float, spacing: float, **options: float) -> Body:
    """A light cylinder across the middle of a channel, held until the water about it has settled, and free from now on to heave."""
    radius, start = 0.5 * DIAMETER, np.array([0.5 * CHANNEL, 0.0, 0.5 * CHANNEL])
    fluid, _ = open_tank(bench, CHANNEL, CHANNEL, spacing, (liquid(WATER),), **options)
    points = block((0, 0, 0), (CHANNEL, 0, CHANNEL), spacing, 2)
    fluid.add_particles(points[np.linalg.norm(points - start, axis=1) > radius + CLEARANCE * spacing], phase="water")
    body = Body(fluid, disc(radius, spacing), ratio * WATER * math.pi * radius**2, np.zeros((3, 3)), start)
    for _ in range(round(SETTLE / SAMPLE)):
        body.advance(bench, SAMPLE)
    body.freedoms[2] = 1.0
    return body


def first_accelerations(bench: Bench, held: Callable[..., Body], spacing: float) -> list[float]:
    """Accelerations over g of bodies of all RATIOS just let go, each in the same water at rest."""
    body = held(bench, 1.0, spacing, divergence_tolerance=1e-6, divergence_iterations=400)
    water, start, mass, inverse_inertia = body.fluid.save_state(), body.position, body.mass, body.inverse_inertia
    found = []
    for ratio in RATIOS:
        body.fluid.restore_state(water)
        body.position, body.orientation, body.twist = start, np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(6)
        body.mass, body.inverse_inertia = ratio * mass, inverse_inertia / ratio
        speeds = [0.0]
        for _ in range(BEATS):
            body.advance(bench, BEAT)
            speeds.append(float(body.twist[2]))
        found.append(float(np.polyfit(BEAT * np.arange(BEATS + 1), speeds, 1)[0]) / GRAVITY)
    body.fluid.close()
    return found


def release(held: Callable[..., Body], added_mass: float, resolution: int, bench: Bench) -> Outcome:
    """Case 10: acceleration of light bodies just let go under water."""
    bench.plan(SETTLE + len(RATIOS) * BEATS * BEAT)
    found = first_accelerations(bench, held, DIAMETER / resolution)
    return Outcome(
        values={f"acceleration / g, ratio {ratio:g}": value for ratio, value in zip(RATIOS, found, strict=True)},
        traces=(
            trace("acceleration", RATIOS, found, markers=True),
            trace("acceleration", RATIOS, [(1.0 - r) / (r + added_mass) for r in RATIOS], "theory", reference=True),
        ),
    )


def surfacing(resolution: int, bench: Bench) -> Outcome:
    """Case 10: the same spheres through the surface and after."""
    bench.plan(len(RATIOS) * (SETTLE + SURFACING_TIME))
    values, traces = {}, []
    for ratio in RATIOS:
        body = held_sphere(bench, ratio, DIAMETER / resolution)
        heights, before, count = [], bench.particle_steps, body.fluid.particle_count
        while bench.particle_steps - before < STEPS / bench.step_share * count:
            body.advance(bench, SAMPLE)
            heights.append(float(body.position[2]))
        body.fluid.close()
        swings = [np.ptp(quarter) for quarter in np.array_split(np.array(heights), 4)]
        values[f"bobbing left, ratio {ratio:g}"] = float(swings[3] / swings[1])
        traces.append(
            trace("height", SAMPLE * np.arange(len(heights)), np.array(heights) / DIAMETER, f"ratio {ratio:g}")
        )
    return Outcome(values=values, traces=tuple(traces))


def heave_decay(resolution: int, bench: Bench, rows: int = 0) -> Outcome:
    """Case 21: a cylinder of half the density is let go above its waterline, free to heave only.

    rows: particles along the cylinder, in a tank that repeats along it; 0 for the plane.
    """
    spacing = RADIUS / resolution
    unit = math.sqrt(RADIUS / GRAVITY)
    half, depth, room = HALF_WIDTH * RADIUS, WATER_DEPTH * RADIUS, 4.0 * spacing
    dimension, width, repeats = 3 if rows else 2, rows * spacing, (False, rows > 0, False)
    config = FluidConfig(
        particle_spacing=spacing, phases=(liquid(WATER),), dimension=dimension, periodic=repeats,
        lower=(-half - room, 0.0 if rows else -1.0, -depth - room), upper=(half + room, width or 1.0, depth),
    )  # fmt: skip
    fluid = bench.fluid(config)
    sides, ends = ("-x", "+x", "-z"), ((-half, 0.0, -depth), (half, width, depth))
    fluid.add_boundary(tank_walls(*ends, spacing, sides=sides, periodic=repeats, dimension=dimension))
    points = block((-half, 0, -depth), (half, width, 0), spacing, dimension)
    start = np.array([0.0, 0.5 * width, RELEASED * RADIUS])
    fluid.add_particles(points[np.hypot(points[:, 0], points[:, 2] - start[2]) > RADIUS], phase="water")
    section = disc(RADIUS, spacing)
    cylinder = extruded(section, width, spacing) if rows else section
    body = Body(fluid, cylinder, 0.5 * WATER * math.pi * RADIUS**2 * (width or 1.0), np.zeros((3, 3)), start)
    bench.plan(unit * (2.0 + LAST))
    beat = 0.05 * unit
    for _ in range(40):
        body.advance(bench, beat)
    body.freedoms[2] = 1.0
    heights = [1.0]
    for _ in range(round(LAST / 0.05)):
        body.advance(bench, beat)
        heights.append(float(body.position[2]) / start[2])
    fluid.close()
    time, height = 0.05 * np.arange(len(heights)), np.array(heights)
    extrema = turning_points(time, height)
    sea_time, sea_height = read_table("heave_decay_half_cylinder_linear.csv")
    found = dict(zip(("first", "second"), extrema, strict=False))
    values = {f"{name} extremum": found.get(name, (math.nan, math.nan))[1] for name in ("first", "second")}
    values["period"] = extrema[2][0] - extrema[0][0] if len(extrema) > 2 else math.nan
    return Outcome(
        values=values,
        traces=(
            trace("heave", time, height),
            trace("heave", *expected_heave(), "linear potential theory, in the tank", reference=True),
            trace("heave", sea_time, sea_height, "in a deep and wide sea", reference=True),
        ),
    )


@cache
def expected_heave() -> tuple[Double, Double]:
    """Time [sqrt(R / g)] and height over the first by linear potential theory, in the same tank."""
    return heave_theory.heave_decay(HALF_WIDTH, WATER_DEPTH, LAST)


@cache
def expected_extrema() -> list[tuple[float, float]]:
    """Time and height of its extrema."""
    return turning_points(*expected_heave())


def turning_points(time: Double, height: Double) -> list[tuple[float, float]]:
    """Time and height of the extrema after the start, each the vertex of a parabola through seven samples about it, alternating."""
    found: list[tuple[float, float]] = []
    sign = -1.0
    begin = 1
    crossings = np.flatnonzero(np.diff(np.sign(height)) != 0)
    for first, last in zip(crossings, [*crossings[1:], len(height) - 1], strict=True):
        middle = first + int(np.argmax(sign * height[first : last + 1]))
        if begin < middle < len(height) - 4:
            around = slice(middle - 3, middle + 4)
            curve = np.polynomial.Polynomial.fit(time[around], height[around], 2)
            vertex = float(curve.deriv().roots()[0])
            found.append((vertex, float(curve(vertex))))
        sign, begin = -sign, middle
    return found


IN_A_TANK = sphere_added_mass(0.5 * DIAMETER, SIDE, 0.5 * DEPTH, 0.5 * DEPTH)
IN_A_CHANNEL = cylinder_added_mass(0.5 * DIAMETER, CHANNEL, 0.5 * CHANNEL, 0.5 * CHANNEL)


def release_case(
    name: str, bodies: str, held: Callable[..., Body], added_mass: float, setup: str, resolutions: tuple[int, ...]
) -> Case:
    """Case 10 for one kind of body."""
    return Case(
        number=10,
        name=name,
        title=f"{bodies} let go under water",
        source=f"a = (1 - s) g / (s + C_a), C_a = {added_mass:.3f} with the images of the tank's walls and of the surface",
        setup=setup,
        length=DIAMETER,
        length_symbol="D",
        resolutions=resolutions,
        quantities=tuple(
            Quantity(name=f"acceleration / g, ratio {r:g}", unit="1", reference=(1.0 - r) / (r + added_mass), gate=0.03)
            for r in RATIOS
        ),
        panels=(Panel("acceleration", "density over the water's", "a / g"),),
        run=partial(release, held, added_mass),
        note="slope of the speed over the first 0.01 s; divergence tolerance 1e-6, up to 400 products: the pressure is new in one step.",
    )


RELEASE = release_case(
    "release", "Light spheres", held_sphere, IN_A_TANK,
    "sphere of diameter D in the middle of a tank 2.5 D wide and deep, held for 0.3 s and let go", (12, 18, 28),
)  # fmt: skip
PLANE_RELEASE = release_case(
    "plane-release", "Light cylinders", held_cylinder, IN_A_CHANNEL,
    "cylinder of diameter D across the middle of a channel 3 D wide and deep, held for 0.3 s and let go", (8, 16, 32),
)  # fmt: skip

SURFACING = Case(
    number=10,
    name="surfacing",
    title="Light spheres through the surface",
    source="what is let go comes to rest",
    setup="the spheres of case 10 for 1000 steps, through the surface",
    length=DIAMETER,
    length_symbol="D",
    resolutions=(4, 6, 8),
    quantities=tuple(
        Quantity(name=f"bobbing left, ratio {r:g}", unit="1", reference=0.0, scale=1.0, gate=1.0) for r in RATIOS
    ),
    panels=(Panel("height", "t [s]", "height of the centre / D"),),
    run=surfacing,
    note="range of heights in the last quarter over that in the second: above 1 the oscillation grows.",
)

HEAVE_DECAY = Case(
    number=21,
    name="heave-decay",
    title="Heave decay of a half-immersed cylinder",
    source="linear potential theory of the same tank, by boundary elements (in a wide and deep one: Ursell's multipoles)",
    setup="cylinder of radius R and half the density, let go R/3 above its waterline in water 28 R wide and 6 R deep",
    length=RADIUS,
    length_symbol="R",
    resolutions=(8, 12, 16),
    quantities=(
        Quantity(name="first extremum", unit="1", reference=expected_extrema()[0][1], gate=0.05),
        Quantity(name="second extremum", unit="1", reference=expected_extrema()[1][1], gate=0.05),
        Quantity(
            name="period", unit="sqrt(R/g)", reference=expected_extrema()[2][0] - expected_extrema()[0][0], gate=0.01
        ),
    ),
    panels=(Panel("heave", "t / sqrt(R/g)", "z / z_0"),),
    run=heave_decay,
    note="the period is the time from the first to the third extremum. In a deep and wide sea they would be -0.641 and 0.305.",
)

HEAVE_IN_SPACE = replace(
    HEAVE_DECAY,
    name="heave-in-space",
    title="Heave decay of a half-immersed cylinder, in three dimensions",
    setup=f"{HEAVE_DECAY.setup}, {ROWS} spacings of a tank that repeats along it",
    resolutions=(6, 8, 10),
    run=partial(heave_decay, rows=ROWS),
)

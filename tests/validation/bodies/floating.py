"""Case 9, Archimedes: the draft of floating bodies, the lift of submerged ones of any shape, the roll of a square."""

from __future__ import annotations

import math
from functools import cache, partial

import numpy as np
import trimesh
from numpy.typing import NDArray

from coupling.solids.bodies import box, cylinder, sphere
from oilsim import Phase, solid_box
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace
from tests.validation.rigid import Body, disordered, outside, put_solid, solid_tank, waterline
from tests.validation.scenes import GRAVITY, OIL_DENSITY, SAMPLE, fill, liquid, open_tank

Double = NDArray[np.float64]

SIZE = 0.4  # m: edge of the box, height and diameter of the cylinder, diameter of the sphere
SIDE, DEPTH = 2.5 * SIZE, 1.6 * SIZE  # of the tank; the level rises with the body
FLOAT, HELD, ROLL = 4.0, 2.5, 10.0  # s: length of the runs; the second half counts
BETWEEN = 8.0  # s between two liquids, where a sphere heaves in 3 s: the last three quarters count
RATIOS = (0.1, 0.3, 0.5, 0.8)
WATER = 1000.0  # kg/m3
FITTED = ("box", "cylinder", "sphere")


@cache
def solids() -> dict[str, trimesh.Trimesh]:
    """Solids by name, each about its centre of mass."""
    bowl = np.array([[0, 0], [0.5, 0], [0.5, 0.5], [0.35, 0.5], [0.35, 0.15], [0, 0.15]]) * SIZE
    meshes = {
        "box": box((SIZE, SIZE, SIZE)),
        "cylinder": cylinder(0.5 * SIZE, SIZE),
        "sphere": sphere(0.5 * SIZE),
        "cone": trimesh.creation.cone(radius=0.5 * SIZE, height=SIZE),
        "torus": trimesh.creation.torus(major_radius=0.4 * SIZE, minor_radius=0.2 * SIZE),
        "plate": box((1.2 * SIZE, 1.2 * SIZE, 0.15 * SIZE)),
        "icosahedron": trimesh.creation.icosahedron(),
        "bowl": trimesh.creation.revolve(bowl, sections=48),
        "L-beam": _beam(np.array([[0, 0], [1, 0], [1, 0.35], [0.35, 0.35], [0.35, 1], [0, 1]]) * SIZE, SIZE),
    }
    meshes["icosahedron"].apply_scale(0.5 * SIZE)
    for mesh in meshes.values():
        mesh.apply_translation(-mesh.center_mass)
    return meshes


def _beam(outline: Double, length: float) -> trimesh.Trimesh:
    """A prism along y over an outline (n, 2) in x and z, counter-clockwise and star-shaped about its first corner."""
    count = len(outline)
    ends = [np.insert(outline, 1, y, axis=1) for y in (0.0, length)]
    fan = [(0, n, n + 1) for n in range(1, count - 1)]
    following = [(n, (n + 1) % count) for n in range(count)]
    sides = [side for a, b in following for side in ((a, b + count, b), (a, a + count, b + count))]
    return trimesh.Trimesh(
        np.concatenate(ends), [*fan, *((a + count, c + count, b + count) for a, b, c in fan), *sides]
    )


def draft_error(bench: Bench, name: str, ratio: float, spacing: float) -> float:
    """How much deeper than Archimedes says a free solid lies in water, in spacings, by the volume of the water."""
    mesh = solids()[name]
    fluid, points = solid_tank(bench, SIDE, DEPTH, spacing, (liquid(WATER),))
    body = put_solid(fluid, mesh, ratio * WATER, np.zeros(3))
    displaced = ratio * float(mesh.volume)
    body.position = np.array([0.5 * SIDE, 0.5 * SIDE, DEPTH - waterline(body, mesh, displaced)])
    fluid.add_particles(outside(points, mesh, body.position, spacing), phase="water")
    body.freedoms[:] = 1.0
    level = (fluid.particle_count * fluid.config.rest_volume + displaced) / SIDE**2
    errors = []
    for step in range(round(FLOAT / SAMPLE)):
        body.advance(bench, SAMPLE)
        if step * SAMPLE >= 0.5 * FLOAT and step % 10 == 0:
            errors.append((level - waterline(body, mesh, displaced)) / spacing)
    fluid.close()
    return float(np.mean(errors))


def oil_draft_error(bench: Bench, spacing: float) -> float:
    """The same of a sphere of 920 kg/m3 between oil of 840 and water of 1000, its centre at their interface: by its height over it.

    rho_o V_above + rho_w V_below = m, with half the sphere in each; heights from the volumes of the liquids. It heaves and turns only,
    since in 8 s it could drift against a wall.
    """
    mesh = solids()["sphere"]
    phases = (Phase(name="oil", rest_density=OIL_DENSITY), liquid(WATER))
    fluid, points = solid_tank(bench, SIDE, 2.0 * DEPTH, spacing, phases)
    body = put_solid(fluid, mesh, 0.5 * (OIL_DENSITY + WATER), np.array([0.5 * SIDE, 0.5 * SIDE, DEPTH]))
    around = outside(points, mesh, body.position, spacing)
    below = around[:, 2] < DEPTH
    fluid.add_particles(around[~below], phase="oil")
    fluid.add_particles(around[below], phase="water")
    body.freedoms[2:] = 1.0
    water = np.count_nonzero(below) * fluid.config.rest_volume
    interface = (water + 0.5 * float(mesh.volume)) / SIDE**2
    heights = []
    for step in range(round(BETWEEN / SAMPLE)):
        body.advance(bench, SAMPLE)
        if step * SAMPLE >= 0.25 * BETWEEN:
            heights.append(body.position[2])
    fluid.close()
    return (interface - float(np.mean(heights))) / spacing


def roll_angle(bench: Bench, spacing: float) -> float:
    """Angle [deg] to which a plane square of half the density rolls, its side SIZE, from a slight roll."""
    width = 4.0 * SIZE
    fluid, _ = open_tank(bench, width, 2.0 * SIZE, spacing, (liquid(WATER),))
    fill(fluid, (0, 0), (width, 2.0 * SIZE))
    mass = 0.5 * WATER * SIZE**2
    start = np.array([0.5 * width, 0.0, 2.0 * SIZE])
    points = fluid.particles.position.T
    fluid.remove_particles((np.abs(points[:, [0, 2]] - start[[0, 2]]) <= 0.5 * SIZE).all(axis=1))
    square = solid_box((SIZE, 0.0, SIZE), spacing, dimension=2)
    body = Body(fluid, square, mass, np.diag([0.0, 6.0 / (mass * SIZE**2), 0.0]), start)
    body.freedoms[[0, 2, 4]] = 1.0
    body.twist[4] = 0.3
    angles = []
    for step in range(round(ROLL / SAMPLE)):
        body.advance(bench, SAMPLE)
        if step * SAMPLE >= 0.8 * ROLL:
            angles.append(abs(math.degrees(2.0 * math.asin(body.orientation[1]))) % 90.0)
    fluid.close()
    return float(np.mean(angles))


def archimedes(resolution: int, bench: Bench) -> Outcome:
    """Case 9: drafts in water, in oil over water, and the roll of a square."""
    spacing = SIZE / resolution
    bench.plan(FLOAT * len(FITTED) * len(RATIOS) + BETWEEN + ROLL)
    errors = {name: [draft_error(bench, name, ratio, spacing) for ratio in RATIOS] for name in FITTED}
    values = {f"{name} {ratio:g}": error for name in FITTED for ratio, error in zip(RATIOS, errors[name], strict=True)}
    values["sphere in oil over water"] = oil_draft_error(bench, spacing)
    values["roll of a half-density square"] = roll_angle(bench, spacing)
    return Outcome(
        values=values, traces=tuple(trace("draft", RATIOS, errors[name], name, markers=True) for name in FITTED)
    )


def lift(bench: Bench, name: str, spacing: float) -> float:
    """Force over rho g V on a submerged solid that is held: the density ratio at which it would neither rise nor sink."""
    mesh, depth = solids()[name], 2.4 * SIZE
    fluid, points = solid_tank(bench, SIDE, depth, spacing, (liquid(WATER),))
    body = put_solid(fluid, mesh, WATER, np.array([0.5 * SIDE, 0.5 * SIDE, 0.5 * depth]))
    fluid.add_particles(outside(disordered(points, spacing), mesh, body.position, spacing), phase="water")
    forces = [body.advance(bench, SAMPLE)[2] for _ in range(round(HELD / SAMPLE))]
    fluid.close()
    return float(np.mean(forces[len(forces) // 2 :])) / (WATER * GRAVITY * float(mesh.volume))


def submerged(resolution: int, bench: Bench) -> Outcome:
    """Case 9: lift of submerged solids of nine shapes."""
    bench.plan(HELD * len(solids()))
    values = {name: lift(bench, name, SIZE / resolution) for name in solids()}
    return Outcome(values=values, traces=(trace("lift", np.arange(len(values)), list(values.values()), markers=True),))


draft = partial(Quantity, unit="d", reference=0.0, scale=1.0, gate=0.1)

ARCHIMEDES = Case(
    number=9,
    name="archimedes",
    title="Draft of floating bodies",
    source="Archimedes' principle",
    setup="box, cylinder and sphere of size L, free, in a tank 2.5 L wide and 1.6 L deep, 4 s, the last 2 s count; a sphere "
    "between oil and water, 8 s, the last 6 s count; a plane square of half the density, free to roll, 10 s",
    length=SIZE,
    length_symbol="L",
    resolutions=(6, 8, 10),
    quantities=(
        *(draft(name=f"{name} {ratio:g}") for name in FITTED for ratio in RATIOS),
        draft(name="sphere in oil over water"),
        Quantity(name="roll of a half-density square", unit="deg", reference=45.0, scale=1.0, gate=1.0),
    ),
    panels=(Panel("draft", "density over the water's", "draft too deep [spacings]"),),
    run=archimedes,
    note="the error is the height of the water, from its volume, over the waterline at which the body as it lies displaces its weight.",
)

SUBMERGED = Case(
    number=9,
    name="submerged-shapes",
    title="Lift of submerged solids",
    source="Archimedes' principle, F = rho g V; F / (rho g V) is the density ratio of neutral buoyancy",
    setup="solids of size L, held in the middle of a tank 2.5 L wide and 2.4 L deep, 2.5 s, the second half counts; the water starts up "
    "to 0.3 spacings off its lattice",
    length=SIZE,
    length_symbol="L",
    resolutions=(8, 12, 16),
    quantities=tuple(Quantity(name=name, unit="1", reference=1.0, gate=0.01) for name in solids()),
    panels=(Panel("lift", "solid, in the table's order", "F / (rho g V)"),),
    run=submerged,
    note="the plate is 0.15 L thick: 2.4 spacings at L/16.",
)

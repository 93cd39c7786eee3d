"""Case 34: the same boom and the same barge with particles, with a window of them at the boom's apex, and without, towed and in waves.

A boom of 12 m between two fixed ends in a current, which is towing seen from the boom, calm and with head waves; and a free barge in
waves. Every scene runs with particles everywhere and without, the boom also with a window. Waves that particles carry
lose height, so motions count per height of the wave beside the barge.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from booms.boom_state import BoomState
from scenarios.running.assembly import Assembly, build
from scenarios.schema.bodies import BoxBody
from scenarios.schema.exercise import BoomSettings
from scenarios.schema.liquid import FluidSettings, PhaseSettings, SlabFill, Tank, ZoneSettings
from scenarios.schema.sea import RegularSeaWaves, SeaSettings, SteadySeaCurrent
from scenarios.schema.window import WindowTable
from scenarios.spec.scenario import RunSettings, Scenario
from tests.validation.case import Bench, Case, Outcome, Panel, Quantity, trace

Double = NDArray[np.float64]

WATER = 1027.0  # kg/m3
DEPTH, STEP = 1.5, 0.02  # m: of the water; s
LENGTH, SEGMENTS, SKIRT, GAP = 12.0, 16, 0.45, 5.4  # m: of the boom, its skirt, and between its ends
BASIN, WIDTH, ENDS = 15.0, 9.0, 11.5  # m: the sea that repeats, its breadth, and x of the boom's ends
SPEED, HEIGHT, PERIOD = 0.4, 0.2, 2.0  # m/s, m, s
BARGE = (3.0, 1.5, 0.6)  # m: it draws half of its depth
BARGE_BASIN, BARGE_WIDTH = 14.0, 5.0  # m
DURATION, COUNTED = 24.0, 8.0  # s: of a run, and of its end that counts
ZONE = 3.0  # m: length of the zone that renews current and waves
APEX, WINDOW, WINDOW_DEPTH, ASLEEP = 7.0, 8.0, 1.2, 0.03  # m, m, m, m/s: of the window


class Towed(NamedTuple):
    """A boom over the end of a run: mean tension of its ends [N], line in plan (S + 1, 2) [m], both over time."""

    tension: Double
    line: Double


class Rocked(NamedTuple):
    """A barge over the end of a run: heave [m], pitch [rad], height of the water beside it [m]."""

    heave: Double
    pitch: Double
    water: Double


def _sea(length: float, width: float, spacing: float, threads: int | None, speed: float, height: float) -> Scenario:
    """A sea that repeats along x, with current and waves along -x that a zone at its end renews."""
    zone = ZoneSettings(lower=(length - ZONE, 0.0, 0.0), upper=(length, width, 2.0 * DEPTH))
    waves = RegularSeaWaves(height=height, period=PERIOD, direction=math.pi, build_up=PERIOD) if height else None
    current = SteadySeaCurrent(speed=speed, direction=math.pi) if speed else None
    return Scenario(
        name="without-particles",
        run=RunSettings(duration=DURATION, communication_step=STEP, threads=threads),
        fluid=FluidSettings(particle_spacing=spacing, maximum_time_step=STEP),
        phases={"water": PhaseSettings(density=WATER, dynamic_viscosity=1.05e-3)},
        tank=Tank(
            lower=(0.0, 0.0, 0.0),
            upper=(length, width, 2.0 * DEPTH),
            periodic=("x",),
            open=("+z",),
            zones={"inlet": zone},
        ),
        fill={"water": SlabFill(phase="water", bottom=0.0, top=DEPTH, velocity=(-speed, 0.0, 0.0))},
        sea=SeaSettings(waves=waves, current=current),
    )


def boom_scene(spacing: float, threads: int | None, height: float) -> Scenario:
    """The boom between its ends, in waves of `height` [m]."""
    sides = [(ENDS, 0.5 * (WIDTH + sign * GAP)) for sign in (1.0, -1.0)]
    boom = BoomSettings(
        ends=(sides[0], sides[1]), length=LENGTH, segments=SEGMENTS, skirt_depth=SKIRT, skirt_thickness=spacing,
        freeboard=0.45, buoyancy_to_weight=3.0, ballast_fraction=0.7,
    )  # fmt: skip
    return replace(_sea(BASIN, WIDTH, spacing, threads, SPEED, height), booms={"main": boom})


def barge_scene(spacing: float, threads: int | None) -> Scenario:
    """The barge afloat in waves."""
    barge = BoxBody(size=BARGE, density=0.5 * WATER, position=(0.5 * (BARGE_BASIN - ZONE), 0.5 * BARGE_WIDTH, DEPTH))
    return replace(_sea(BARGE_BASIN, BARGE_WIDTH, spacing, threads, 0.0, HEIGHT), bodies={"barge": barge})


def bare(scenario: Scenario) -> Scenario:
    """The same without particles."""
    return replace(scenario, fidelity="none")


def in_window(scenario: Scenario, aside: float = 0.0) -> Scenario:
    """The same with a window of particles, `aside` [m] of the boom's apex."""
    window = WindowTable(target=(APEX + aside, 0.5 * WIDTH), size=(WINDOW, WINDOW), depth=WINDOW_DEPTH)
    fluid = replace(scenario.fluid, sleep_speed=ASLEEP, maximum_time_step=None)
    return replace(scenario, window=window, fluid=fluid)


def _run(assembly: Assembly, bench: Bench, read) -> list:  # type: ignore[no-untyped-def, type-arg]
    """Run to the end; returns what `read` gives at every step that counts."""
    simulation, found = assembly.co_simulation(), []
    simulation.initialize()
    for index in range(round(DURATION / STEP)):
        simulation.step()
        report = assembly.report()
        bench.count(STEP, 0 if report is None else report.sub_steps, assembly.fluid.particle_count)
        if index * STEP >= DURATION - COUNTED:
            found.append(read())
    simulation.terminate()
    return found


def towed(scenario: Scenario, bench: Bench) -> Towed:
    """Run the boom."""
    assembly = build(scenario)
    world, layout = assembly.world, assembly.fleet.booms["main"]
    assert world is not None
    joints = list(assembly.fleet.tensions_of("main").values())

    def read() -> tuple[float, Double]:
        poses = np.array([world.pose(segment.name) for segment in layout.segments])
        state = BoomState(
            position=poses[:, :3], orientation=poses[:, 3:], velocity=np.zeros((len(poses), 3)),
            joint_points=layout.segment.joint_points, waterline=layout.segment.waterline,
        )  # fmt: skip
        return float(np.mean([world.tension(joint) for joint in joints])), state.line()

    found = _run(assembly, bench, read)
    return Towed(np.array([one for one, _ in found]), np.array([line for _, line in found]))


def rocked(scenario: Scenario, bench: Bench) -> Rocked:
    """Run the barge."""
    assembly = build(scenario)
    world, has_particles = assembly.world, scenario.fidelity != "none"
    assert world is not None
    beside = np.array((0.0, 0.25 * BARGE_WIDTH + 0.25 * BARGE[1] + 0.0))

    def read() -> tuple[float, float, float]:
        pose = world.pose("barge")
        place = pose[:2] + beside
        if has_particles:
            water = float(assembly.fluid.surface_height_at([(place[0] % BARGE_BASIN, place[1])])[0])
        else:
            water = float(world.environment.sea.elevation(place[None], world.time)[0])  # type: ignore[union-attr]
        x, y, z, w = pose[3:]
        return float(pose[2]), math.asin(2.0 * (w * y - z * x)), water

    heave, pitch, water = np.array(_run(assembly, bench, read)).T
    return Rocked(heave, pitch, water)


def shape_apart(one: Towed, other: Towed) -> float:
    """Root mean square distance of the mean lines, in per cent of the boom's length."""
    apart = one.line.mean(axis=0) - other.line.mean(axis=0)
    return 100.0 * float(np.sqrt((apart**2).sum(axis=1).mean())) / LENGTH


def without_particles(resolution: int, bench: Bench) -> Outcome:
    """Case 34: three scenes, twice each."""
    spacing = SKIRT / resolution
    bench.plan(8.0 * DURATION)
    booms = {height: boom_scene(spacing, bench.threads, height) for height in (0.0, HEIGHT)}
    pairs = {height: (towed(scene, bench), towed(bare(scene), bench)) for height, scene in booms.items()}
    windows = {height: towed(in_window(scene), bench) for height, scene in booms.items()}
    barges = [rocked(scene(barge_scene(spacing, bench.threads)), bench) for scene in (replace, bare)]
    values: dict[str, float] = {}
    for height, words in ((0.0, "towed"), (HEIGHT, "in waves")):
        fine, coarse = pairs[height]
        values[f"tension {words}, over that with particles"] = float(coarse.tension.mean() / fine.tension.mean())
        values[f"shape {words}"] = shape_apart(fine, coarse)
        window = windows[height]
        values[f"tension {words} in a window, over that with particles"] = float(
            window.tension.mean() / fine.tension.mean()
        )
        values[f"shape {words} in a window"] = shape_apart(fine, window)
    for name in ("heave", "pitch"):
        fine_share, coarse_share = (float(getattr(one, name).std() / one.water.std()) for one in barges)
        values[f"{name} of the barge, over that with particles"] = coarse_share / fine_share
    seconds = STEP * np.arange(len(barges[0].heave))
    labels = ("particles", "formulas")
    return Outcome(
        values=values,
        traces=(
            *(
                trace("shape", *pair.line.mean(axis=0).T, label)
                for pair, label in zip(pairs[HEIGHT], labels, strict=True)
            ),
            *(
                trace("tension", seconds, pair.tension, label)
                for pair, label in zip(pairs[HEIGHT], labels, strict=True)
            ),
            *(trace("heave", seconds, barge.heave, label) for barge, label in zip(barges, labels, strict=True)),
            *(
                trace("pitch", seconds, np.degrees(barge.pitch), label)
                for barge, label in zip(barges, labels, strict=True)
            ),
        ),
    )


WITHOUT_PARTICLES = Case(
    number=34,
    name="without-particles",
    title="A boom and a barge with particles and without, towed and in waves",
    source="the particle fluid itself; gates of 10 % for tension, heave and pitch, and 3 % of the length for the shape",
    setup=f"a boom of {LENGTH:g} m with a skirt of s = {SKIRT:g} m between ends {GAP:g} m apart in a current of {SPEED:g} m/s, calm and in "
    f"waves of {HEIGHT:g} m and {PERIOD:g} s; a free barge of {BARGE[0]:g} x {BARGE[1]:g} m that draws {0.5 * BARGE[2]:g} m in the same "
    f"waves; water {DEPTH:g} m deep, {DURATION:g} s each, the last {COUNTED:g} s count",
    length=SKIRT,
    length_symbol="s",
    resolutions=(3, 4, 5),
    quantities=(
        Quantity(name="tension towed, over that with particles", unit="1", reference=1.0, gate=0.1),
        Quantity(name="shape towed", unit="% of the length", reference=0.0, scale=1.0, gate=3.0),
        Quantity(name="tension in waves, over that with particles", unit="1", reference=1.0, gate=0.1),
        Quantity(name="shape in waves", unit="% of the length", reference=0.0, scale=1.0, gate=3.0),
        Quantity(name="tension towed in a window, over that with particles", unit="1", reference=1.0, gate=0.05),
        Quantity(name="shape towed in a window", unit="% of the length", reference=0.0, scale=1.0, gate=2.0),
        Quantity(name="tension in waves in a window, over that with particles", unit="1", reference=1.0, gate=0.05),
        Quantity(name="shape in waves in a window", unit="% of the length", reference=0.0, scale=1.0, gate=2.0),
        Quantity(name="heave of the barge, over that with particles", unit="1", reference=1.0, gate=0.1),
        Quantity(name="pitch of the barge, over that with particles", unit="1", reference=1.0, gate=0.1),
    ),
    panels=(
        Panel("shape", "x [m]", "y [m], mean line in waves"),
        Panel("tension", "t [s]", "tension of the ends in waves [N]"),
        Panel("heave", "t [s]", "height of the barge [m]"),
        Panel("pitch", "t [s]", "pitch of the barge [deg]"),
    ),
    own_step=True,
    run=without_particles,
    spacings=1,
    note="the skirt is three to five spacings deep, as in exercises, and as thick as the spacing.",
)

"""The cost of a scenario, estimated before it is run: particles, memory and time.

Particles at the start are counted exactly. Time and memory are estimates from constants measured on a 2-core machine
(`SECONDS_PER_PARTICLE_STEP`, `BYTES_PER_PARTICLE`, ...), that of windows from the speed of this one; splashing liquids take longer and
calm ones less.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.core.config import FluidConfig, longest_time_step
from oilsim.window.settings import WindowSettings, fluid_steps
from scenarios.schema.bodies import Fixed, Free
from scenarios.schema.exercise import TowSettings
from scenarios.schema.injects import InjectSettings
from scenarios.schema.liquid import BlockFill, Fill, PipeEmitterSettings, SlabFill, Tank
from scenarios.setup.at_sea.build_sea import build_sea
from scenarios.setup.fill_lattice import misfits, starting_positions, surface_off
from scenarios.spec.resolve import RunSpec, resolve
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from scenarios.setup.solids.placed_solids import Solid


SECONDS_PER_PARTICLE_STEP = 1.2e-6  # of the fluid, on 2 threads: calm-spread, u-sweep
SECONDS_PER_STEP = 1.5e-3  # of the fluid, whatever its particles: rock-coating before oil flows
SECONDS_PER_BODY_STEP = 5e-4  # of each body that moves beside particles, for a communication step of u-sweep
SECONDS_PER_SEA_STEP = 2e-3  # of bodies in a sea by formulas, with slick and recording: sweep-200m, j-sweep-skimmer
SECONDS_PER_FLOATING_BODY_STEP = 3.3e-5  # of each of them in addition: harbour-1km
TYPICAL_SPEED = (
    0.15  # of sqrt(g h), at which liquid meets liquid over a run of calm-spread; what falls together meets none
)
REFERENCE_THREADS = 2
SERIAL_SHARE = 0.15  # of the reference time, that more threads do not shorten
BYTES_PER_PARTICLE = 1300.0  # fluid: state and neighbour lists
BYTES_PER_BOUNDARY_PARTICLE = 350.0
BYTES_AT_REST = 210e6  # the program and its libraries
START_SECONDS = 4.0  # imports, compiled kernels from the cache, building
BOUNDARY_SPACING = 0.64  # of the particle spacing, between wall particles


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Particles, memory and time of a run.

    particles, emitted: at the start and from pipes, by phase; left_out: what bodies take of the liquid, in words, by region; wall and
    surface particles; memory [bytes]; fluid steps; wall time [s] on `threads` threads; warnings of thin bodies and of mended meshes.
    """

    particles: Mapping[str, int]
    emitted: Mapping[str, int]
    left_out: Mapping[str, str]
    boundary: Mapping[str, int]
    steps: int
    threads: int
    memory: float
    seconds: float
    told: tuple[str, ...] = ()


def require_memory(spec: RunSpec) -> None:
    """Require that this machine's memory can hold the scene, before anything is built; else ScenarioError.

    Volumes and areas alone tell it.
    """
    fluid = spec.fluid
    plane = fluid.dimension == 2
    counts = {f"fill.{name}": _filled(fill, spec.domain, plane) for name, fill in spec.fill.items()}
    needs = {
        key: BYTES_PER_PARTICLE * measure / fluid.particle_spacing**fluid.dimension for key, measure in counts.items()
    }
    pitch = BOUNDARY_SPACING * fluid.particle_spacing
    closed = _wall_measure(spec.domain, plane) if spec.in_tank else 0.0
    needs["tank"] = BYTES_PER_BOUNDARY_PARTICLE * closed / pitch ** (fluid.dimension - 1)
    needs |= {"emitters": BYTES_PER_PARTICLE * sum(_emitted(spec).values())}
    windows = dict(zip(("window", "window.outer"), spec.window.boxes(spec.fluid) if spec.window else (), strict=False))
    needs |= {key: BYTES_PER_PARTICLE * one.particle_count for key, one in windows.items()}
    there = memory_there()
    if sum(needs.values()) > there:
        key = max(needs, key=lambda key: needs[key])
        spacing = f"fluid.particle_spacing = {fluid.particle_spacing:g} m"
        if key in windows:
            spacing = f"a spacing of {windows[key].spacing:g} m"
        text = f"needs about {needs[key] / 1e9:,.0f} GB at {spacing}"
        allowed = f"a larger spacing or less to fill, up to the {there / 1e9:,.0f} GB of this machine"
        raise ScenarioError([Problem(key, f"{text}, allowed: {allowed}")])


def memory_there() -> float:
    """Return the memory [bytes] of this machine, or the limit of the container that this program runs in if that is lower."""
    whole = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    try:
        limit = Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii").strip()
    except OSError:
        return whole
    return min(whole, float(limit)) if limit.isdecimal() else whole


def _filled(fill: Fill, tank: Tank, plane: bool) -> float:
    """Volume [m3] of a region, in two dimensions its area; at most the tank's."""
    extent = np.array(tank.upper) - np.array(tank.lower)
    if isinstance(fill, BlockFill):
        extent = np.minimum(extent, np.array(fill.upper) - np.array(fill.lower))
    elif isinstance(fill, SlabFill):
        extent[2] = min(extent[2], fill.top - fill.bottom)
    else:
        extent = np.minimum(extent, (2.0 * fill.radius, 2.0 * fill.radius, fill.height))
    return float(extent[0] * extent[2] if plane else extent.prod())


def estimate(scenario: Scenario | RunSpec) -> Cost:
    """Estimate the cost of a run; ScenarioError with everything that cannot be built or placed."""
    spec = resolve(scenario)
    run = spec.run
    require_memory(spec)
    positions, left_out, solids, level, of_chart = _start(spec)
    particles = dict.fromkeys(spec.phases, 0)
    for name, points in positions.items():
        particles[spec.fill[name].phase] += len(points)
    windows = () if spec.window is None else spec.window.boxes(spec.fluid)
    for window in windows:
        water = next(name for name, phase in sorted(spec.phases.items(), key=lambda item: item[1].is_oil))
        particles[water] += window.particle_count
    emitted = _emitted(spec)
    boundary = _boundary(spec, solids) if spec.in_tank else {}
    threads = run.threads or os.cpu_count() or 1
    steps = _steps(spec, [float(points[:, 2].max()) for points in positions.values()], _moving(spec))
    remarks = _of_windows(spec, windows, solids, level)
    most, walls = sum(particles.values()) + sum(emitted.values()), sum(boundary.values())
    share = SERIAL_SHARE + (1.0 - SERIAL_SHARE) * REFERENCE_THREADS / threads
    alive = sum(particles.values()) + 0.5 * sum(emitted.values())
    each = SECONDS_PER_STEP + SECONDS_PER_PARTICLE_STEP * share * alive if spec.in_tank else 0.0
    if windows:
        from scenarios.spec.window_choice import seconds_per_particle_step  # measures for a fifth of a second

        moved = sum(
            fluid_steps(one, spec.fluid.gravity, run.communication_step) * one.particle_count for one in windows
        )
        each = moved * seconds_per_particle_step(run.threads)
    return Cost(
        particles=particles,
        emitted=emitted,
        left_out=left_out,
        boundary=boundary,
        steps=steps,
        threads=threads,
        memory=BYTES_AT_REST + BYTES_PER_PARTICLE * most + BYTES_PER_BOUNDARY_PARTICLE * walls,
        told=(
            *_told(spec, solids, level, _of_interfaces(spec, positions)),
            *spec.left_out_in_words,
            *never_comes(run.duration, spec.tow, {**spec.emitters, **spec.sources}, spec.injects),
            *remarks,
            *of_chart,
        ),
        seconds=START_SECONDS + steps * each + _body_seconds(spec),
    )


def _of_windows(
    spec: RunSpec, windows: Sequence[WindowSettings], solids: Sequence[Solid], level: float
) -> tuple[str, ...]:
    """Return what is to be told of a window and its outer one; empty without one."""
    if spec.window is None:
        return ()
    from scenarios.setup.at_sea.window import require_water, window_facts, window_remarks  # only such a run pays for it

    sea = build_sea(spec.sea_at(level), spec)
    beyond = require_water(spec.window.target, windows[-1], solids, level) if solids else ()
    remarks = window_remarks(spec.window.target, windows, sea, spec.booms, spec.places)
    return (*window_facts(windows, spec.fluid.gravity, spec.run.communication_step), *remarks, *beyond)


def _start(spec: RunSpec) -> tuple[Mapping[str, Array], Mapping[str, str], Sequence[Solid], float, tuple[str, ...]]:
    """Return particles by region, the liquid that bodies displace in words, all bodies, the level of the water [m], and words on a chart.

    Level and chart are looked at with bodies only, whose code is imported only if needed.
    """
    if not (spec.bodies or spec.vessels or spec.booms or spec.emitters):
        fluid, domain = spec.fluid, spec.domain
        positions = starting_positions(spec.fill, domain, fluid.particle_spacing, fluid.dimension)
        top = max((float(one[:, 2].max()) for one in positions.values() if len(one)), default=domain.lower[2])
        if spec.sea.waves or spec.sea.current or spec.sea.wind:
            build_sea(spec.sea_at(top), spec)  # for its problems
        return positions, {}, (), 0.0, ()
    from scenarios.setup.layout import lay_out

    layout = lay_out(spec)
    words = (*layout.chart.facts, *layout.chart.notes)
    return layout.positions, layout.left_out, layout.solids, layout.waters.level, words


def _of_interfaces(spec: RunSpec, positions: Mapping[str, Array]) -> list[str]:
    """Say what is to be said of air and of interfaces that pull; only they pay for the import."""
    if not spec.fluid.interfacial_tension:
        return []
    from scenarios.setup.fluid import air_remarks, interface_remarks

    has_bodies = bool(spec.bodies)
    return [
        *air_remarks(spec, positions, has_bodies=has_bodies),
        *interface_remarks(spec, positions),
    ]


def _told(spec: RunSpec, solids: Sequence[Solid], level: float, interfaces: Sequence[str]) -> tuple[str, ...]:
    """List the warnings of fills, interfaces, bodies, booms and the sea with which a run would start; `level` [m] of the water.

    Code that loads trimesh and numba is imported only for what needs it.
    """
    fluid, assumed = spec.fluid, list(interfaces)
    if spec.booms or fluid.interfacial_tension:
        from scenarios.setup.afloat.boom_losses import assumed_tensions

        assumed += assumed_tensions(spec)
    fills = tuple(misfits(spec.fill, spec.domain, fluid.particle_spacing, fluid.dimension).values())
    fills += surfaces_off(spec)
    if not solids or not spec.tanks:
        return (*fills, *(note for solid in solids for note in solid.notes), *assumed)
    from scenarios.setup.afloat.boom_remarks import boom_remarks
    from scenarios.setup.solids.placed_solids import thin_bodies, thin_samplings

    thin = thin_bodies(solids, thin_samplings(solids, fluid.particle_spacing), fluid.particle_spacing)
    return (
        *fills, *(note for solid in solids for note in solid.notes), *thin.values(),
        *boom_remarks(spec, level).values(), *assumed,
    )  # fmt: skip


def surfaces_off(spec: RunSpec) -> tuple[str, ...]:
    """Return what is to be said of a surface that is not where the file has it; empty where nothing floats by the file's heights."""
    if not spec.tanks or not any(isinstance(body.motion, Free) for body in spec.bodies.values()):
        return ()
    return tuple(surface_off(spec.fill, spec.domain, spec.fluid.particle_spacing, spec.fluid.dimension))


def _body_seconds(spec: RunSpec) -> float:
    """Estimate the time [s] that bodies take: in the fluid's pressure solve, with their joints, in the rigid solver, or in a sea."""
    moving, steps = _moving(spec), spec.run.duration / spec.run.communication_step
    if spec.tanks:
        return SECONDS_PER_BODY_STEP * moving * steps
    if moving:
        from scenarios.setup.layout import SEA_SUB_STEP  # its libraries are loaded where there are bodies

        steps *= math.ceil(spec.run.communication_step / SEA_SUB_STEP - 1e-9)
    return (SECONDS_PER_SEA_STEP + SECONDS_PER_FLOATING_BODY_STEP * moving) * steps


def _moving(spec: RunSpec) -> int:
    """Count the bodies that move."""
    of_table = sum(not isinstance(body.motion, Fixed) for body in spec.bodies.values())
    return of_table + len(spec.vessels) + sum(boom.segments for boom in spec.booms.values())


def _emitted(spec: RunSpec) -> dict[str, int]:
    """Count the particles that pipes let in until the end, by phase: pi r^2 speed while the pipe is open."""
    d, end = spec.spacing, spec.run.duration
    emitted: dict[str, int] = {}
    for pipe in spec.emitters.values():
        poured = math.pi * pipe.radius**2 * pipe.speed * max(0.0, end - pipe.start)
        volume = poured if pipe.volume is None else min(poured, pipe.volume)
        emitted[pipe.phase] = emitted.get(pipe.phase, 0) + round(volume / d**3)
    return emitted


def _boundary(spec: RunSpec, solids: Sequence[Solid]) -> dict[str, int]:
    """Count wall and surface particles: area / the area of each; in a plane, length / the length of each."""
    pitch = BOUNDARY_SPACING * spec.spacing
    plane = spec.fluid.dimension == 2
    counts = {"tank": round(_wall_measure(spec.domain, plane) / pitch ** (1 if plane else 2))}
    for solid in solids:
        if solid.wetted:
            group = solid.name.split("/")[0]
            counts[group] = counts.get(group, 0) + round(float(solid.placed.mesh.area) / pitch**2)
    return counts


def _wall_measure(tank: Tank, plane: bool) -> float:
    """Return the area [m2] of the closed sides; in two dimensions their length in x and z [m]."""
    extent = np.array(tank.upper) - np.array(tank.lower)
    if plane:
        extent[1] = 1.0
    sides = [side for side in tank.closed_sides if not (plane and side[1] == "y")]
    return float(sum(np.prod(np.delete(extent, "xyz".index(side[1]))) for side in sides))


def longest_step(spec: RunSpec) -> float:
    """Return the longest step [s] that the settings, the spacing and tensions allow; ScenarioError where they leave none."""
    if not spec.fluid.interfacial_tension:
        return longest_time_step(spec.fluid)
    from scenarios.setup.fluid import fluid_config  # only interfaces that pull pay for the import

    try:
        config = fluid_config(spec)
    except ValueError as problem:
        raise ScenarioError([Problem("", f"fluid cannot be built: {problem}")]) from problem
    return min(config.longest_time_step, config.capillary_time_step)


def _steps(spec: RunSpec, tops: list[float], moving: int) -> int:
    """Estimate the steps of the fluid from the communication step, the largest step, and the speed at which liquid meets liquid.

    Over the whole run that is `TYPICAL_SPEED` sqrt(g h), with h the height from the tank's floor to the highest liquid at the start
    (`tops` of the regions [m], and pipes). This is less than in a dam break and more than in water at rest. Where bodies move, a whole
    number of steps fills a communication step. Without particles, steps are those of the communication.
    """
    settings, run = spec.fluid, spec.run
    communications = math.ceil(run.duration / run.communication_step - 1e-9)
    if not spec.in_tank:
        return communications
    tops = tops + [pipe.mouth[2] for pipe in spec.emitters.values()]
    gravity = float(np.linalg.norm(settings.gravity))
    speed = TYPICAL_SPEED * math.sqrt(gravity * max(0.0, max(tops, default=-math.inf) - spec.domain.lower[2]))
    free = FluidConfig.cfl * settings.particle_spacing / speed if speed > 0.0 else math.inf
    step = max(settings.minimum_time_step, min(longest_step(spec), run.communication_step, free))
    each = run.communication_step / step - 1e-9
    return math.ceil(communications * (math.ceil(each) if moving else each))


def never_comes(
    end: float, tow: TowSettings | None, pipes: Mapping[str, PipeEmitterSettings], injects: Mapping[str, InjectSettings]
) -> Iterator[str]:
    """Say in words what never comes of a tow, pipes and injects in a run that ends at `end` [s]."""
    after = f"the run ends at {end:g} s (run.duration)"
    if tow is not None and tow.start >= end:
        yield f"tow.start is {tow.start:g} s: the vessels never get under way, as {after}"
    for name, emitter in pipes.items():
        if emitter.start >= end:
            yield f"emitters.{name}.start is {emitter.start:g} s: nothing flows, as {after}"
    for name, inject in injects.items():
        if inject.at is not None and inject.at - inject.spread >= end:
            yield f"injects.{name}.at is {inject.at:g} s: it never comes, as {after}"

"""The cost of a scenario, estimated before it is run: particles, memory and time.

Particles at the start are counted exactly. Time and memory are estimates from constants measured on a 2-core machine
(`SECONDS_PER_PARTICLE_STEP`, `BYTES_PER_PARTICLE`, ...); splashing liquids take longer and calm ones less.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenarios.scenario import Scenario
from scenarios.schema.bodies import Fixed
from scenarios.schema.liquid import Tank
from scenarios.setup.fill_lattice import Array, starting_positions

if TYPE_CHECKING:
    from scenarios.setup.placed_solids import Solid

SECONDS_PER_PARTICLE_STEP = 2.0e-6  # of the fluid, on 2 threads: falling, splashing and calm water of calm-spread
SECONDS_PER_BODY_STEP = 5e-4  # of each body that moves, for a communication step of u-sweep
TYPICAL_SPEED = 0.75  # of sqrt(g h), the fastest particle over a whole run
REFERENCE_THREADS = 2
SERIAL_SHARE = 0.15  # of the reference time, that more threads do not shorten
BYTES_PER_PARTICLE = 1300.0  # fluid: state and neighbour lists
BYTES_PER_BOUNDARY_PARTICLE = 350.0
BYTES_AT_REST = 210e6  # the program and its libraries
START_SECONDS = 4.0  # imports, compiled kernels from the cache, building
BOUNDARY_SPACING = 0.64  # of the particle spacing, between wall particles


@dataclass(frozen=True, kw_only=True)
class Cost:
    """Particles at the start by phase, particles that pipes add by phase, what bodies take of the liquid in words by region, wall and
    surface particles; memory [bytes]; fluid steps; wall time [s] on `threads` threads; and what else is told of bodies: of thin ones and
    of meshes that were mended."""

    particles: Mapping[str, int]
    emitted: Mapping[str, int]
    left_out: Mapping[str, str]
    boundary: Mapping[str, int]
    steps: int
    threads: int
    memory: float
    seconds: float
    told: tuple[str, ...] = ()


def estimate(scenario: Scenario) -> Cost:
    """The cost of a run; ScenarioError with everything that cannot be made or placed."""
    positions, left_out, solids = _start(scenario)
    particles = dict.fromkeys(scenario.phases, 0)
    for name, points in positions.items():
        particles[scenario.fill[name].phase] += len(points)
    emitted = _emitted(scenario)
    boundary = _boundary(scenario, solids)
    threads = scenario.run.threads or os.cpu_count() or 1
    steps = _steps(scenario, [float(points[:, 2].max()) for points in positions.values()])
    alive = sum(particles.values()) + 0.5 * sum(emitted.values())
    most, walls = sum(particles.values()) + sum(emitted.values()), sum(boundary.values())
    share = SERIAL_SHARE + (1.0 - SERIAL_SHARE) * REFERENCE_THREADS / threads
    return Cost(
        particles=particles,
        emitted=emitted,
        left_out=left_out,
        boundary=boundary,
        steps=steps,
        threads=threads,
        memory=BYTES_AT_REST + BYTES_PER_PARTICLE * most + BYTES_PER_BOUNDARY_PARTICLE * walls,
        told=_told(scenario, solids),
        seconds=START_SECONDS + SECONDS_PER_PARTICLE_STEP * share * alive * steps + _body_seconds(scenario),
    )


def _start(scenario: Scenario) -> tuple[Mapping[str, Array], Mapping[str, str], Sequence[Solid]]:
    """Particles by region, what bodies take of them in words, and all bodies; what makes these is loaded only where there are any."""
    if not (scenario.bodies or scenario.vessels or scenario.booms or scenario.emitters):
        fluid = scenario.fluid
        return starting_positions(scenario.fill, scenario.tank, fluid.particle_spacing, fluid.dimension), {}, ()
    from scenarios.setup.layout import lay_out

    layout = lay_out(scenario)
    return layout.positions, layout.left_out, layout.solids


def _told(scenario: Scenario, solids: Sequence[Solid]) -> tuple[str, ...]:
    """What a run would tell of its bodies as it starts."""
    if not solids:
        return ()
    from scenarios.setup.thin_bodies import thin_bodies, thin_samplings

    spacing = scenario.fluid.particle_spacing
    thin = thin_bodies(solids, thin_samplings(solids, spacing), spacing)
    return (*(note for solid in solids for note in solid.notes), *thin.values())


def _body_seconds(scenario: Scenario) -> float:
    """Time [s] that moving bodies take: in the fluid's pressure solve, with their joints, and in the rigid solver."""
    moving = sum(not isinstance(body.motion, Fixed) for body in scenario.bodies.values())
    moving += len(scenario.vessels) + sum(boom.segments for boom in scenario.booms.values())
    return SECONDS_PER_BODY_STEP * moving * scenario.run.duration / scenario.run.communication_step


def _emitted(scenario: Scenario) -> dict[str, int]:
    """Particles that pipes let in until the end, by phase: pi r^2 speed for as long as the pipe is open."""
    d = scenario.fluid.particle_spacing
    emitted: dict[str, int] = {}
    for pipe in scenario.emitters.values():
        poured = math.pi * pipe.radius**2 * pipe.speed * max(0.0, scenario.run.duration - pipe.start)
        volume = poured if pipe.volume is None else min(poured, pipe.volume)
        emitted[pipe.phase] = emitted.get(pipe.phase, 0) + round(volume / d**3)
    return emitted


def _boundary(scenario: Scenario, solids: Sequence[Solid]) -> dict[str, int]:
    """Wall and surface particles: area over the area of each; in a plane, length over the length of each."""
    pitch = BOUNDARY_SPACING * scenario.fluid.particle_spacing
    plane = scenario.fluid.dimension == 2
    counts = {"tank": round(_wall_measure(scenario.tank, plane) / pitch ** (1 if plane else 2))}
    for solid in solids:
        if solid.wetted:
            group = solid.name.split("/")[0]
            counts[group] = counts.get(group, 0) + round(float(solid.placed.mesh.area) / pitch**2)
    return counts


def _wall_measure(tank: Tank, plane: bool) -> float:
    """Area of the closed sides [m2]; in two dimensions their length in x and z [m]."""
    extent = np.array(tank.upper) - np.array(tank.lower)
    if plane:
        extent[1] = 1.0
    sides = [side for side in tank.closed_sides if not (plane and side[1] == "y")]
    return float(sum(np.prod(np.delete(extent, "xyz".index(side[1]))) for side in sides))


def _steps(scenario: Scenario, tops: list[float]) -> int:
    """Steps of the fluid: by the communication step, the largest step, and how far the fastest particle may move.

    Its speed, over the whole run, is taken as `TYPICAL_SPEED` sqrt(g h), h the height from the tank's floor to the highest
    liquid at the start (`tops` of the regions [m], and pipes): less than what a dam break reaches, more than water at rest.
    """
    settings, run = scenario.fluid, scenario.run
    tops = tops + [pipe.mouth[2] for pipe in scenario.emitters.values()]
    gravity = float(np.linalg.norm(settings.gravity))
    speed = TYPICAL_SPEED * math.sqrt(gravity * max(0.0, max(tops) - scenario.tank.lower[2]))
    free = settings.cfl * settings.particle_spacing / speed if speed > 0.0 else math.inf
    step = max(settings.minimum_time_step, min(settings.maximum_time_step, run.communication_step, free))
    per_communication = math.ceil(run.communication_step / step - 1e-9)
    return math.ceil(run.duration / run.communication_step - 1e-9) * per_communication

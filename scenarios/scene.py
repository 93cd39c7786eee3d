"""The simulators of a run: the fluid, the rigid bodies that it meets, and who of them answers to the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from coupling.attachment import swelling
from coupling.participants.fluid import FluidParticipant
from coupling.rigid_body_world import RigidBodyWorld
from coupling.surface_sampling import SurfaceSampling, particles_of, sample_surface
from oilsim.solver import Fluid
from scenarios.build_fluid import build_fluid, fill_positions, pipe_problems, water_level
from scenarios.fleet import LINE_RELAXATION_TIME, Fleet, place_fleet
from scenarios.liquid import Tank
from scenarios.probes import BodyProbe
from scenarios.problems import Problem, ScenarioError, problems_of
from scenarios.scenario import Scenario
from scenarios.solids import Solid, own_solids, table_entry, vector

FLUID = "fluid"
TOUCHING = 0.5  # spacings that bodies may lie in each other at the start: rigid shapes of free bodies are convex


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """What a scenario describes, as simulators.

    level: of the still water [m]; solids: all bodies, those of the fleet too; coupled: names of those that exchange motion and
    wrench with the fluid; tank: the fluid's handle of the tank's sides, None without closed ones; world: None if nothing is coupled;
    swelling: how many times its volume the fluid meets of a body with parts thinner than a particle, by name.
    """

    scenario: Scenario
    level: float
    fleet: Fleet
    solids: tuple[Solid, ...]
    coupled: tuple[str, ...]
    fluid: Fluid
    tank: int | None
    fluid_participant: FluidParticipant
    world: RigidBodyWorld | None
    swelling: Mapping[str, float]

    def wrench(self, body: str) -> NDArray[np.float64]:
        """The fluid's wrench (6,) [N, N m] on a body; 0 on one that is not coupled."""
        return self.fluid_participant.get(f"{body}.wrench") if body in self.coupled else np.zeros(6)


def build_scene(scenario: Scenario) -> Scene:
    """Fill the tank and place the bodies; ScenarioError for what cannot be made."""
    level = water_level(scenario, fill_positions(scenario))
    fleet = place_fleet(scenario, level)
    solids = (*own_solids(scenario), *fleet.solids)
    meshes = {solid.name: solid.world_mesh() for solid in solids if solid.wetted}
    problems = list(pipe_problems(scenario, meshes))
    if problems:
        raise ScenarioError(problems)
    positions = fill_positions(scenario, meshes.values())
    with problems_of("fluid", "cannot be made"):
        fluid, tank = build_fluid(scenario, positions)
    coupled = _coupled(scenario, solids)
    samplings = _sampled(solids, scenario.fluid.particle_spacing)
    handles = _wet(fluid, solids, samplings, coupled)
    return Scene(
        scenario=scenario,
        level=level,
        fleet=fleet,
        solids=solids,
        coupled=coupled,
        fluid=fluid,
        tank=tank,
        fluid_participant=FluidParticipant(FLUID, fluid, {name: handles[name] for name in coupled}),
        world=_world(scenario, solids, fleet) if coupled else None,
        swelling={
            solid.name: swelling(samplings[id(solid.placed.mesh)], float(solid.placed.mesh.volume))
            for solid in solids
            if solid.wetted
        },
    )


def _coupled(scenario: Scenario, solids: Sequence[Solid]) -> tuple[str, ...]:
    """Bodies that exchange motion and wrench with the fluid: those that move, and held ones whose force is asked for."""
    probed = {probe.body for probe in scenario.probes.values() if isinstance(probe, BodyProbe)}
    return tuple(solid.name for solid in solids if solid.wetted and (solid.motion != "fixed" or solid.name in probed))


def _sampled(solids: Sequence[Solid], particle_spacing: float) -> dict[int, SurfaceSampling]:
    """The surfaces of all wetted solids, by the id of their mesh: bodies of one mesh, such as a boom's segments, share its sampling."""
    samplings: dict[int, SurfaceSampling] = {}
    for solid in solids:
        mesh = solid.placed.mesh
        if solid.wetted and id(mesh) not in samplings:
            with problems_of(table_entry(solid.name), "cannot be sampled with particles"):
                samplings[id(mesh)] = sample_surface(mesh, particle_spacing)
    return samplings


def _wet(
    fluid: Fluid, solids: Sequence[Solid], samplings: Mapping[int, SurfaceSampling], coupled: Sequence[str]
) -> dict[str, int]:
    """Give the fluid the surfaces of all wetted solids; returns their handles by name.

    A coupled one is placed about its centre of mass, another where it stands for good.
    """
    handles = {}
    for solid in solids:
        if not solid.wetted:
            continue
        surface = particles_of(solid.name, samplings[id(solid.placed.mesh)], no_slip=solid.no_slip)
        if solid.name not in coupled:
            rotation = Rotation.from_quat(solid.placed.orientation)
            surface = replace(surface, position=rotation.apply(surface.position) + solid.placed.position)
        handles[solid.name] = fluid.add_boundary(surface)
    return handles


def _world(scenario: Scenario, solids: Sequence[Solid], fleet: Fleet) -> RigidBodyWorld:
    """All solids and joints in one rigid body world; the tank's walls too, if anything could run into them."""
    world = RigidBodyWorld(gravity=scenario.fluid.gravity, communication_step=scenario.run.communication_step)
    for solid in solids:
        placed = solid.placed
        x, y, z, w = (float(part) for part in placed.orientation)
        world.add_body(
            placed.name,
            placed.mesh,
            placed.mass_properties,
            vector(placed.position),
            (x, y, z, w),
            motion=solid.motion,
            linear_velocity=solid.linear_velocity,
            angular_velocity=solid.angular_velocity,
            contact=solid.contact,
        )
    if any(solid.motion == "free" and solid.contact for solid in solids):
        _add_tank_sides(world, scenario.tank)
    for joint in fleet.joints:
        world.add_joint(joint.name, joint.body_a, joint.body_b, vector(joint.point))
    for line in fleet.lines:
        with problems_of(f"booms.{line.name.split('/')[1]}.line_stiffness", "cannot be used"):
            world.add_line(
                line.name,
                line.body_a,
                line.body_b,
                (vector(line.points[0]), vector(line.points[1])),
                length=line.length,
                stiffness=line.stiffness,
                relaxation_time=LINE_RELAXATION_TIME,
            )
    _require_apart(world, scenario.fluid.particle_spacing)
    return world


def _require_apart(world: RigidBodyWorld, spacing: float) -> None:
    """Bodies that lie deep in each other, or in a side of the tank, would be thrown apart by the first step."""
    allowed = TOUCHING * spacing
    problems = []
    for one, other, depth in world.overlaps():
        if depth > allowed:
            where = f"body {other!r}" if other else "a side of the tank"
            text = f"has body {one!r} lie {depth:.2g} m deep in {where} at the start, allowed: up to {allowed:.2g} m"
            problems.append(Problem(table_entry(one), text))
    if problems:
        raise ScenarioError(problems)


def _add_tank_sides(world: RigidBodyWorld, tank: Tank) -> None:
    """Let bodies run into the closed sides of the tank, which go on beyond its other sides."""
    for side in tank.closed_sides:
        inward = 1.0 if side[0] == "-" else -1.0
        normal = inward * np.eye(3)["xyz".index(side[1])]
        world.add_half_space(tank.lower if inward > 0.0 else tank.upper, vector(normal))

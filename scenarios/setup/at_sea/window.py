"""The window of a run with run.detail = "window": particles around a target, inside the sea by formulas (`oilsim.window`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from coupling.assembly import FLUID, CoupledBodies, couple_participant
from coupling.participants.rigid_bodies import Asked
from coupling.participants.slick import SlickParticipant
from coupling.participants.window import SharedEnvironment, Target, WindowBody, WindowParticipant
from coupling.rigid.rigid_body_world import RigidBodyWorld
from coupling.solids.surface_sampling import SurfaceSampling, particles_of
from oilsim.phases import Phase
from oilsim.sea import Sea
from oilsim.window.oil_exchange import OilExchange
from oilsim.window.surface_motion import WindowFlow
from oilsim.window.window import Window
from scenarios.problems import Problem, ScenarioError
from scenarios.scenario import Scenario
from scenarios.schema.exercise import body_of
from scenarios.schema.parsing.quantity_fields import Point2
from scenarios.setup.fleet import Fleet
from scenarios.setup.placed_solids import Solid

# [1] layers of water that a window needs; numerical; as its own depth
LEAST_LAYERS = 4


def build_window(scenario: Scenario, sea: Sea) -> Window:
    """Fill the window of a scenario with water, other liquids come later; ScenarioError on water too shallow for its particles."""
    assert scenario.window is not None
    phases = sorted(scenario.phases.items(), key=lambda item: item[1].is_oil)
    liquids = tuple(
        Phase(name=name, rest_density=phase.rest_density, dynamic_viscosity=phase.viscosity, adhesion=phase.adhesion)
        for name, phase in phases
    )
    settings = scenario.window.settings(scenario.fluid)
    if sea.description.depth < LEAST_LAYERS * settings.spacing:
        text = f"is {settings.spacing:g} m, allowed in a window on water {sea.description.depth:g} m deep: up to a quarter of that"
        raise ScenarioError([Problem("fluid.particle_spacing", text)], scenario.name)
    return Window(settings, sea, liquids, scenario.run.threads)


def couple_window(
    window: Window,
    target: Target,
    wetted: Sequence[Solid],
    samplings: Mapping[int, SurfaceSampling],
    world: RigidBodyWorld | None,
    followed: Sequence[str],
) -> CoupledBodies:
    """Couple a window with all bodies that may meet it; formulas load them with what the window leaves.

    followed: names of the bodies whose poses the slick asks for.
    """
    met = [] if world is None else wetted
    bodies = {
        solid.name: WindowBody(
            surface=particles_of(solid.name, samplings[id(solid.placed.mesh)], no_slip=solid.no_slip),
            mesh=solid.placed.mesh,
        )
        for solid in met
    }
    participant = WindowParticipant(FLUID, window, bodies, target)
    if world is not None and world.environment is not None:
        shared = SharedEnvironment(world.environment, world.loaded_names, participant.shares)
        world.change_environment(shared)
    asked = None if world is None else Asked(world.body_names, followed)
    return couple_participant(participant, window.fluid, tuple(bodies), world, asked=asked)


def exchange_oil(window: Window, slick: SlickParticipant) -> None:
    """Let a slick's oil become particles of the window and back, and let the window's water carry what stays parcels."""
    exchange = OilExchange(window)
    slick.meet(exchange, WindowFlow(slick.flow, exchange.surface))


def target_of(target: str | Point2, fleet: Fleet) -> Target:
    """Return the place that a window follows, by the poses of bodies: the middle segment of a boom, a vessel, a body, or a place."""
    if not isinstance(target, str):
        return lambda poses: np.array(target)
    if target in fleet.booms:
        segments = fleet.booms[target].segments
        name = segments[len(segments) // 2].name
    else:
        name = body_of(target) if any(vessel.name == target for vessel in fleet.vessels) else target
    return lambda poses: poses[name][:2]

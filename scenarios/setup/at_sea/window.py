"""The windows of a run: particles around targets, inside the sea by formulas (`oilsim.window`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from booms.losses.closure_losses import STANDING
from booms.losses.resolution import Resolution
from booms.scores import PLANING_ANGLE
from coupling.bullet.assembly import FLUID, CoupledBodies, couple_participant
from coupling.bullet.rigid_body_participant import Requested
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.participants.slick import SlickParticipant
from coupling.participants.window import SharedEnvironment, Target, WindowBody, WindowParticipant
from coupling.participants.windows import WindowsParticipant, overlap
from oilsim import Phase
from oilsim.sea import Sea
from oilsim.window.joint_exchange import JointExchange
from oilsim.window.oil_exchange import OilExchange
from oilsim.window.resolved_parcels import CoarseSkirts
from oilsim.window.surface_motion import WindowFlow
from oilsim.window.window import Window
from scenarios.problems import Problem, ScenarioError
from scenarios.schema.exercise import BoomSettings, body_of
from scenarios.schema.parsing.quantity_fields import Point2
from scenarios.setup.fleet import Fleet
from scenarios.setup.resolve import RunSpec
from scenarios.setup.solids.placed_solids import Solid, sampled


def build_windows(scenario: RunSpec, sea: Sea) -> dict[str, Window]:
    """Fill the windows of a settled scenario with water; other liquids come later."""
    phases = sorted(scenario.phases.items(), key=lambda item: item[1].is_oil)
    liquids = tuple(
        Phase(name=name, rest_density=phase.rest_density, dynamic_viscosity=phase.viscosity, adhesion=phase.adhesion)
        for name, phase in phases
    )
    windows = {}
    for number, (name, table) in enumerate(scenario.window.items()):
        settings = table.settings(scenario.fluid)
        windows[name] = Window(settings, sea, liquids, scenario.run.threads, number)
    return windows


def couple_windows(
    windows: Mapping[str, Window],
    targets: Mapping[str, Target],
    wetted: Sequence[Solid],
    world: RigidBodyWorld | None,
    followed: Sequence[str],
) -> CoupledBodies:
    """Couple windows with all bodies that may meet them; formulas load the bodies with what the windows leave.

    followed: names of the bodies whose poses the slick asks for. ScenarioError for windows that overlap, and for bodies that cannot be
    sampled.
    """
    met = [] if world is None else wetted
    parts = {name: WindowParticipant(FLUID, one, _surfaces(one, met), targets[name]) for name, one in windows.items()}
    poses = {} if world is None else {solid.name: world.pose(solid.name) for solid in met}
    for name, one in windows.items():
        one.follow(targets[name](poses), 0.0)
    fault = overlap(windows)
    if fault:
        raise ScenarioError([Problem("window", f"cannot be: {fault}")])
    single = len(parts) == 1
    participant = next(iter(parts.values())) if single else WindowsParticipant(FLUID, parts)
    if world is not None and world.environment is not None:
        world.change_environment(SharedEnvironment(world.environment, world.loaded_names, participant.shares))
    requested = None if world is None else Requested(world.body_names, followed)
    fluid = next(iter(windows.values())).fluid
    return couple_participant(participant, fluid, tuple(solid.name for solid in met), world, requested=requested)


def _surfaces(window: Window, met: Sequence[Solid]) -> dict[str, WindowBody]:
    """Return the bodies as a window's particles meet them, by name."""
    samplings = sampled(met, window.settings.spacing)
    return {
        solid.name: WindowBody(
            surface=solid.surface(samplings[id(solid.placed.mesh)]),
            mesh=solid.placed.mesh,
        )
        for solid in met
    }


def exchange_oil(windows: Mapping[str, Window], slick: SlickParticipant, scenario: RunSpec) -> None:
    """Let a slick's oil become particles of the windows and back, and let the windows' water carry what stays parcels."""
    oils = [name for name, phase in scenario.phases.items() if phase.is_oil]
    exchanges = [
        OilExchange(one, _coarse_skirts(one.settings.spacing, slick, scenario.booms), oils) for one in windows.values()
    ]
    flow = slick.flow
    for one in exchanges:
        flow = WindowFlow(flow, one.surface)
    slick.meet(exchanges[0] if len(exchanges) == 1 else JointExchange(exchanges), flow)


def _coarse_skirts(spacing: float, slick: SlickParticipant, booms: Mapping[str, BoomSettings]) -> CoarseSkirts:
    """Return the skirts under which closures decide what particles of a spacing [m] lose: those of booms that have closures."""
    depth = np.zeros(len(slick.slick.barriers))
    for name, boom in booms.items():
        skirt = boom.skirt_depth
        if boom.losses == "closures" and not Resolution(spacing=spacing, skirt_depth=skirt).drainage:
            depth[slick.slick.barriers.rows(name)] = skirt
    return CoarseSkirts(depth, STANDING, PLANING_ANGLE)


def middle_of(segments: Sequence[str]) -> list[str]:
    """Return the middle segment, or the two beside the middle: a window beside it would load one leg of a U more than the other."""
    return list(segments[(len(segments) - 1) // 2 : len(segments) // 2 + 1])


def targets_of(scenario: RunSpec, fleet: Fleet) -> dict[str, Target]:
    """Return the places that the windows of a scenario follow, by the poses of bodies."""
    return {name: target_of(table.target, fleet) for name, table in scenario.window.items()}


def target_of(target: str | Point2, fleet: Fleet) -> Target:
    """Return the place that a window follows, by the poses of bodies: the middle of a boom, a vessel, a body, or a place."""
    if not isinstance(target, str):
        return lambda poses: np.array(target)
    if target in fleet.booms:
        names = middle_of([segment.name for segment in fleet.booms[target].segments])
    else:
        names = [body_of(target) if any(vessel.name == target for vessel in fleet.vessels) else target]
    return lambda poses: np.mean([poses[name][:2] for name in names], axis=0)

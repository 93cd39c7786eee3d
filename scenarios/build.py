"""A scenario becomes a coupled run: fluid, bodies, controllers, FMUs, and the connections between them.

Order within a communication step: FMUs step and give their outputs to the signals they drive, controllers give their orders from
where the bodies are, the fluid answers to the bodies' motion with wrenches, and the bodies move under both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from coupling.bodies import box, mass_properties
from coupling.body_exchange import BodyExchange
from coupling.co_simulation import CoSimulation, FrameSource
from coupling.connection import Connection
from coupling.exchange_ledger import ExchangeLedger
from coupling.observer import Observer
from coupling.participant import Participant
from coupling.participants.fluid import FluidParticipant
from coupling.participants.rigid_bodies import RigidBodyParticipant
from coupling.rigid_body_world import RigidBodyWorld
from coupling.surface_sampling import SurfaceSampling, particles_of, sample_surface
from oilsim.solver import AdvanceReport, Fluid
from recordings.frame import RunDescription
from scenarios.build_fluid import build_fluid, fill_positions, water_level
from scenarios.coupling_figures import CouplingFigures
from scenarios.description import describe_exercise, describe_run
from scenarios.drives import set_wind
from scenarios.exchange import exchange_of
from scenarios.exercise import body_of
from scenarios.fleet import LINE_RELAXATION_TIME, Fleet, place_fleet
from scenarios.fmus import ORDERS, READINGS, connections_of
from scenarios.portrayal import FramePainter, Wrench
from scenarios.probes import BodyProbe
from scenarios.problems import problems_of
from scenarios.scenario import Scenario
from scenarios.scoring import Scoring
from scenarios.signal_board import SignalBoard
from scenarios.signals import RunParts, signals_of
from scenarios.solids import Solid, own_solids, table_entry, vector
from vessels.control import VesselControl
from vessels.manual import ManualControl

FLUID, BODIES = "fluid", "bodies"
TO_FLUID = ("pose", "twist", "free_acceleration")


@dataclass(frozen=True, kw_only=True, eq=False)
class Assembly:
    """A run that is ready to start: its parts, and what observers are shown.

    fluid, world: the simulators themselves, for whoever wants more than the participants' variables; coupled: names of the
    bodies that exchange motion and wrench with the fluid; fleet: vessels and booms; scoring: their accounts; parts: what
    signals reach into; exchange, ledger: how bodies meet the fluid, and the accounts of it; coupling_figures: both on record.
    """

    scenario: Scenario
    fluid: Fluid
    world: RigidBodyWorld | None
    fluid_participant: FluidParticipant
    coupled: tuple[str, ...]
    fleet: Fleet
    scoring: Scoring
    parts: RunParts
    coupling_figures: CouplingFigures
    participants: tuple[Participant, ...]
    connections: tuple[Connection, ...]
    description: RunDescription
    frame_source: FrameSource
    exchange: BodyExchange
    ledger: ExchangeLedger

    @property
    def controls(self) -> tuple[VesselControl, ...]:
        """The helmsmen."""
        return tuple(one for one in self.participants if isinstance(one, VesselControl))

    @property
    def body_names(self) -> tuple[str, ...]:
        """All rigid bodies but the tank's sides."""
        return tuple(self.description.meshes)

    def report(self) -> AdvanceReport | None:
        """The fluid's report on its last step; None before the first."""
        return self.fluid_participant.report

    def particle_counts(self) -> dict[str, int]:
        """Particles now, by phase, and of all boundaries."""
        counts = {name: len(self.fluid.phase_ids(name)) for name in self.scenario.phases}
        return counts | {"boundary": self.fluid.boundary_count}

    def co_simulation(self, observers: Sequence[Observer] = ()) -> CoSimulation:
        """The coupled run, watched by `observers`."""
        simulation = CoSimulation(
            self.participants,
            self.connections,
            self.scenario.run.communication_step,
            observers=observers,
            algorithm=self.exchange,
            ledger=self.ledger,
            frame_source=self.frame_source,
            run_description=self.description,
        )
        self.coupling_figures.follow(lambda: simulation.wall_seconds)
        return simulation


def build(scenario: Scenario, *, text: str = "", overrides: Sequence[str] = ()) -> Assembly:
    """Make everything a run needs; ScenarioError for what cannot be made.

    `text` is the scenario file's, `overrides` the changes made to it; both only go into the recording.
    """
    fmus = _fmus(scenario)
    level = water_level(scenario, fill_positions(scenario))
    fleet = place_fleet(scenario, level)
    solids = (*own_solids(scenario), *fleet.solids)
    positions = fill_positions(scenario, [solid.world_mesh() for solid in solids if solid.wetted])
    with problems_of("fluid", "cannot be made"):
        fluid, tank = build_fluid(scenario, positions)
    coupled = _coupled(scenario, solids)
    handles = _wet(fluid, solids, coupled)
    world = _world(scenario, solids, fleet) if coupled else None
    fluid_participant = FluidParticipant(FLUID, fluid, {name: handles[name] for name in coupled})
    scoring = Scoring(scenario, fluid, world, fleet, level)
    controls = tuple(VesselControl(vessel) if vessel.course else ManualControl(vessel) for vessel in fleet.vessels)
    wind = scenario.forcing.wind
    if wind is not None:
        set_wind(fluid, controls, wind.speed, wind.direction)
    bodies = (RigidBodyParticipant(BODIES, world, coupled),) if world is not None else ()
    exchange, ledger = exchange_of(fluid_participant, BODIES, world, coupled, fluid.config.particle_spacing)
    coupling_figures = CouplingFigures(fluid, fluid_participant, world, coupled, ledger)
    parts = RunParts(
        fluid=fluid,
        world=world,
        controls={control.vessel.name: control for control in controls},
        scoring=scoring,
        tension_joints=fleet.tension_joints,
    )
    orders, readings = _boards(scenario, parts)
    return Assembly(
        scenario=scenario,
        fluid=fluid,
        world=world,
        fluid_participant=fluid_participant,
        coupled=coupled,
        fleet=fleet,
        scoring=scoring,
        parts=parts,
        participants=(*fmus, *orders, *controls, fluid_participant, *bodies, *readings),
        connections=(
            *connections_of(scenario.fmus).values(),
            *_body_connections(coupled),
            *_vessel_connections(controls),
        ),
        description=describe_run(
            scenario,
            fluid,
            tank,
            solids,
            exercise=describe_exercise(scenario, fleet, level),
            text=text,
            overrides=overrides,
        ),
        frame_source=FramePainter(
            scenario,
            fluid,
            world,
            solids,
            fleet,
            _wrench_reading(fluid_participant, coupled),
            scoring,
            coupling_figures,
            lambda: fluid_participant.report,
            fmus,
        ),
        coupling_figures=coupling_figures,
        exchange=exchange,
        ledger=ledger,
    )


def _fmus(scenario: Scenario) -> tuple[Participant, ...]:
    """The FMUs; what runs them is loaded only where there are some."""
    if not scenario.fmus:
        return ()
    from scenarios.fmu_checks import fmu_participants

    return fmu_participants(scenario.fmus)


def _boards(scenario: Scenario, parts: RunParts) -> tuple[tuple[SignalBoard, ...], tuple[SignalBoard, ...]]:
    """What takes the signals that FMUs drive, and what gives those that feed them; none without FMUs."""
    if not scenario.fmus:
        return (), ()
    signals = signals_of(scenario)
    asked = {one.source_variable for one in connections_of(scenario.fmus).values() if one.source == READINGS}
    orders = {name: signal for name, signal in signals.items() if signal.is_input}
    readings = {name: signals[name] for name in sorted(asked)}
    return (SignalBoard(ORDERS, orders, parts),), (SignalBoard(READINGS, readings, parts),)


def _coupled(scenario: Scenario, solids: Sequence[Solid]) -> tuple[str, ...]:
    """Bodies that exchange motion and wrench with the fluid: those that move, and held ones whose force is asked for."""
    probed = {probe.body for probe in scenario.probes.values() if isinstance(probe, BodyProbe)}
    return tuple(solid.name for solid in solids if solid.wetted and (solid.motion != "fixed" or solid.name in probed))


def _wrench_reading(fluid: FluidParticipant, coupled: Sequence[str]) -> Wrench:
    """The fluid's wrench (6,) on a body; 0 on one that is not coupled."""
    return lambda name: fluid.get(f"{name}.wrench") if name in coupled else np.zeros(6)


def _wet(fluid: Fluid, solids: Sequence[Solid], coupled: Sequence[str]) -> dict[str, int]:
    """Give the fluid the surfaces of all wetted solids; returns their handles by name.

    A coupled one is placed about its centre of mass, another where it stands for good. Bodies of one mesh, such as a boom's
    segments, share its sampling.
    """
    samplings: dict[int, SurfaceSampling] = {}
    handles = {}
    for solid in solids:
        if not solid.wetted:
            continue
        mesh = solid.placed.mesh
        if id(mesh) not in samplings:
            with problems_of(table_entry(solid.name), "cannot be sampled with particles"):
                samplings[id(mesh)] = sample_surface(mesh, fluid.config.particle_spacing)
        surface = particles_of(solid.name, samplings[id(mesh)], no_slip=solid.no_slip)
        if solid.name not in coupled:
            rotation = Rotation.from_quat(solid.placed.orientation)
            surface = replace(surface, position=rotation.apply(surface.position) + solid.placed.position)
        handles[solid.name] = fluid.add_boundary(surface)
    return handles


def _world(scenario: Scenario, solids: Sequence[Solid], fleet: Fleet) -> RigidBodyWorld:
    """All solids and joints in one rigid body world; the tank's walls too, if anything could run into them."""
    world = RigidBodyWorld(gravity=scenario.fluid.gravity)
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
        _add_tank_sides(world, scenario)
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
    return world


def _add_tank_sides(world: RigidBodyWorld, scenario: Scenario) -> None:
    """A slab behind each closed side of the tank, a tenth of the tank thick, for bodies to run into."""
    lower, upper = np.array(scenario.tank.lower), np.array(scenario.tank.upper)
    thickness = 0.1 * float((upper - lower).max())
    for side in scenario.tank.closed_sides:
        axis, outward = "xyz".index(side[1]), 1.0 if side[0] == "+" else -1.0
        size = upper - lower + 2.0 * thickness
        size[axis] = thickness
        center = 0.5 * (lower + upper)
        center[axis] = (upper if outward > 0.0 else lower)[axis] + 0.5 * outward * thickness
        slab = box(vector(size))
        world.add_body(f"tank/{side}", slab, mass_properties(slab, mass=1.0), vector(center), motion="fixed")


def _body_connections(coupled: Sequence[str]) -> list[Connection]:
    """Motion to the fluid, wrench to the bodies."""
    motion = [
        Connection(source=BODIES, source_variable=f"{name}.{what}", target=FLUID, target_variable=f"{name}.{what}")
        for name in coupled
        for what in TO_FLUID
    ]
    wrenches = [
        Connection(source=FLUID, source_variable=f"{name}.wrench", target=BODIES, target_variable=f"{name}.wrench")
        for name in coupled
    ]
    together = Connection(source=BODIES, source_variable="inverse_mass", target=FLUID, target_variable="inverse_mass")
    return [*motion, *wrenches, *([together] if coupled else [])]


def _vessel_connections(controls: Sequence[VesselControl | ManualControl]) -> list[Connection]:
    """Each helmsman sees the vessel's motion and pushes it."""
    connections = []
    for control in controls:
        vessel, body = control.vessel.name, body_of(control.vessel.name)
        connections += [
            Connection(
                source=BODIES, source_variable=f"{body}.{what}", target=control.name, target_variable=f"{vessel}.{what}"
            )
            for what in ("pose", "twist")
        ]
        connections.append(
            Connection(
                source=control.name,
                source_variable=f"{vessel}.applied_wrench",
                target=BODIES,
                target_variable=f"{body}.applied_wrench",
            )
        )
    return connections

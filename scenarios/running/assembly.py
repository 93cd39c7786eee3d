"""Assembly: a scenario becomes a coupled run of fluid, bodies, controllers, FMUs, and the connections between them.

Order within a communication step: the FMUs step and set the signals that they drive; the controllers give their orders from the
positions of the bodies; the fluid answers the bodies' motion with wrenches; the bodies move under both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from coupling.assembly import BODIES, CoupledBodies
from coupling.master.body_exchange import BodyExchange
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection
from coupling.master.exchange_ledger import Exchange, ExchangeLedger
from coupling.master.observer_dispatch import FrameSource, Watching
from coupling.observer import Observer
from coupling.participant import Participant
from coupling.participants.fluid import FluidParticipant
from coupling.rigid.rigid_body_world import RigidBodyWorld
from oilsim.advance_report import AdvanceReport
from oilsim.solver import Fluid
from recordings.frame import RunDescription
from scenarios.scenario import Scenario
from scenarios.schema.exercise import body_of
from scenarios.schema.fmu_settings import ORDER_BOARD, READING_BOARD, connections_of
from scenarios.setup.fleet import Fleet
from scenarios.setup.placed_solids import Solid
from scenarios.setup.run_description import describe_run
from scenarios.setup.simulators import Simulators, build_simulators
from scenarios.signals.signal_participant import SignalBoard
from scenarios.signals.signal_table import RunParts, signals_of
from scenarios.signals.weather_inputs import set_wind
from scenarios.watch.boom_scoring import Scoring
from scenarios.watch.coupling_series import CouplingAccount
from scenarios.watch.frame_source import FrameReader
from scenarios.watch.run_accounts import RunAccounts
from scenarios.watch.run_figures import RunFigures
from scenarios.watch.run_totals import RunTotals
from scenarios.watch.run_warnings import Remarks
from vessels.control import VesselControl
from vessels.manual import ManualControl

if TYPE_CHECKING:
    from trimesh import Trimesh

    from coupling.fmu.isolated_fmu import Fmu


@dataclass(frozen=True, kw_only=True, eq=False)
class Assembly:
    """A run that is ready to start: its parts, and what observers are shown.

    fluid, world: the simulators themselves, for whoever wants more than the participants' variables; coupled: names of the
    bodies that exchange motion and wrench with the fluid; fleet: vessels and booms; accounts: scores and sums, advanced by the master;
    remarks: what a run falls short of; parts: what signals reach into; exchange, ledger: how bodies meet the fluid, and the accounts
    of it; fmus: those that take part; solids: all bodies as placed at the start; level: of the still water [m].
    """

    scenario: Scenario
    solids: tuple[Solid, ...]
    level: float
    fluid: Fluid
    world: RigidBodyWorld | None
    fluid_participant: FluidParticipant
    coupled: tuple[str, ...]
    fleet: Fleet
    accounts: RunAccounts
    remarks: Remarks
    parts: RunParts
    participants: tuple[Participant, ...]
    connections: tuple[Connection, ...]
    description: RunDescription
    frame_source: FrameSource
    exchange: BodyExchange
    ledger: ExchangeLedger
    fmus: tuple[Fmu, ...]

    @property
    def scoring(self) -> Scoring:
        """The accounts of the booms."""
        return self.accounts.scoring

    @property
    def controls(self) -> tuple[VesselControl, ...]:
        """The helmsmen of the vessels."""
        return tuple(one for one in self.participants if isinstance(one, VesselControl))

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of all rigid bodies except the tank's sides."""
        return tuple(self.description.meshes)

    @property
    def why_not_kept(self) -> str:
        """Reason why the run's state cannot be saved: FMUs that cannot give theirs as bytes; empty if it can. Valid once initialized."""
        names = [f"{fmu.name} ({fmu.why_not_kept})" for fmu in self.fmus if fmu.why_not_kept]
        return f"the state of {', '.join(names)} cannot be saved as bytes" if names else ""

    def report(self) -> AdvanceReport | None:
        """Return the fluid's report on its last step; None before the first."""
        return self.fluid_participant.report

    def particle_counts(self) -> dict[str, int]:
        """Count the particles now, by phase, and of all boundaries."""
        counts = {name: len(self.fluid.phase_ids(name)) for name in self.scenario.phases}
        return counts | {"boundary": self.fluid.boundary_count}

    def present_meshes(self) -> dict[str, Trimesh]:
        """Return the meshes [m] of all bodies that the liquid meets, by name, where they are now."""
        return {
            solid.name: solid.world_mesh(pose=None if self.world is None else self.world.pose(solid.name))
            for solid in self.solids
            if solid.wetted
        }

    def co_simulation(self, observers: Sequence[Observer] = ()) -> CoSimulation:
        """Create the coupled run with these observers."""
        simulation = CoSimulation(
            self.participants,
            self.connections,
            self.scenario.run.communication_step,
            exchange=Exchange(self.exchange, self.ledger, [self.accounts.advance]),
            watching=Watching(observers, self.frame_source, self.description),
        )
        self.accounts.coupling.follow(lambda: simulation.wall_seconds)
        return simulation


def build(scenario: Scenario, *, text: str = "", overrides: Sequence[str] = ()) -> Assembly:
    """Build everything that a run needs; ScenarioError for what cannot be built.

    `text` is that of the scenario file, `overrides` are the changes made to it; both only go into the recording.
    """
    fmus = _fmus(scenario)
    simulators = build_simulators(scenario)
    scenario = simulators.scenario
    bodies, world, coupled = simulators.bodies, simulators.world, simulators.coupled
    scoring = Scoring(scenario, simulators.fluid, world, simulators.fleet, simulators.level)
    controls = _controls(simulators)
    accounts = RunAccounts(
        scoring=scoring,
        coupling=CouplingAccount(simulators.fluid, bodies.fluid, world, coupled, bodies.ledger),
        totals=RunTotals(),
        figures=RunFigures(simulators.fluid, lambda: bodies.fluid.report),
    )
    parts = _parts(simulators, controls, scoring)
    orders, readings = _boards(scenario, parts)
    return Assembly(
        scenario=scenario,
        solids=simulators.solids,
        level=simulators.level,
        fluid=simulators.fluid,
        world=world,
        fluid_participant=bodies.fluid,
        coupled=coupled,
        fleet=simulators.fleet,
        accounts=accounts,
        remarks=Remarks(scenario, world, simulators.left_out, simulators.thin, simulators.notes),
        parts=parts,
        participants=(*fmus, *orders, *controls, *bodies.participants, *readings),
        connections=_connections(scenario, bodies, controls),
        description=describe_run(simulators, text=text, overrides=overrides),
        frame_source=FrameReader(simulators, accounts, fmus),
        exchange=bodies.exchange,
        ledger=bodies.ledger,
        fmus=fmus,
    )


def _controls(simulators: Simulators) -> tuple[VesselControl | ManualControl, ...]:
    """Create the helmsmen; the wind acts on their vessels as on the water."""
    controls = tuple(
        VesselControl(vessel) if vessel.course else ManualControl(vessel) for vessel in simulators.fleet.vessels
    )
    wind = simulators.scenario.forcing.wind
    if wind is not None:
        set_wind(simulators.fluid, controls, wind.speed, wind.direction)
    return controls


def _parts(simulators: Simulators, controls: Sequence[VesselControl | ManualControl], scoring: Scoring) -> RunParts:
    """Return the parts that signals reach into."""
    return RunParts(
        fluid=simulators.fluid,
        world=simulators.world,
        controls={control.vessel.name: control for control in controls},
        scoring=scoring,
        tension_joints=simulators.fleet.tension_joints,
    )


def _fmus(scenario: Scenario) -> tuple[Fmu, ...]:
    """Create the FMUs; code for FMUs is imported only if there are some."""
    if not scenario.fmus:
        return ()
    from scenarios.signals.fmu_checks import fmu_participants

    return fmu_participants(scenario.fmus)


def _boards(scenario: Scenario, parts: RunParts) -> tuple[tuple[SignalBoard, ...], tuple[SignalBoard, ...]]:
    """Return the board for the signals that FMUs drive, and the one for those that feed them; none without FMUs."""
    if not scenario.fmus:
        return (), ()
    signals = signals_of(scenario)
    asked = {one.source_variable for one in connections_of(scenario.fmus).values() if one.source == READING_BOARD}
    orders = {name: signal for name, signal in signals.items() if signal.is_input}
    readings = {name: signals[name] for name in sorted(asked)}
    return (SignalBoard(ORDER_BOARD, orders, parts),), (SignalBoard(READING_BOARD, readings, parts),)


def _connections(
    scenario: Scenario, bodies: CoupledBodies, controls: Sequence[VesselControl | ManualControl]
) -> tuple[Connection, ...]:
    """List the connections between FMUs and signals, bodies and fluid, helmsmen and vessels."""
    fmus = connections_of(scenario.fmus).values()
    return (*fmus, *bodies.connections, *_vessel_connections(controls))


def _vessel_connections(controls: Sequence[VesselControl | ManualControl]) -> list[Connection]:
    """Connect each helmsman with the motion of its vessel, and the vessel with the helmsman's wrench."""
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

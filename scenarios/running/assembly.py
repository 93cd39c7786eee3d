"""A scenario becomes a coupled run: fluid, bodies, controllers, FMUs, and the connections between them.

Order within a communication step: FMUs step and give their outputs to the signals they drive, controllers give their orders from
where the bodies are, the fluid answers to the bodies' motion with wrenches, and the bodies move under both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from coupling.master.body_exchange import BodyExchange
from coupling.master.co_simulation import CoSimulation, FrameSource
from coupling.master.connection import Connection
from coupling.master.exchange_ledger import ExchangeLedger
from coupling.observer import Observer
from coupling.participant import Participant
from coupling.participants.fluid import FluidParticipant
from coupling.participants.rigid_bodies import RigidBodyParticipant
from coupling.rigid.rigid_body_world import RigidBodyWorld
from oilsim.advance_report import AdvanceReport
from oilsim.solver import Fluid
from recordings.frame import RunDescription
from scenarios.scenario import Scenario
from scenarios.schema.exercise import body_of
from scenarios.schema.fmu_settings import ORDERS, READINGS, connections_of
from scenarios.setup.body_exchange import exchange_of
from scenarios.setup.fleet import Fleet
from scenarios.setup.run_description import describe_run
from scenarios.setup.simulators import FLUID, Scene, build_scene
from scenarios.signals.signal_participant import SignalBoard
from scenarios.signals.signal_table import RunParts, signals_of
from scenarios.signals.weather_inputs import set_wind
from scenarios.watch.boom_scoring import Scoring
from scenarios.watch.coupling_series import CouplingFigures
from scenarios.watch.frame_source import FramePainter
from scenarios.watch.run_warnings import Remarks
from vessels.control import VesselControl
from vessels.manual import ManualControl

if TYPE_CHECKING:
    from coupling.fmu.isolated_fmu import Fmu

BODIES = "bodies"
TO_FLUID = ("pose", "twist", "free_acceleration")


@dataclass(frozen=True, kw_only=True, eq=False)
class Assembly:
    """A run that is ready to start: its parts, and what observers are shown.

    fluid, world: the simulators themselves, for whoever wants more than the participants' variables; coupled: names of the
    bodies that exchange motion and wrench with the fluid; fleet: vessels and booms; scoring: their accounts; remarks: what a
    run falls short of; parts: what signals reach into; exchange, ledger: how bodies meet the fluid, and the accounts of it;
    coupling_figures: both on record; fmus: those that take part.
    """

    scenario: Scenario
    fluid: Fluid
    world: RigidBodyWorld | None
    fluid_participant: FluidParticipant
    coupled: tuple[str, ...]
    fleet: Fleet
    scoring: Scoring
    remarks: Remarks
    parts: RunParts
    coupling_figures: CouplingFigures
    participants: tuple[Participant, ...]
    connections: tuple[Connection, ...]
    description: RunDescription
    frame_source: FrameSource
    exchange: BodyExchange
    ledger: ExchangeLedger
    fmus: tuple[Fmu, ...]

    @property
    def controls(self) -> tuple[VesselControl, ...]:
        """The helmsmen."""
        return tuple(one for one in self.participants if isinstance(one, VesselControl))

    @property
    def body_names(self) -> tuple[str, ...]:
        """All rigid bodies but the tank's sides."""
        return tuple(self.description.meshes)

    @property
    def why_not_kept(self) -> str:
        """Why the run's state cannot be kept: FMUs that cannot give theirs as bytes; empty if it can. Sure once it is initialized."""
        names = [f"{fmu.name} ({fmu.why_not_kept})" for fmu in self.fmus if fmu.why_not_kept]
        return f"state of {', '.join(names)} cannot be saved as bytes" if names else ""

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
    scene = build_scene(scenario)
    fluid, world, coupled = scene.fluid_participant, scene.world, scene.coupled
    scoring = Scoring(scenario, scene.fluid, world, scene.fleet, scene.level)
    controls = _controls(scene)
    bodies = (RigidBodyParticipant(BODIES, world, coupled),) if world is not None else ()
    exchange, ledger = exchange_of(fluid, BODIES, world, coupled, scene.fluid.config)
    figures = CouplingFigures(scene.fluid, fluid, world, coupled, ledger)
    parts = _parts(scene, controls, scoring)
    orders, readings = _boards(scenario, parts)
    return Assembly(
        scenario=scenario,
        fluid=scene.fluid,
        world=world,
        fluid_participant=fluid,
        coupled=coupled,
        fleet=scene.fleet,
        scoring=scoring,
        remarks=Remarks(scenario, world, scene.left_out, scene.swelling),
        parts=parts,
        participants=(*fmus, *orders, *controls, fluid, *bodies, *readings),
        connections=_connections(scenario, coupled, controls),
        description=describe_run(scene, text=text, overrides=overrides),
        frame_source=FramePainter(scene, scoring, figures, fmus),
        coupling_figures=figures,
        exchange=exchange,
        ledger=ledger,
        fmus=fmus,
    )


def _controls(scene: Scene) -> tuple[VesselControl | ManualControl, ...]:
    """The helmsmen; the wind blows on them as on the water."""
    controls = tuple(
        VesselControl(vessel) if vessel.course else ManualControl(vessel) for vessel in scene.fleet.vessels
    )
    wind = scene.scenario.forcing.wind
    if wind is not None:
        set_wind(scene.fluid, controls, wind.speed, wind.direction)
    return controls


def _parts(scene: Scene, controls: Sequence[VesselControl | ManualControl], scoring: Scoring) -> RunParts:
    """What signals reach into."""
    return RunParts(
        fluid=scene.fluid,
        world=scene.world,
        controls={control.vessel.name: control for control in controls},
        scoring=scoring,
        tension_joints=scene.fleet.tension_joints,
    )


def _fmus(scenario: Scenario) -> tuple[Fmu, ...]:
    """The FMUs; what runs them is loaded only where there are some."""
    if not scenario.fmus:
        return ()
    from scenarios.signals.fmu_checks import fmu_participants

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


def _connections(
    scenario: Scenario, coupled: Sequence[str], controls: Sequence[VesselControl | ManualControl]
) -> tuple[Connection, ...]:
    """Between FMUs and signals, between bodies and fluid, between helmsmen and vessels."""
    fmus = connections_of(scenario.fmus).values()
    return (*fmus, *_body_connections(coupled), *_vessel_connections(controls))


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

"""Assembly: a scenario becomes a coupled run of fluid, bodies, controllers, FMUs, and the connections between them.

Order within a communication step: the FMUs step and set the signals that they drive; the controllers give their orders from the
positions of the bodies; the fluid answers the bodies' motion with wrenches; the bodies move under both.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from coupling.bullet.assembly import BODIES, CoupledBodies
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.body_exchange import BodyExchange
from coupling.master.co_simulation import CoSimulation
from coupling.master.connection import Connection
from coupling.master.exchange_ledger import Exchange, ExchangeLedger
from coupling.master.observer_dispatch import CommunicationPoint, FrameSource, Observer, Watching
from coupling.master.participant import Participant
from coupling.participants.fluid import FluidParticipant
from oilsim import AdvanceReport
from recordings.model.frame import RunDescription
from scenarios.controls.signals import RunParts, SignalBoard, signals_of
from scenarios.running.run_controls import RunControls
from scenarios.schema.exercise import body_of
from scenarios.schema.fmu_settings import ORDER_BOARD, READING_BOARD, FmuSettings, connections_of
from scenarios.setup.run_description import describe_run
from scenarios.setup.simulators import Simulators, build_simulators
from scenarios.spec.resolve import resolve
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import problems_of
from scenarios.watch.boom_scoring import BoomStrength, Scoring
from scenarios.watch.coupling_series import CouplingAccount
from scenarios.watch.frame_source import FrameReader
from scenarios.watch.run_accounts import RunAccounts, RunFigures
from scenarios.watch.run_warnings import Remarks
from vessels.control import ManualControl, VesselControl
from vessels.vessel import Vessel
from vessels.windage import Windage, WindOnBodies

if TYPE_CHECKING:
    from coupling.fmu.isolated_fmu import Fmu
    from coupling.testkit.faults import FaultPlan


@dataclass(frozen=True, kw_only=True, eq=False)
class Assembly(Simulators):
    """A run that is ready to start: its simulators, what works and watches them, and what observers are shown.

    fluid_participant: the fluid, as the master steps it; exchange, ledger: how bodies meet it, and the accounts of that; strength: lets
    overloaded booms part; controls: bring parts to what orders and signals ask for; accounts: scores and sums, advanced by the master;
    remarks: what a run falls short of; parts: what signals read and drive; fmus: those that take part; faults: what fails on purpose.
    """

    fluid_participant: FluidParticipant
    strength: BoomStrength
    controls: RunControls
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
    faults: FaultPlan | None

    @property
    def scoring(self) -> Scoring:
        """The accounts of the booms."""
        return self.accounts.scoring

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of all rigid bodies except the tank's sides."""
        return tuple(self.description.meshes)

    @property
    def why_not_kept(self) -> str:
        """Reason why the run's state cannot be saved, empty if it can: FMUs, or a line that parts on purpose. Valid once initialized."""
        if self.faults is not None and self.faults.why_not_kept:
            return self.faults.why_not_kept
        names = [f"{fmu.name} ({fmu.why_not_kept})" for fmu in self.fmus if fmu.why_not_kept]
        return f"the state of {', '.join(names)} cannot be saved as bytes" if names else ""

    def report(self) -> AdvanceReport | None:
        """Return the fluid's report on its last step; None before the first."""
        return self.fluid_participant.report

    def particle_counts(self) -> dict[str, int]:
        """Count the particles now, by phase, and of all boundaries."""
        counts = {name: len(self.fluid.phase_ids(name)) for name in self.scenario.phases}
        return counts | {"boundary": self.fluid.boundary_count}

    def account_states(self) -> dict[str, Any]:
        """Return the accounts that are kept, as plain data; of strengths only those of booms that may part."""
        strength = self.strength.save_state()
        strengths = {"strength": strength} if strength["parted"] else {}
        return {"remarks": self.remarks.save_state(), **strengths, **self.accounts.save_state()}

    def save_state(self) -> dict[str, Any]:
        """Return all that influences the next step besides the simulation's own state, and the accounts."""
        return self.account_states() | self.controls.save_state() | self.sea.save_state()

    def restore_state(self, state: Mapping[str, Any]) -> None:
        """Go back to a state that `save_state` returned."""
        if "strength" in state:
            self.strength.restore_state(state["strength"])
        self.controls.restore_state(state)
        self.sea.restore_state(state)
        self.accounts.restore_state(state)
        self.remarks.restore_state(state["remarks"])

    def _tend_lines(self, point: CommunicationPoint) -> None:
        """Let overloaded booms part, and winches work."""
        self.strength.advance()
        self.controls.advance()

    def co_simulation(self, observers: Sequence[Observer] = ()) -> CoSimulation:
        """Create the coupled run with these observers."""
        simulation = CoSimulation(
            self.participants,
            self.connections,
            self.scenario.run.communication_step,
            exchange=Exchange(self.exchange, self.ledger, [self._tend_lines, self.accounts.advance]),
            watching=Watching(
                observers if self.faults is None else self.faults.observers(observers),
                self.frame_source,
                self.description,
            ),
        )
        self.accounts.coupling.follow(lambda: simulation.wall_seconds)
        return simulation


def build(
    scenario: Scenario, *, text: str = "", overrides: Sequence[str] = (), faults: FaultPlan | None = None
) -> Assembly:
    """Build everything that a run needs; ScenarioError for what cannot be built.

    `text` is that of the scenario file, `overrides` are the changes made to it; both only go into the recording. `faults`: what is to
    fail on purpose, beside what the scenario says.
    """
    spec = resolve(scenario)
    fmus = _fmus(spec.fmus)
    simulators = build_simulators(spec)
    bodies, world = simulators.bodies, simulators.world
    scoring = Scoring(spec, simulators)
    helms = _helms(simulators)
    strength = BoomStrength(spec.booms, world, simulators.fleet, scoring, simulators.slicks)
    controls = RunControls(spec, simulators, helms, strength, scoring)
    blown = _wind_on_bodies(simulators)
    accounts = _accounts(simulators, scoring)
    parts = _parts(simulators, controls, helms, scoring)
    orders, readings = _boards(scenario, parts)
    blowing = [blown] if blown else []
    participants = (
        *fmus, *orders, *helms.values(), *blowing, *bodies.participants, *simulators.slicks, *simulators.skimmers, *readings,
    )  # fmt: skip
    return Assembly(
        **vars(simulators),
        fluid_participant=bodies.fluid,
        strength=strength,
        controls=controls,
        accounts=accounts,
        remarks=Remarks(spec, world, simulators.left_out, simulators.thin, simulators.notes, simulators.facts),
        parts=parts,
        participants=_failing(participants, faults, world) if faults else participants,
        connections=(*_connections(spec.fmus, bodies, helms.values(), blown), *_slick_connections(simulators)),
        description=describe_run(simulators, text=text, overrides=overrides),
        frame_source=FrameReader(simulators, accounts, fmus),
        exchange=bodies.exchange,
        ledger=bodies.ledger,
        fmus=fmus,
        faults=faults,
    )


def _failing(
    participants: Sequence[Participant], faults: FaultPlan, world: RigidBodyWorld | None
) -> tuple[Participant, ...]:
    """Return the participants with their faults, and first the one that tells of these; ScenarioError for faults that cannot come."""
    with problems_of("faults", "cannot be arranged"):
        faults.require_met([one.name for one in participants])
        return (*faults.clock(world), *map(faults.applied, participants))


def _accounts(simulators: Simulators, scoring: Scoring) -> RunAccounts:
    """Create the accounts of a run, which advance at every communication point."""
    fluid, bodies = simulators.fluid, simulators.bodies
    return RunAccounts(
        scoring=scoring,
        coupling=CouplingAccount(fluid, bodies.fluid, simulators.world, simulators.coupled, bodies.ledger),
        figures=RunFigures(fluid, lambda: bodies.fluid.report),
    )


def _helms(simulators: Simulators) -> dict[str, VesselControl | ManualControl]:
    """Create the helmsmen, who meet the current of the sea at half the draft, and in a tank its wind: at sea, loads hold that."""
    helms: dict[str, VesselControl | ManualControl] = {
        vessel.name: VesselControl(vessel) if vessel.course else ManualControl(vessel)
        for vessel in simulators.fleet.vessels
    }
    for helm in helms.values():
        helm.current = partial(_current, simulators, helm.vessel)
        if simulators.scenario.tanks:
            helm.wind = partial(_wind, simulators)
    return helms


def _current(simulators: Simulators, vessel: Vessel, place: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """Return the current (2,) [m/s] that a vessel meets at a place (2,) [m] and a time [s]."""
    middle = np.array([simulators.level - 0.5 * vessel.hull.draft])
    return np.array(simulators.sea.now.current(middle, time, place)[0])


def _wind(simulators: Simulators, place: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """Return the wind (3,) [m/s] at a place (2,) [m] and a time [s], gusts included."""
    return np.append(simulators.sea.now.wind(place, time), 0.0)


def _wind_on_bodies(simulators: Simulators) -> WindOnBodies | None:
    """Create the wind on free bodies and booms of a tank; None without wind, or without such bodies. Vessels have theirs from helmsmen."""
    if simulators.scenario.sea.wind is None or not simulators.scenario.tanks:
        return None
    steered = {body_of(vessel.name) for vessel in simulators.fleet.vessels}
    free = [
        solid for solid in simulators.solids if solid.wetted and solid.motion == "free" and solid.name not in steered
    ]
    meshes = {id(solid.placed.mesh): solid.placed.mesh for solid in free}  # a boom's segments share one
    surfaces = {key: Windage(mesh, simulators.level) for key, mesh in meshes.items()}
    blown = {solid.name: surfaces[id(solid.placed.mesh)] for solid in free}
    return WindOnBodies(blown, partial(_wind, simulators)) if free else None


def _parts(
    simulators: Simulators,
    controls: RunControls,
    helms: Mapping[str, VesselControl | ManualControl],
    scoring: Scoring,
) -> RunParts:
    """Return the parts that signals read and drive."""
    return RunParts(
        world=simulators.world,
        helms=helms,
        drive=controls.drive,
        scoring=scoring,
        tension_joints=simulators.fleet.tension_joints,
        skimmers={one.short_name: one for one in simulators.skimmers},
    )


def _fmus(fmus: Mapping[str, FmuSettings]) -> tuple[Fmu, ...]:
    """Create the FMUs; code for FMUs is imported only if there are some."""
    if not fmus:
        return ()
    from scenarios.controls.fmu_checks import fmu_participants

    return fmu_participants(fmus)


def _boards(scenario: Scenario, parts: RunParts) -> tuple[tuple[SignalBoard, ...], tuple[SignalBoard, ...]]:
    """Return the board for the signals that FMUs drive, and the one for those that feed them; none without FMUs."""
    if not scenario.fmus:
        return (), ()
    signals = signals_of(scenario.parts)
    asked = {one.source_variable for one in connections_of(scenario.fmus).values() if one.source == READING_BOARD}
    orders = {name: signal for name, signal in signals.items() if signal.is_input}
    readings = {name: signals[name] for name in sorted(asked)}
    return (SignalBoard(ORDER_BOARD, orders, parts),), (SignalBoard(READING_BOARD, readings, parts),)


def _connections(
    fmus: Mapping[str, FmuSettings],
    bodies: CoupledBodies,
    helms: Iterable[VesselControl | ManualControl],
    blown: WindOnBodies | None,
) -> tuple[Connection, ...]:
    """List the connections between FMUs and signals, bodies and fluid, helmsmen and vessels, wind and other bodies."""
    links = connections_of(fmus).values()
    moved = [(one.name, one.vessel.name, body_of(one.vessel.name)) for one in helms]
    moved += [(blown.name, body, body) for body in blown.body_names] if blown else []
    return (*links, *bodies.connections, *(link for one in moved for link in _links(*one)))


def _slick_connections(simulators: Simulators) -> tuple[Connection, ...]:
    """Connect slick and skimmers with the motion of their bodies; none without a slick, whose code is imported only if there is one."""
    if not simulators.slicks:
        return ()
    from scenarios.setup.at_sea.parcels import skimmer_connections, slick_connections

    return (
        *(link for slick in simulators.slicks for link in slick_connections(slick)),
        *skimmer_connections(simulators.skimmers),
    )


def _links(participant: str, own: str, body: str) -> list[Connection]:
    """Connect a participant with a body's motion, and the body with its wrench; `own` is what the participant calls the body."""
    read = [
        Connection(source=BODIES, source_variable=f"{body}.{what}", target=participant, target_variable=f"{own}.{what}")
        for what in ("pose", "twist")
    ]
    wrench = "applied_wrench"
    given = Connection(
        source=participant, source_variable=f"{own}.{wrench}", target=BODIES, target_variable=f"{body}.{wrench}"
    )
    return [*read, given]

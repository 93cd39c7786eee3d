"""A scenario under test: it is run step by step, with faults if wanted, and checks read it like any other run."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from coupling.master.co_simulation import CoSimulation
from coupling.master.observer_dispatch import Observer
from coupling.testkit.fault_plan import FaultPlan
from coupling.testkit.frames import turnover, with_particles
from coupling.testkit.history import History
from coupling.testkit.readings import Basin, Live, Readings, history_readings
from coupling.testkit.sources import basin_of
from recordings.model.frame import Frame
from scenarios.load import load_scenario
from scenarios.running.assembly import Assembly, build
from scenarios.running.checkpoints import Restart, run_state
from scenarios.running.plan import Plan
from scenarios.running.run_loop import RunLoop
from scenarios.running.run_requests import RunRequests
from scenarios.scenario import Scenario


class ScenarioRun:
    """A run of a shipped scenario, a scenario file or a `Scenario`, on one thread unless `threads` says otherwise.

        with ScenarioRun("floating-box", "fluid.particle_spacing=0.1") as run:
            run.run(1.0)
            assert_draft(run, "box", 0.1, within=0.05)

    Settings are those of `oilsim run --set`. faults: what is to fail, beside what the scenario says; state it before the first step.
    Orders and warnings work as in `oilsim run`. Raises ScenarioError for a scenario that cannot be built, and ValueError for settings of
    a `Scenario`.
    """

    def __init__(self, scenario: str | Path | Scenario, *settings: str, demo: bool = False, threads: int = 1) -> None:
        loaded = (
            scenario
            if isinstance(scenario, Scenario)
            else load_scenario(scenario, overrides=settings, demo=demo).scenario
        )
        if isinstance(scenario, Scenario) and (settings or demo):
            raise ValueError(f"scenario run: settings {settings} change a Scenario, allowed: a name or a file")
        self.scenario = replace(loaded, run=replace(loaded.run, threads=threads))
        self.history, self.faults = History(), FaultPlan()
        self._plan = Plan(scenario=self.scenario)
        self._observers: list[Observer] = []
        self._loop: RunLoop | None = None
        self._assembly: Assembly | None = None

    def __enter__(self) -> ScenarioRun:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def assembly(self) -> Assembly:
        """The parts of the run: fluid, world, fleet, accounts; built at the first access."""
        if self._assembly is None:
            self._assembly = build(self.scenario, faults=self.faults)
        return self._assembly

    @property
    def simulation(self) -> CoSimulation:
        """The coupled run, begun at the first access."""
        return self._begun().simulation

    def watch(self, observer: Observer) -> None:
        """Show the run to an observer; ValueError once it has begun."""
        if self._loop is not None:
            raise ValueError(f"observer {type(observer).__name__} is added after the run has begun, allowed: before")
        self._observers.append(observer)

    def step(self) -> None:
        """Make one communication step, with the orders that are due."""
        self._begun().step()

    def run(self, duration: float | None = None) -> None:
        """Run for `duration` [s], in whole communication steps, or to the scenario's end; ValueError for a duration not above 0."""
        simulation = self.simulation
        now = simulation.communication_point
        left = self.scenario.run.duration - now.time if duration is None else duration
        if not left > 0.0:
            raise ValueError(f"scenario run: duration is {left} s, allowed: above 0")
        for _ in range(max(1, round(left / now.step_size))):
            if simulation.is_running:
                self.step()

    def save_state(self) -> dict[str, Any]:
        """Return all that the next step depends on, and the run's accounts, as plain data; the run begins if it has not."""
        return copy.deepcopy(run_state(self.simulation, self.assembly))

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Begin at a state that `save_state` of a run of the same scenario returned.

        Raises ValueError once the run has begun, and for scenarios with injects, which `oilsim run --resume` continues, and
        CheckpointError for a state that does not fit.
        """
        if self._loop is not None or self.scenario.injects:
            raise ValueError(
                "scenario run: a state is restored after the run has begun, or with injects, allowed: before, without"
            )
        self._begun(Restart(plan=self._plan, index=0, state=saved, source=Path("saved state")))

    def readings(self) -> Readings:
        """Return the readings of the run up to now; the run begins if it has not."""
        _ = self.simulation
        assembly, fluid = self.assembly, self.assembly.fluid
        meshes = {solid.name: solid.placed.mesh for solid in assembly.solids}
        world = assembly.world
        return history_readings(
            self.history,
            particles=lambda phase: fluid.phase_positions(phase).astype(np.float64),
            gravity=abs(fluid.config.gravity[2]),
            basin=self._basin(),
            live=Live(
                fluid=fluid,
                step=self.step,
                momentum=(lambda: np.zeros(6)) if world is None else world.momentum,
                energy=(lambda: 0.0) if world is None else world.energy,
                turnover=lambda: (0.0, 0.0, 0.0) if world is None else turnover(world, meshes),
            ),
            source=f"the scenario {self.scenario.name}",
        )

    def last_frame(self) -> Frame:
        """Return the frame of the present moment, with its particles."""
        return with_particles(self.assembly.frame_source(self.simulation.communication_point))

    def close(self) -> None:
        """End the run."""
        if self._loop is not None:
            self._loop.simulation.terminate()
        elif self._assembly is not None:
            for participant in self._assembly.participants:
                participant.terminate()
            self._assembly.fluid.close()

    def _begun(self, restart: Restart | None = None) -> RunLoop:
        if self._loop is None:
            simulation = self.assembly.co_simulation([self.history, *self._observers])
            self._loop = RunLoop(
                self._plan, self.assembly, simulation, requests=RunRequests(), keepers={}, checkpoints=None
            )
            self._loop.begin(restart)
        return self._loop

    def _basin(self) -> Basin | None:
        return basin_of(self.assembly.description)

"""A scenario under test: it is run step by step, with faults if wanted, and checks read it like any other run."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from coupling.master.co_simulation import CoSimulation
from coupling.testkit.faults import FaultPlan
from coupling.testkit.readings import basin_of
from coupling.testkit.run import TestRun, turnover
from recordings.model.frame import Frame
from scenarios.running.assembly import Assembly, build
from scenarios.running.checkpoints import Restart, run_state
from scenarios.running.plan import Plan
from scenarios.running.run_loop import RunLoop
from scenarios.running.run_requests import RunRequests
from scenarios.spec.load import load_scenario
from scenarios.spec.scenario import Scenario


class ScenarioRun(TestRun):
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
        super().__init__(f"scenario {self.scenario.name}")
        self.faults = FaultPlan()
        self._plan = Plan(scenario=self.scenario)
        self._loop: RunLoop | None = None
        self._assembly: Assembly | None = None

    @property
    def assembly(self) -> Assembly:
        """The parts of the run: fluid, world, fleet, accounts; built at the first access."""
        if self._assembly is None:
            self._assembly = build(self.scenario, faults=self.faults)
        return self._assembly

    def step(self) -> None:
        """Make one communication step, with the orders that are due."""
        self._begin()
        assert self._loop is not None  # begun
        self._loop.step()

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
        self._simulation = self._begun_simulation(
            Restart(plan=self._plan, index=0, state=saved, source=Path("saved state"))
        )

    def _terms(self) -> dict[str, Any]:
        world, fluid = self.assembly.world, self.assembly.fluid
        basin = basin_of(self.assembly.description)
        if world is None:
            none = {"momentum": lambda: np.zeros(6), "energy": lambda: 0.0, "turnover": lambda: (0.0, 0.0, 0.0)}
            return self._fluid_terms(fluid, basin, **none)
        turned = partial(turnover, world, {solid.name: solid.placed.mesh for solid in self.assembly.solids})
        return self._fluid_terms(fluid, basin, momentum=world.momentum, energy=world.energy, turnover=turned)

    def _last_frame(self) -> Frame:
        return self.assembly.frame_source(self.simulation.communication_point)

    def _release(self) -> None:
        if self._loop is None and self._assembly is not None:
            for participant in self._assembly.participants:
                participant.terminate()
            self._assembly.fluid.close()

    def _begun_simulation(self, restart: Restart | None = None) -> CoSimulation:
        simulation = self.assembly.co_simulation([self.history, *self._observers])
        self._loop = RunLoop(
            self._plan, self.assembly, simulation, requests=RunRequests(), keepers={}, checkpoints=None
        )
        self._loop.begin(restart)
        return simulation

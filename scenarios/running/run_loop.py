"""The loop of a run, step by step: orders given when they are due, checkpoints written, and an orderly end whatever happens."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from coupling.errors import CoSimulationError
from coupling.master.co_simulation import CoSimulation
from recordings.errors import RecordingError
from scenarios.running.apply_orders import give_orders
from scenarios.running.assembly import Assembly
from scenarios.running.checkpoints import CheckpointWriter, Restart, begin_from, run_state, run_state_hash
from scenarios.running.plan import Plan
from scenarios.running.run_requests import RunRequests


class Keeper(Protocol):
    """Keeps an account of the run that goes on after a restart; it is saved in checkpoints beside the run's state."""

    def save_state(self) -> dict[str, Any]:
        """Return the account so far, as plain data."""

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go on with what `save_state` returned."""


class RunLoop:
    """Steps a run of a plan, from its beginning or from a checkpoint."""

    def __init__(
        self,
        plan: Plan,
        assembly: Assembly,
        simulation: CoSimulation,
        *,
        requests: RunRequests,
        keepers: Mapping[str, Keeper],
        checkpoints: CheckpointWriter | None,
    ) -> None:
        """`keepers` are the observers, by name, whose accounts belong into checkpoints; `checkpoints` None: none are written.

        Nor are they with an FMU whose state cannot be kept; `state_hash` stays None then.
        """
        self.simulation = simulation
        self.state_hash: str | None = None
        self._plan, self._assembly = plan, assembly
        self._requests, self._keepers = requests, {"totals": assembly.accounts.totals, **keepers}
        self._checkpoints = checkpoints

    def run(self, restart: Restart | None = None) -> Exception | None:
        """Step until the end, a stop or a failure; the simulation is terminated in each case. Returns what failed."""
        simulation, requests = self.simulation, self._requests
        try:
            self.begin(restart)
            while requests.stop is None and not self._is_done():
                self.step()
                if not simulation.is_running:
                    return None  # a participant has ended it
                self._save_if_due()
            if requests.stop is not None:
                self._save_and_say()
            elif self._checkpoints is not None:
                self._save(self._checkpoints, asked=True)  # so that a run can be made longer
            if not self._assembly.why_not_kept:
                self.state_hash = run_state_hash(simulation, self._assembly)
            simulation.terminate("completed" if requests.stop is None else f"stopped by signal {requests.stop}")
        except (CoSimulationError, RecordingError) as error:
            with suppress(CoSimulationError, RecordingError):  # whoever cannot write any more cannot write why
                simulation.terminate(f"failed: {error}")
            return error
        return None

    def step(self) -> None:
        """Give the orders that are due, make one communication step, and tell what happened in it."""
        self._give_orders()
        self.simulation.step()
        if self.simulation.is_running:
            self._tell()

    def begin(self, restart: Restart | None = None) -> None:
        """Begin at the start, or at the state of a checkpoint, which is the first checkpoint of this run too."""
        if restart is None:
            self.simulation.initialize()
            self._tell()
        else:
            give_orders(self._assembly, self._plan.scenario_at(restart.index - 1))
            begin_from(restart.state, self.simulation, self._assembly)
            for name, keeper in self._keepers.items():
                if name in restart.state:
                    keeper.restore_state(restart.state[name])
            self.simulation.emit(f"goes on from {restart.source.name}", source="oilsim")
        if self._assembly.why_not_kept:
            self._checkpoints = None
            self.simulation.emit(f"no checkpoints: {self._assembly.why_not_kept}", level="warning", source="oilsim")
        if self._checkpoints is not None and self._checkpoints.is_due(0):
            self._save(self._checkpoints, asked=False)

    def _tell(self) -> None:
        """Tell observers what the accounts and warnings of the last step found."""
        remarks = self._assembly.remarks.look(self._assembly.report())
        for notice in [*self._assembly.scoring.take_notices(), *remarks]:
            self.simulation.emit(notice.text, level=notice.level, source=notice.source)

    def _is_done(self) -> bool:
        run = self._plan.scenario.run
        return self.simulation.communication_point.time >= run.duration - 1e-6 * run.communication_step

    def _give_orders(self) -> None:
        """Give the orders of the plan at this communication point."""
        index = self.simulation.communication_point.index
        settings = self._plan.settings_due(index)
        if settings:
            give_orders(self._assembly, self._plan.scenario_at(index))
            self.simulation.emit(f"ordered: {' '.join(settings)}", source="instructor")

    def _save_if_due(self) -> None:
        """Write a checkpoint at its time or when asked for."""
        index = self.simulation.communication_point.index
        if self._requests.take_checkpoint():
            self._save_and_say()
        elif self._checkpoints is not None and self._checkpoints.is_due(index):
            self._save(self._checkpoints, asked=False)
            thinned = self._checkpoints.thin_out()
            if thinned:
                self.simulation.emit(thinned, source="oilsim")

    def _save_and_say(self) -> None:
        """Write a checkpoint that somebody waits for, and say so."""
        if self._checkpoints is None:
            why = self._assembly.why_not_kept or "--checkpoints names no folder"
            self.simulation.emit(f"no checkpoint is kept: {why}", source="oilsim")
        else:
            path = self._save(self._checkpoints, asked=True)
            self.simulation.emit(f"checkpoint {path}", source="oilsim")

    def _save(self, checkpoints: CheckpointWriter, *, asked: bool) -> Path:
        state = run_state(self.simulation, self._assembly)
        state |= {name: keeper.save_state() for name, keeper in self._keepers.items()}
        return checkpoints.write(self.simulation.communication_point.index, state, asked=asked)

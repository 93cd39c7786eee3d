"""The loop of a run, step by step: orders given when they are due or when they come, checkpoints written, and an orderly end.

An order acts at a communication point. Orders are given one by one, also where several belong to one point, so that a run that is
made again gets them exactly as the first one did.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError
from coupling.master.saved_fields import require_alike
from recordings.files.writing import RecordingError
from recordings.model.frame import INJECTS, INSTRUCTOR, VHF
from scenarios.controls.order_checks import condition_signals, inject_problems
from scenarios.controls.signals import RunParts
from scenarios.running.assembly import Assembly
from scenarios.running.checkpoints import CheckpointWriter, Restart, begin_from, fitting, run_state, run_state_hash
from scenarios.running.instructor import Instructor
from scenarios.running.plan import Plan
from scenarios.running.run_requests import RunRequests
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import Problem, ScenarioError

MARKS = "marks "  # how the text of a mark's event begins
WHOLE = 1e-6  # of a communication step that a time may lie before a communication point; numerical


class Keeper(Protocol):
    """Keeps an account of the run that goes on after a restart; it is saved in checkpoints beside the run's state."""

    def save_state(self) -> dict[str, Any]:
        """Return the account so far, as plain data."""

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Continue the account that `save_state` returned."""


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
        instructor: Instructor | None = None,
    ) -> None:
        """`keepers` are the observers, by name, whose accounts belong into checkpoints; `checkpoints` None: none are written.

        Nor are they with an FMU whose state cannot be kept; `state_hash` stays None then. `instructor`: gives orders while it runs.
        """
        self.simulation, self.plan = simulation, plan
        self.state_hash: str | None = None
        self._assembly = assembly
        self._given = 0  # actions of the plan
        self._is_ended = False  # by an instructor
        self._instructor = instructor
        self._injects = Injects(plan.scenario, assembly.parts) if plan.scenario.injects else None
        own: dict[str, Keeper] = {} if self._injects is None else {"injects": self._injects}
        self._requests, self._keepers = requests, {"figures": assembly.accounts.figures, **own, **keepers}
        self._checkpoints = checkpoints

    def run(self, restart: Restart | None = None) -> Exception | None:
        """Step until the end, a stop or a failure; the simulation is terminated in each case. Returns what failed."""
        simulation, requests = self.simulation, self._requests
        try:
            self.begin(restart)
            while self._goes_on():
                self.step()
                if not simulation.is_running:
                    return None  # a participant has ended it
                self._save_if_due()
                if self._instructor is not None:
                    self._instructor.keep_time(self, hears=not self._is_done())
            if requests.stop is not None:
                self._save_and_say()
            elif self._checkpoints is not None:
                self._save(self._checkpoints, asked=True)  # so that a run can be made longer
            if not self._assembly.why_not_kept:
                self.state_hash = run_state_hash(simulation, self._assembly)
            simulation.terminate(self._why_it_ends())
        except (CoSimulationError, RecordingError) as error:
            with suppress(CoSimulationError, RecordingError):  # whoever cannot write any more cannot write why
                simulation.terminate(f"failed: {error}")
            return error
        return None

    def step(self) -> None:
        """Give the orders that are due, make one communication step, and tell what happened in it."""
        self._give_planned()
        self._give_injects()
        self.simulation.step()
        if self.simulation.is_running:
            self._tell()

    def order(self, settings: Sequence[str], by: str = INSTRUCTOR) -> None:
        """Give orders that are not in the plan, here and now, and take them into it; `by` is the source of their event.

        Raises ScenarioError, and gives none of them, if they are not allowed.
        """
        self._give_planned()
        self._give(settings, by)

    def _give(self, settings: Sequence[str], source: str) -> None:
        """Give orders of a source here and now; ScenarioError, and none given, if they are not allowed."""
        index = self.simulation.communication_point.index
        plan = self.plan.ordered(settings, index, by=source)
        self._obey(plan)
        self.plan = plan
        if self._checkpoints is not None:
            self._checkpoints.follow(plan)
        self._count_given()

    def _give_injects(self) -> None:
        """Give the injects that are due, in the order of the file; one that cannot be obeyed any more is told and passed over."""
        if self._injects is None:
            return
        scenario, index = self.plan.scenario_after(self._given), self.simulation.communication_point.index
        for name in self._injects.due(scenario, index):
            try:
                self._give([f"injects.{name}.given=true"], INJECTS)
            except ScenarioError as error:
                reasons = "; ".join(map(str, error.problems))
                self._injects.skip(name)
                told = f"{scenario.injects[name].text or name}: cannot be given any more: {reasons}"
                self.simulation.emit(told, source=f"inject {name}")

    def take_requests(self) -> bool:
        """Write a checkpoint if one is asked for; return whether a stop is."""
        if self._requests.take_checkpoint():
            self._save_and_say()
        return self._requests.stop is not None or self._is_ended

    def mark(self, words: str) -> None:
        """Write a checkpoint of this moment, under a name in the log; ScenarioError if the run writes none."""
        if self._checkpoints is None:
            raise ScenarioError([Problem("mark", f"cannot be set: {self._why_unsaved()}")], "oilsim")
        self._save(self._checkpoints, asked=True)
        self.simulation.emit(f"{MARKS}{words}", source=INSTRUCTOR)

    def say(self, text: str) -> None:
        """Put a message between stations into the log of the radio."""
        self.simulation.emit(text, source=VHF)

    def end(self) -> None:
        """Make no more steps."""
        self._is_ended = True

    def _why_it_ends(self) -> str:
        if self._requests.stop is not None:
            return f"stopped by signal {self._requests.stop}"
        return "ended by the instructor" if self._is_ended else "completed"

    def begin(self, restart: Restart | None = None) -> None:
        """Begin at the start, or at the state of a checkpoint, which is the first checkpoint of this run too."""
        if restart is None:
            self.simulation.initialize()
            self._tell()
        else:
            with fitting(restart.source):
                self._given = self._given_before(restart)
                self._assembly.controls.order(self.plan.scenario_after(self._given), within_reach=False)
                begin_from(restart.state, self.simulation, self._assembly)
                for name, keeper in self._keepers.items():
                    if name in restart.state:
                        require_alike(name, restart.state[name], keeper.save_state())
                        keeper.restore_state(restart.state[name])
            self.simulation.emit(f"continues from {restart.source.name}", source="oilsim")
            for text in restart.left_out:
                self.simulation.emit(text, level="warning", source="oilsim")
        if self._assembly.why_not_kept:
            self._checkpoints = None
            self.simulation.emit(f"no checkpoints: {self._assembly.why_not_kept}", level="warning", source="oilsim")
        if self._checkpoints is not None and self._checkpoints.is_due(0):
            self._save(self._checkpoints, asked=False)

    def _given_before(self, restart: Restart) -> int:
        """Return how many actions of the plan were given before the checkpoint; ValueError for a number that cannot be."""
        before = sum(action.index < restart.index for action in self.plan.actions)
        until = sum(action.index <= restart.index for action in self.plan.actions)
        given = int(restart.state.get("orders_given", before))
        if not before <= given <= until:
            raise ValueError(f"it was saved after {given} orders, allowed: {before} to {until}")
        return given

    def _tell(self) -> None:
        """Tell observers what the accounts and warnings of the last step found."""
        if self._injects is not None:
            self._injects.look(self.simulation.communication_point.index)
        remarks = self._assembly.remarks.look(self._assembly.report())
        for notice in [*self._assembly.scoring.take_notices(), *remarks]:
            self.simulation.emit(notice.text, level=notice.level, source=notice.source)

    def _goes_on(self) -> bool:
        """Return whether the run makes another step; the instructor is heard before."""
        if self._requests.stop is None and not self._is_done() and self._instructor is not None:
            self._instructor.attend(self)
        return self._requests.stop is None and not self._is_done()

    def _is_done(self) -> bool:
        run = self.plan.scenario.run
        return (
            self._is_ended or self.simulation.communication_point.time >= run.duration - 1e-6 * run.communication_step
        )

    def _give_planned(self) -> None:
        """Give the orders of the plan at this communication point, one after the other, as they were given before.

        One that another run was given, and that cannot be obeyed in this one, is told and passed over.
        """
        index = self.simulation.communication_point.index
        while self._given < len(self.plan.actions) and self.plan.actions[self._given].index <= index:
            action = self.plan.actions[self._given]
            try:
                self._obey(self.plan)
            except ScenarioError as error:
                if not action.replayed:
                    raise
                self.plan = self.plan.without(self._given)
                reasons = "; ".join(map(str, error.problems))
                told = f"{action.text}: cannot be given any more: {reasons}"
                self.simulation.emit(told, level="warning", source="oilsim")
            else:
                self._count_given()

    def _obey(self, plan: Plan) -> None:
        """Bring every part to what the next action of a plan asks for; ScenarioError, and nothing changed, if that cannot be."""
        self._assembly.controls.order(plan.scenario_after(self._given + 1))

    def _count_given(self) -> None:
        """Count the next action of the plan as given; tell observers who gave it, and the injects that came with it."""
        action, before = self.plan.actions[self._given], self.plan.scenario_after(self._given)
        self.simulation.emit(action.text, source=action.by)
        self._given += 1
        for name, inject in self.plan.scenario_after(self._given).injects.items():
            if inject.given and not before.injects[name].given:
                self.simulation.emit(inject.text or name, level="warning", source=f"inject {name}")

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
            self.simulation.emit(f"no checkpoint was written: {self._why_unsaved()}", source="oilsim")
        else:
            path = self._save(self._checkpoints, asked=True)
            self.simulation.emit(f"checkpoint written: {path}", source="oilsim")

    def _why_unsaved(self) -> str:
        return self._assembly.why_not_kept or "there is no folder for checkpoints, see --checkpoints"

    def _save(self, checkpoints: CheckpointWriter, *, asked: bool) -> Path:
        state = run_state(self.simulation, self._assembly)
        state |= {name: keeper.save_state() for name, keeper in self._keepers.items()}
        state["orders_given"] = self._given
        return checkpoints.write(self.simulation.communication_point.index, state, asked=asked)


class Injects:
    """Watches the conditions of a scenario's injects, and says which injects are due.

    Times come from the scenario and its seed. Conditions are looked at after each step; the point at which one is met first is remembered,
    and belongs into checkpoints. So a run that is made again, or goes on from a checkpoint, gives the same injects at the same points.
    """

    def __init__(self, scenario: Scenario, parts: RunParts) -> None:
        """Watch a scenario as it begins; ScenarioError for orders and conditions that it cannot have."""
        problems = list(inject_problems(scenario.parts))
        if problems:
            raise ScenarioError(problems, scenario.name)
        self._scenario, self._parts = scenario, parts
        watched = {name: one for name, one in scenario.injects.items() if one.when is not None}
        signals = condition_signals(scenario.parts) if watched else {}
        self._reads = {name: signals[one.when.signal].read for name, one in watched.items() if one.when is not None}
        self._met: dict[str, int] = {}  # communication point at which a condition was met first
        self._skipped: set[str] = set()

    def look(self, index: int) -> None:
        """Note the conditions that are met first at a communication point."""
        time = index * self._scenario.run.communication_step
        for name, read in self._reads.items():
            when = self._scenario.injects[name].when
            assert when is not None and read is not None  # it is an output of the run
            if name not in self._met and time >= when.after and when.is_met_by(read(self._parts)):
                self._met[name] = index

    def due(self, scenario: Scenario, index: int) -> Iterator[str]:
        """Yield the names of the injects to give at a communication point; `scenario` says which have been given."""
        step = scenario.run.communication_step
        for name, inject in scenario.injects.items():
            if not inject.given and name not in self._skipped and index * step >= self._time(name) - WHOLE * step:
                yield name

    def skip(self, name: str) -> None:
        """Pass over an inject that cannot be given any more."""
        self._skipped.add(name)

    def _time(self, name: str) -> float:
        """Return the time [s] at which an inject is due; infinite if it is not known, or never."""
        inject, run = self._scenario.injects[name], self._scenario.run
        if inject.when is None:
            return inject.time_at(name, run.seed)
        comes, shift = inject.drawn(name, run.seed)
        met = self._met.get(name)
        return math.inf if met is None or not comes else met * run.communication_step + max(0.0, inject.delay + shift)

    def save_state(self) -> dict[str, Any]:
        """Return which conditions have been met, and which injects are passed over, as plain data."""
        return {"met": dict(self._met), "skipped": sorted(self._skipped)}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        self._skipped = set(saved["skipped"])
        self._met = {name: int(index) for name, index in saved["met"].items()}

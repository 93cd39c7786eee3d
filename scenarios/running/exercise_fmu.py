"""A whole exercise as a participant, and as an FMU that any master can run.

Inputs are the controls of a run that may be driven and that none of its own FMUs drives. An input that is never set leaves the run to
the scenario; once it is set, it overrides the scenario. Outputs are the signals that a run gives. The exercise begins when its master
begins, and its steps are whole communication steps.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from coupling.fmu.export import FmuContent
from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError
from coupling.master.participant import Participant, Status, StepResult, checked_value
from oilsim.backend.arrays import Array
from scenarios.controls.fmu_checks import all_are_kept
from scenarios.controls.signals import Signal, SignalBoard, signal_variables, signals_of
from scenarios.running.assembly import Assembly, build
from scenarios.schema.fmu_settings import ORDER_BOARD, connections_of
from scenarios.schema.parsing.structuring import as_data
from scenarios.spec.load import files_replaced, scenario_from
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import Problem, ScenarioError

SCENARIO_FILE = "scenario.json"
WHOLE = 1e-6  # of a communication step that a master's step may be off a whole number of them


class ExerciseParticipant(Participant):
    """The run of `scenario` as a participant; signals have the shape (1,) and SI units [-]. It is built on start."""

    STATE = ()

    def __init__(self, name: str, scenario: Scenario) -> None:
        self._scenario = scenario
        self._signals = exercise_signals(scenario)
        super().__init__(name, signal_variables(self._signals).values())
        self._given: dict[str, Array] = {}  # before the run
        self._is_begun = False
        self._start_time = 0.0
        self._assembly: Assembly | None = None
        self._board: SignalBoard | None = None
        self._simulation: CoSimulation | None = None

    def enter_initialization_mode(self, start_time: float) -> None:
        """Build the run, and apply the inputs that are already set; its own time is 0 when the first step begins."""
        self._assembly = build(self._scenario)
        self._board = SignalBoard(self.name, self._signals, self._assembly.parts)
        for name, value in self._given.items():
            self._board.set(name, value)
        self._simulation = self._assembly.co_simulation()

    def exit_initialization_mode(self) -> None:
        """Compute the first communication point of the run."""
        self._running().initialize()
        self._is_begun = True

    def get(self, name: str) -> Array:
        """Return a signal (1,) in its unit; before the run, an input has its set value or the scenario's. ValueError for an output then."""
        if self._board is not None:
            return self._board.get(name)
        signal = self._signals.get(name)
        if signal is None or not signal.is_input:
            raise ValueError(f"{self.name!r} has no value of {name!r} yet, allowed: after initialization")
        return self._given.get(name, np.array([signal.start])).copy()

    def set(self, name: str, value: Array) -> None:
        """Set an input (1,) in its unit."""
        if self._board is not None:
            self._board.set(name, value)
        if not self._is_begun:
            self._given[name] = checked_value(self.name, self.variables, name, value)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Take a whole number of communication steps; the status is ERROR for another step size, and if the run fails."""
        simulation, own = self._running(), self._scenario.run.communication_step
        if simulation.communication_point.index == 0 and math.isfinite(time):
            self._start_time = time  # not that of the initialization, which pythonfmu3 does not pass on
        reached = self._start_time + simulation.communication_point.time
        count = round(step_size / own) if math.isfinite(step_size) else 0
        added = simulation.communication_point.index + count + 1  # times that a master may have added up to come here
        slack = WHOLE * own + added * sys.float_info.epsilon * abs(reached)
        if count < 1 or not (abs(step_size - count * own) <= slack and abs(time - reached) <= slack):
            allowed = f"from {reached:.12g} s, whole multiples of communication_step = {own:g} s"
            message = f"the step is from {time:.12g} s by {step_size:.12g} s, allowed: {allowed}"
            return StepResult(Status.ERROR, reached, message)
        try:
            for _ in range(count):
                simulation.step()
                if not simulation.is_running:
                    reached = self._start_time + simulation.communication_point.time
                    return StepResult(Status.EARLY_RETURN, reached, "the exercise has ended", terminate_simulation=True)
        except CoSimulationError as error:
            return StepResult(Status.ERROR, self._start_time + error.time, str(error))
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        """Return everything that influences the future as plain data; NotImplementedError with an FMU whose state cannot be saved.

        Before the run, this is the values of the inputs, and whether the run has been built.
        """
        if not self._is_begun:
            return {"given": dict(self._given), "is_built": self._simulation is not None}
        simulation = self._running()
        assert self._assembly is not None
        if self._assembly.why_not_kept:
            raise NotImplementedError(f"{self.name!r}: {self._assembly.why_not_kept}")
        return {
            "start_time": self._start_time,
            "simulation": simulation.save_state(),
            "inputs": self._inputs().save_state(),
            **self._assembly.save_state(),
        }

    def restore_state(self, state: object) -> None:
        """Go back to a state that `save_state` returned; TypeError for anything else."""
        if not isinstance(state, dict):
            raise TypeError(
                f"{self.name!r}: restore_state got a {type(state).__name__}, allowed: a state that save_state returned"
            )
        if "given" in state or not self._is_begun or self._has_parted_since(state):
            self._begin_anew(state)
        if "given" in state:
            return
        assert self._assembly is not None
        self._start_time = state["start_time"]
        self._inputs().restore_state(state["inputs"])
        self._assembly.restore_state(state)
        self._running().restore_state(state["simulation"])

    def _has_parted_since(self, state: Mapping[str, Any]) -> bool:
        """Tell whether a joint that held when a state was saved has parted: no world makes one whole again."""
        assert self._assembly is not None
        now = self._assembly.strength.save_state()["parted"]
        return any(set(joints) - set(state["strength"]["parted"][boom]) for boom, joints in now.items())

    def _begin_anew(self, state: Mapping[str, Any]) -> None:
        """Go to a state that was saved before a run, or to the beginning of a run that this instance has not begun."""
        self.terminate()
        self._given = dict(state.get("given", self._given))
        if state.get("is_built", True):
            self.enter_initialization_mode(self._start_time)
        if "given" not in state:
            self.exit_initialization_mode()

    def terminate(self) -> None:
        """End the run, and free the world and the fluid's threads."""
        if self._simulation is not None:
            self._simulation.terminate()
        self._simulation = self._board = self._assembly = None
        self._is_begun = False

    def _running(self) -> CoSimulation:
        if self._simulation is None:
            raise RuntimeError(f"{self.name!r} is not running, allowed: between initialization and terminate")
        return self._simulation

    def _inputs(self) -> SignalBoard:
        assert self._board is not None  # made with the simulation
        return self._board


def exercise_signals(scenario: Scenario) -> dict[str, Signal]:
    """List the variables of an exercise: its free signals and its scores; ScenarioError for one with injects."""
    if scenario.injects:
        text = "is given, allowed: without them; an exported exercise takes its orders from its master"
        raise ScenarioError([Problem("injects", text)], scenario.name)
    driven = {one.target_variable for one in connections_of(scenario.fmus).values() if one.target == ORDER_BOARD}
    free = {name: s for name, s in signals_of(scenario.parts).items() if not (s.is_input and name in driven)}
    if not free:
        text = "has no signals, allowed: with vessels, booms, bodies that move, or a steady wind or current"
        raise ScenarioError([Problem("", text)], scenario.name)
    return free


def exercise_content(scenario: Scenario) -> FmuContent:
    """Return the content of a scenario's FMU: all that the scenario says, and the files of its meshes and FMUs."""
    files: dict[str, Path] = {}

    def packed(table: str, name: str, file: str) -> str:
        place = f"{table}-{name}{Path(file).suffix}"
        files[place] = Path(file)
        return place

    data = files_replaced(as_data(scenario), packed)
    return FmuContent(
        identifier=_identifier(scenario.name),
        factory="scenarios.running.exercise_fmu:packed_exercise",
        description=scenario.title or scenario.name,
        step_size=scenario.run.communication_step,
        stop_time=scenario.run.duration,
        texts={SCENARIO_FILE: json.dumps(data, indent=1)},
        files=files,
        saves_state=all_are_kept(scenario.fmus),
    )


def _identifier(name: str) -> str:
    """Make a Python name from a scenario's name that no other class of the FMU's script has; letters alone could make "True"."""
    return "Exercise" + "".join(part.capitalize() for part in name.replace("_", "-").split("-"))


def packed_exercise(folder: Path) -> ExerciseParticipant:
    """Create the exercise whose files are in the folder of an FMU."""
    data: dict[str, Any] = json.loads((folder / SCENARIO_FILE).read_text(encoding="utf-8"))
    scenario = scenario_from(data, folder=folder)
    return ExerciseParticipant(scenario.name, scenario)

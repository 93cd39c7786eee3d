"""The master: steps participants in lockstep, moves values between them, and ends a failing run in order.

Time is counted in whole communication steps, t_k = start + k H, so that no rounding accumulates and a run of any
length meets its last communication point exactly.
"""

from __future__ import annotations

import math
import time as wall_clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import Any, NoReturn

import numpy as np

from coupling.algorithms import Algorithm, GaussSeidel, transfer
from coupling.connection import Connection, setup_problems
from coupling.errors import CoSimulationError, CouplingSetupError
from coupling.observer import Observer
from coupling.participant import Causality, Participant, Status
from recordings.frame import Event, EventLevel, Frame, RunDescription

TIME_TOLERANCE = 1e-9  # of a communication step: far above rounding, far below anything that moves
EARLY_RETURNS_ALLOWED = 1000  # in one communication step, so that a participant that never advances is found


@dataclass(frozen=True)
class CommunicationPoint:
    """Where the participants meet: `index` whole steps of `step_size` [s] since the start, at `time` [s]."""

    index: int
    time: float
    step_size: float


FrameSource = Callable[[CommunicationPoint], Frame]


class _Phase(Enum):
    CREATED = "created"
    RUNNING = "running"
    TERMINATED = "terminated"


class CoSimulation:
    """A coupled run of several participants.

    Call order: `initialize()`, then `step()` or `run(until)` as often as wanted, then `terminate(reason)`. After a
    failure the run has been terminated already. Frames are made by `frame_source`, and only if somebody watches.
    """

    def __init__(
        self,
        participants: Sequence[Participant],
        connections: Sequence[Connection],
        communication_step_size: float,
        *,
        start_time: float = 0.0,
        observers: Sequence[Observer] = (),
        algorithm: Algorithm | None = None,
        frame_source: FrameSource | None = None,
        run_description: RunDescription | None = None,
    ) -> None:
        """Check everything that can be checked before a run; CouplingSetupError lists every problem at once."""
        problems = setup_problems(participants, connections)
        if not (math.isfinite(communication_step_size) and communication_step_size > 0.0):
            problems.append(f"communication_step_size is {communication_step_size} s, allowed: above 0")
        if not math.isfinite(start_time):
            problems.append(f"start_time is {start_time} s, allowed: a finite time")
        if observers and (frame_source is None or run_description is None):
            problems.append("observers watch, but frame_source or run_description is missing")
        if problems:
            raise CouplingSetupError(problems)
        self._participants = tuple(participants)
        self._connections = tuple(connections)
        self._step_size = communication_step_size
        self._start_time = start_time
        self._observers = tuple(observers)
        self._algorithm: Algorithm = algorithm if algorithm is not None else GaussSeidel()
        self._frame_source = frame_source
        self._run_description = run_description
        self._index = 0
        self._phase = _Phase.CREATED
        self._watched = False  # observers have been told that the run begins
        self._wall_seconds = {participant.name: 0.0 for participant in participants}

    @property
    def communication_point(self) -> CommunicationPoint:
        """Where the run stands."""
        return CommunicationPoint(self._index, self._time_of(self._index), self._step_size)

    @property
    def wall_seconds(self) -> dict[str, float]:
        """Wall time [s] each participant has spent in `do_step` so far, by name."""
        return dict(self._wall_seconds)

    def initialize(self, saved: Mapping[str, Any] | None = None) -> None:
        """Bring every participant to the start time, exchange initial values, and show observers the first frame.

        With `saved`, what `save_state` returned, the run goes on from there, and observers are shown what follows only: the
        frame at that point belongs to the run that was saved.
        """
        self._require(_Phase.CREATED, "initialize")
        self._phase = _Phase.RUNNING
        for participant in self._participants:
            self._guarded(participant, partial(participant.enter_initialization_mode, self._start_time))
        self._exchange_initial_values()
        for participant in self._participants:
            self._guarded(participant, participant.exit_initialization_mode)
        if saved is not None:
            self._restore(saved)
        self._check_outputs()
        self._notify_initialized(first_frame=saved is None)

    def save_state(self) -> dict[str, Any]:
        """The state of every participant and the number of steps done; between steps only."""
        self._require(_Phase.RUNNING, "save_state")
        states: dict[str, object] = {}
        for participant in self._participants:
            self._guarded(participant, partial(_save_into, states, participant))
        return {"index": self._index, "participants": states}

    def step(self) -> None:
        """One communication step, then observers are told."""
        self._require(_Phase.RUNNING, "step")
        try:
            self._algorithm.step(self._participants, self._connections, self._step_participant)
        except CoSimulationError:
            raise
        except Exception as cause:
            self._fail("master", f"values could not be exchanged: {cause}", cause)
        self._index += 1
        self._check_outputs()
        self._notify_frame()

    def run(self, until: float) -> None:
        """Steps up to the first communication point at or after `until` [s]."""
        self._require(_Phase.RUNNING, "run")
        last = math.ceil((until - self._start_time) / self._step_size - TIME_TOLERANCE)
        while self._index < last:
            self.step()

    def emit(self, text: str, *, level: EventLevel = "info", source: str = "") -> None:
        """Tell observers something worth a line in the log, at the current time."""
        event = Event(self.communication_point.time, text, level, source)
        self._notify(lambda observer: observer.event(event))

    def terminate(self, reason: str = "finished") -> None:
        """End the run: participants in order, then observers. A second call does nothing."""
        if self._phase is _Phase.TERMINATED:
            return
        failures = self._terminate_participants(except_for="")
        self._notify(lambda observer: observer.terminated(reason))
        if failures:
            name, cause = failures[0]
            raise CoSimulationError(name, self.communication_point.time, f"could not terminate: {cause}") from cause

    def _time_of(self, index: int) -> float:
        return self._start_time + index * self._step_size

    def _require(self, phase: _Phase, call: str) -> None:
        if self._phase is not phase:
            raise RuntimeError(f"{call} is called on a run that is {self._phase.value}, allowed: {phase.value}")

    def _guarded(self, participant: Participant, call: Callable[[], None]) -> None:
        """Make a call to a participant; its exception ends the run under its name."""
        try:
            call()
        except Exception as cause:
            self._fail(participant.name, str(cause) or type(cause).__name__, cause)

    def _restore(self, saved: Mapping[str, Any]) -> None:
        """Every participant as it was saved, and the clock with them."""
        states = saved["participants"]
        names = {participant.name for participant in self._participants}
        if states.keys() != names:
            self._fail(
                "master", f"the saved state is of {', '.join(sorted(states))}, allowed: {', '.join(sorted(names))}"
            )
        for participant in self._participants:
            self._guarded(participant, partial(participant.restore_state, states[participant.name]))
        self._index = int(saved["index"])

    def _exchange_initial_values(self) -> None:
        """Initial outputs reach initial inputs, along chains of any length that outputs pass straight through."""
        by_name = {participant.name: participant for participant in self._participants}
        try:
            for _ in self._participants:
                transfer(self._connections, by_name)
        except Exception as cause:
            self._fail("master", f"initial values could not be exchanged: {cause}", cause)

    def _step_participant(self, participant: Participant) -> None:
        """From this communication point to the next, over as many early returns as the participant needs."""
        begin, end = self._time_of(self._index), self._time_of(self._index + 1)
        tolerance = TIME_TOLERANCE * self._step_size
        reached = begin
        started = wall_clock.perf_counter()
        for _ in range(EARLY_RETURNS_ALLOWED):
            previous = reached
            try:
                result = participant.do_step(reached, end - reached)
            except Exception as cause:
                self._fail(participant.name, str(cause) or type(cause).__name__, cause)
            reached = result.last_successful_time
            if result.status in (Status.DISCARD, Status.ERROR):
                self._fail(participant.name, f"{result.status.value}: {result.message or 'no reason given'}")
            if not previous - tolerance <= reached <= end + tolerance:
                self._fail(participant.name, f"reached {reached} s, allowed: {previous} to {end} s")
            if result.status is Status.OK:
                break
        if abs(reached - end) > tolerance:
            self._fail(participant.name, f"stopped at {reached} s, allowed: {end} s")
        self._wall_seconds[participant.name] += wall_clock.perf_counter() - started

    def _check_outputs(self) -> None:
        """Find a NaN or an infinity once a communication step, where it first shows."""
        for participant in self._participants:
            for variable in participant.variables.values():
                if variable.causality is not Causality.OUTPUT:
                    continue
                value = participant.get(variable.name)
                if not np.isfinite(value).all():
                    self._fail(participant.name, f"output {variable.name!r} is {value}, allowed: finite numbers")

    def _fail(self, participant: str, message: str, cause: BaseException | None = None) -> NoReturn:
        """End the run in order and raise; the one that failed is not called again."""
        error = CoSimulationError(participant, self.communication_point.time, message)
        self._terminate_participants(except_for=participant)
        event = Event(error.time, str(error), "error", participant)
        self._notify(lambda observer: observer.event(event), raise_failures=False)
        self._notify(lambda observer: observer.terminated(str(error)), raise_failures=False)
        raise error from cause

    def _terminate_participants(self, except_for: str) -> list[tuple[str, Exception]]:
        """Terminate in order, all of them even if one cannot; returns those that could not."""
        failures: list[tuple[str, Exception]] = []
        if self._phase is _Phase.TERMINATED:
            return failures
        self._phase = _Phase.TERMINATED
        for participant in self._participants:
            if participant.name == except_for:
                continue
            try:
                participant.terminate()
            except Exception as cause:
                failures.append((participant.name, cause))
        return failures

    def _notify_initialized(self, *, first_frame: bool) -> None:
        if self._run_description is not None:
            run = self._run_description
            self._watched = True
            self._notify(lambda observer: observer.initialized(run))
        if first_frame:
            self._notify_frame()

    def _notify_frame(self) -> None:
        if self._observers and self._frame_source is not None:
            frame = self._frame_source(self.communication_point)
            self._notify(lambda observer: observer.step_completed(frame))

    def _notify(self, call: Callable[[Observer], None], *, raise_failures: bool = True) -> None:
        """Tell every observer. One that fails ends the run and the others are told why."""
        for observer in self._observers if self._watched else ():
            try:
                call(observer)
            except Exception as cause:
                if not raise_failures:
                    continue
                self._end_without(observer, f"observer {type(observer).__name__} failed: {cause}")
                raise

    def _end_without(self, failed: Observer, reason: str) -> None:
        """End the run in order and tell the observers that still listen."""
        self._terminate_participants(except_for="")
        self._observers = tuple(observer for observer in self._observers if observer is not failed)
        self._notify(lambda observer: observer.terminated(reason), raise_failures=False)


def _save_into(states: dict[str, object], participant: Participant) -> None:
    """Put a participant's state under its name."""
    states[participant.name] = participant.save_state()

"""The master: it steps participants in lockstep, transfers values between them, and ends a failing run properly.

Time is counted in whole communication steps, t_k = start + k H, so that no rounding accumulates and a run of any length meets its last
communication point exactly. A participant of sub-rate n makes n equal steps in each. If a participant discards a step, the step is
tried again with half its length: by that participant alone, with its inputs held, or, in a run that `rolls_back`, by all of them after
they have gone back to the communication point. All that may be rolled back are tested at the start (see `rollback_test`). A participant
that cannot save its state is named and not rolled back. A participant that does not repeat its step bit for bit ends the run.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from functools import partial
from types import MappingProxyType
from typing import Any, NoReturn, TypeVar

from coupling.master.blas_threads import one_blas_thread
from coupling.master.connection import Connection, link, setup_problems
from coupling.master.errors import CoSimulationError, CouplingSetupError, reason
from coupling.master.exchange_ledger import GAUSS_SEIDEL, Exchange
from coupling.master.initialization import exchange_initial_values
from coupling.master.observer_dispatch import NOBODY, Audience, CommunicationPoint, Watching, tried
from coupling.master.participant import Participant
from coupling.master.saved_fields import require_alike
from coupling.master.stepper import HALVINGS, TIME_TOLERANCE, Discarded, NotExchanged, Snapshot, Stepper, rollback_fault
from oilsim.backend.arrays import Array
from recordings.model.frame import Event, EventLevel

FINEST = 1e-3  # of a step, that times must tell apart
ALL_AT_ONE_RATE: Mapping[str, int] = MappingProxyType({})


Result = TypeVar("Result")


class _Phase(Enum):
    CREATED = "created"
    RUNNING = "running"
    TERMINATED = "terminated"


class CoSimulation:
    """A coupled run of several participants.

    Call order: `initialize()`, then `step()` or `run(until)` as often as wanted, then `terminate(reason)`. After a
    failure, or once a participant has asked for the end, the run has been terminated already: `is_running` tells.
    At every communication point the accounts advance; then `frame_source`, which only reads, makes a frame if somebody watches.
    """

    def __init__(
        self,
        participants: Sequence[Participant],
        connections: Sequence[Connection],
        communication_step_size: float,
        *,
        start_time: float = 0.0,
        sub_rates: Mapping[str, int] = ALL_AT_ONE_RATE,
        rolls_back: bool = False,
        exchange: Exchange = GAUSS_SEIDEL,
        watching: Watching = NOBODY,
    ) -> None:
        """Check everything that can be checked before a run; CouplingSetupError lists every problem at once.

        `sub_rates`: steps a participant makes in a communication step, 1 where it is not named. `rolls_back`: keep all
        states of every communication point, so that a discarded step is repeated by everybody.
        """
        problems = setup_problems(participants, connections) + _sub_rate_problems(participants, sub_rates)
        if not participants:
            problems.append("there are no participants, allowed: one or more")
        if not (math.isfinite(communication_step_size) and communication_step_size > 0.0):
            problems.append(f"communication_step_size is {communication_step_size} s, allowed: above 0")
        if not math.isfinite(start_time):
            problems.append(f"start_time is {start_time} s, allowed: a finite time")
        elif start_time + FINEST * communication_step_size == start_time:
            problems.append(
                f"start_time is {start_time} s, allowed: a time small enough that steps of {communication_step_size} s change it"
            )
        problems += watching.problems
        if problems:
            raise CouplingSetupError(problems)
        by_name = {participant.name: participant for participant in participants}
        self._steppers = {name: Stepper(by_name[name], sub_rates.get(name, 1)) for name in by_name}
        for name, participant in by_name.items():
            participant.expect_step(communication_step_size / sub_rates.get(name, 1))
        self._links = tuple(link(connection, by_name) for connection in connections)
        self._step_size = communication_step_size
        self._start_time = start_time
        self._audience = Audience(watching.observers, self._end)
        self._algorithm, self._ledger, self._accounts = exchange
        self._rolls_back = rolls_back
        self._rollback_faults: dict[str, str] = {}
        self._watching = watching
        self._index = 0
        self._phase = _Phase.CREATED
        self._opening: Sequence[str] = ()  # what the algorithm tells as the run begins

    @property
    def communication_point(self) -> CommunicationPoint:
        """The present communication point."""
        return CommunicationPoint(self._index, self._time_of(self._index), self._step_size)

    @property
    def is_running(self) -> bool:
        """True while `step` may be called."""
        return self._phase is _Phase.RUNNING

    @property
    def wall_seconds(self) -> dict[str, float]:
        """Wall time [s] of each participant in its steps so far, by name."""
        return {name: stepper.wall_seconds for name, stepper in self._steppers.items()}

    def outputs(self, participant: str) -> Mapping[str, Array]:
        """Return a participant's outputs at the present communication point, by name: of its variables' shapes (N, ...), units [-]."""
        return MappingProxyType(self._steppers[participant].outputs)

    @property
    def rollback_faults(self) -> Mapping[str, str]:
        """Reasons why participants cannot be rolled back, by name; empty if no rollback is needed."""
        return MappingProxyType(self._rollback_faults)

    @one_blas_thread()
    def initialize(self, saved: Mapping[str, Any] | None = None) -> None:
        """Bring every participant to the start time, exchange initial values, and show observers the first frame.

        With `saved`, which `save_state` returned, the run continues from there. Observers then only see what follows, because the frame at
        that point belongs to the run that was saved. Raises CoSimulationError for a participant that fails, and ValueError or
        KeyError for a state that is not of this run's form (`require_alike`).
        """
        self._require(_Phase.CREATED, "initialize")
        self._phase = _Phase.RUNNING
        for name, stepper in self._steppers.items():
            self._in_order(partial(stepper.participant.enter_initialization_mode, self._start_time), name)
        self._in_order(lambda: exchange_initial_values(self._steppers, self._links, self._start_time))
        for name, stepper in self._steppers.items():
            self._in_order(stepper.participant.exit_initialization_mode, name)
        self._in_order(self._begin_exchange)
        if saved is None:
            self._advance_accounts()
        else:
            require_alike("simulation", saved, self.save_state())
            self.restore_state(saved)
        self._notify_initialized(first_frame=saved is None)

    def save_state(self) -> dict[str, Any]:
        """Return state and outputs of every participant, the state of algorithm and ledger, and the clock; between steps only.

        Raises NotImplementedError if a participant cannot save its state; the run continues.
        """
        self._require(_Phase.RUNNING, "save_state")
        lacking: list[str] = []
        states = {name: self._in_order(partial(_saved, one, lacking), name) for name, one in self._steppers.items()}
        if lacking:
            raise NotImplementedError("; ".join(lacking))
        outputs = {name: dict(stepper.outputs) for name, stepper in self._steppers.items()}
        return {
            **self._clock(),
            "index": self._index,
            "participants": states,
            "outputs": outputs,
            "algorithm": self._algorithm.save_state(),
            "ledger": {} if self._ledger is None else self._ledger.save_state(),
        }

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Restore every participant and the clock; between steps only.

        Raises CoSimulationError for the state of other participants, or of a run with another start or step.
        """
        self._require(_Phase.RUNNING, "restore_state")
        self._in_order(partial(self._take_up, saved))

    @one_blas_thread()
    def step(self) -> None:
        """Make one communication step, advance the accounts, tell observers; the run ends here if a participant asks for it."""
        self._require(_Phase.RUNNING, "step")
        begin, end = self._time_of(self._index), self._time_of(self._index + 1)
        self._in_order(lambda: self._cover(begin, end, 0))
        self._index += 1
        self._advance_accounts()
        self._tell_events()
        self._notify_frame()
        enders = [stepper for stepper in self._steppers.values() if stepper.wants_end is not None]
        if enders:
            self.terminate(f"{enders[0].name} ends the run: {enders[0].wants_end}")

    def run(self, until: float) -> None:
        """Step up to the first communication point at or after `until` [s], or until a participant ends the run.

        Raises ValueError for a time that is not finite, CoSimulationError for a participant that fails.
        """
        self._require(_Phase.RUNNING, "run")
        if not math.isfinite(until):
            raise ValueError(f"run: until is {until} s, allowed: a finite time")
        rounding = 4.0 * sys.float_info.epsilon * max(abs(until), abs(self._start_time)) / self._step_size
        last = math.ceil((until - self._start_time) / self._step_size - max(TIME_TOLERANCE, rounding))
        while self._index < last and self.is_running:
            self.step()

    def emit(self, text: str, *, level: EventLevel = "info", source: str = "") -> None:
        """Send observers an event for the log, at the current time."""
        self._require(_Phase.RUNNING, "emit")
        self._audience.event(Event(self.communication_point.time, text, level, source))

    def terminate(self, reason: str = "finished") -> None:
        """End the run: participants in order, then observers; a second call does nothing. CoSimulationError if a participant cannot end."""
        if self._phase is _Phase.TERMINATED:
            return
        failures, unheard = self._end(reason)
        if failures:
            name, cause = next(iter(failures.items()))
            raise CoSimulationError(name, self.communication_point.time, f"could not terminate: {cause}") from cause
        if unheard:
            raise unheard[0]

    def _time_of(self, index: int) -> float:
        return self._start_time + index * self._step_size

    def _clock(self) -> dict[str, float]:
        """The start time and the step [s], which with its index give a communication point its time."""
        return {"start_time": self._start_time, "step_size": self._step_size}

    def _require(self, phase: _Phase, call: str) -> None:
        if self._phase is not phase:
            raise RuntimeError(f"{call} is called on a run that is {self._phase.value}, allowed: {phase.value}")

    def _in_order(self, call: Callable[[], Result], name: str = "master") -> Result:
        """Return what a call returns; what it raises ends the run, under the name of the participant that failed, or else under `name`.

        An interruption is meant for the process and passed on as it is; participants in the middle of a step are of no more use.
        """
        try:
            return call()
        except CoSimulationError as error:
            self._fail(error, error.__cause__)
        except NotExchanged as refusal:
            time = self.communication_point.time
            self._fail(CoSimulationError(refusal.participant, time, refusal.message), refusal.__cause__)
        except Exception as cause:
            self._fail(CoSimulationError(name, self.communication_point.time, reason(cause)), cause)
        except BaseException as interruption:
            self._end(f"interrupted by {type(interruption).__name__}")
            raise

    def _take_up(self, saved: Mapping[str, Any]) -> None:
        states, now = saved["participants"], self.communication_point.time
        if states.keys() != self._steppers.keys():
            message = f"the saved state has the participants {', '.join(sorted(states))}, allowed: {', '.join(sorted(self._steppers))}"
            raise CoSimulationError("master", now, message)
        for name, value in self._clock().items():
            if saved[name] != value:
                raise CoSimulationError(
                    "master", now, f"{name} of the saved state is {saved[name]} s, allowed: {value} s"
                )
        for name, stepper in self._steppers.items():
            stepper.restore(Snapshot(states[name], saved["outputs"][name]))
        self._algorithm.restore_state(saved["algorithm"])
        if self._ledger is not None:
            self._ledger.restore_state(saved["ledger"])
        self._index = int(saved["index"])

    def _begin_exchange(self) -> None:
        """Exchange the first outputs, test the participants that may be rolled back, then prepare the algorithm."""
        begin, end = self._start_time, self._time_of(1)
        for stepper in self._steppers.values():
            stepper.read_outputs(begin)
        rolled_back = self._algorithm.prepare(self._steppers, self._links)
        for name in self._steppers if self._rolls_back else rolled_back:
            fault = rollback_fault(self._steppers[name], begin, end)
            if fault:
                self._rollback_faults[name] = fault
        self._rolls_back &= not self._rollback_faults
        for stepper in self._steppers.values():
            stepper.passes_discards_on = self._rolls_back
        self._opening = self._algorithm.begin(self._rollback_faults)

    def _cover(self, begin: float, end: float, halvings: int) -> None:
        """Bring all from `begin` to `end`; if a step is discarded, go back and make two halves."""
        if not self._rolls_back:
            self._exchange(begin, end)
            return
        snapshots = {name: stepper.save() for name, stepper in self._steppers.items()}
        memory, accounts = self._algorithm.save_state(), {} if self._ledger is None else self._ledger.save_state()
        try:
            self._exchange(begin, end)
        except Discarded as refusal:
            if halvings == HALVINGS:
                message = f"discard: {refusal.message or 'no reason given'}, down to a step of {end - begin:.3g} s"
                raise CoSimulationError(refusal.participant, begin, message) from refusal
            for name, stepper in self._steppers.items():
                stepper.restore(snapshots[name])
            self._algorithm.restore_state(memory)
            if self._ledger is not None:
                self._ledger.restore_state(accounts)
            middle = 0.5 * (begin + end)
            self._cover(begin, middle, halvings + 1)
            self._cover(middle, end, halvings + 1)

    def _exchange(self, begin: float, end: float) -> None:
        """One step of the algorithm, with its accounts, from where others may have moved shared participants."""
        for stepper in self._steppers.values():
            stepper.observe(begin)
        if self._ledger is not None:
            self._ledger.open(self._steppers)
        self._algorithm.step(self._steppers, self._links, begin, end)
        if self._ledger is not None:
            self._ledger.close(self._steppers, begin, end)

    def _advance_accounts(self) -> None:
        for account in self._accounts:
            self._in_order(partial(account, self.communication_point), "accounts")

    def _fail(self, error: CoSimulationError, cause: BaseException | None = None) -> NoReturn:
        """End the run and raise the error; errors of the end itself are not reported, because the failure comes first."""
        event = Event(error.time, str(error), "error", error.participant)
        self._end(str(error), event)
        raise error from cause

    def _end(self, reason: str, event: Event | None = None) -> tuple[dict[str, BaseException], list[BaseException]]:
        """End all participants in order, then tell observers; returns what went wrong in either.

        An interruption of the end is raised when all have been told.
        """
        self._phase = _Phase.TERMINATED
        raised = tried([stepper.participant.terminate for stepper in self._steppers.values()])
        failures = {name: error for name, error in zip(self._steppers, raised, strict=True) if error is not None}
        unheard = self._audience.end([*self._take_events(), *([] if event is None else [event])], reason)
        for error in [*failures.values(), *unheard]:
            if not isinstance(error, Exception):
                raise error
        return failures, unheard

    def _take_events(self) -> list[Event]:
        """Return the participants' events that observers have not seen yet."""
        events: list[Event] = []
        for stepper in self._steppers.values():
            events += stepper.events
            stepper.events.clear()
        return events

    def _tell_events(self) -> None:
        for event in self._take_events():
            self._audience.event(event)

    def _notify_initialized(self, *, first_frame: bool) -> None:
        if self._watching.run_description is not None:
            self._audience.begin(self._watching.run_description)
        for name, fault in self._rollback_faults.items():
            self.emit(f"participant {name!r} cannot be rolled back: {fault}", level="warning", source=name)
        for text in self._opening:
            self.emit(text, source="master")
        self._tell_events()
        if first_frame:
            self._notify_frame()

    def _notify_frame(self) -> None:
        source = self._watching.frame_source
        if self._audience.is_listening and source is not None:
            self._audience.frame(self._in_order(partial(source, self.communication_point), "frame_source"))


def _saved(stepper: Stepper, lacking: list[str]) -> object:
    """Return a participant's state; if it cannot be saved, add the reason to `lacking`."""
    try:
        return stepper.participant.save_state()
    except NotImplementedError as cause:
        lacking.append(f"participant {stepper.name!r}: {reason(cause)}")
        return None


def _sub_rate_problems(participants: Sequence[Participant], sub_rates: Mapping[str, int]) -> list[str]:
    """List everything that is wrong with the sub-rates, one sentence each."""
    names = [participant.name for participant in participants]
    unknown = [
        f"sub_rates has the participant {name!r}, allowed: {', '.join(names)}"
        for name in sub_rates
        if name not in names
    ]
    return unknown + [
        f"the sub-rate of {name!r} is {rate!r}, allowed: a whole number, 1 or more"
        for name, rate in sub_rates.items()
        if isinstance(rate, bool) or not (isinstance(rate, int) and rate >= 1)
    ]

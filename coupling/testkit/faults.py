"""A participant that fails at a chosen time, for tests of masters and exercises; import it from `coupling.testing`."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

import numpy as np

from coupling.participant import Array, Causality, EventParticipant, Participant, Status, StepResult, Variable
from oilsim.checks import finite

SHORTER = 0.75  # of the full step: the rest after an early return, and half a discarded step, are shorter


class Fault(Enum):
    """Kind of fault of a `FaultyParticipant`.

    EARLY_RETURN: it stops half way and asks to be called again; DISCARD: it refuses a step of full length, its state unchanged;
    ERROR: it returns the status ERROR; EXCEPTION: it raises RuntimeError; NAN: the step succeeds, but all its outputs are NaN;
    LATE: it reports a time beyond the end of the step.
    """

    EARLY_RETURN = "early return"
    DISCARD = "discard"
    ERROR = "error"
    EXCEPTION = "exception"
    NAN = "nan"
    LATE = "late"


class FaultyParticipant:
    """Wraps a participant and has a fault in the step that contains `at_time` [s]; all other calls go to that participant.

    Raises TypeError for a fault that is no `Fault`, and ValueError for a time that is no finite number.
    """

    def __init__(self, participant: Participant, fault: Fault, *, at_time: float) -> None:
        if not isinstance(fault, Fault):
            raise TypeError(f"fault is {fault!r}, allowed: {', '.join(map(str, Fault))}")
        finite("at_time of the fault [s]", at_time)
        self._participant = participant
        self._fault = fault
        self._at_time = at_time
        self._is_spoilt = False
        self._full_step: float | None = None

    @property
    def name(self) -> str:
        """Name of the wrapped participant."""
        return self._participant.name

    @property
    def variables(self) -> Mapping[str, Variable]:
        """Variables of the wrapped participant."""
        return self._participant.variables

    def enter_initialization_mode(self, start_time: float) -> None:
        """Pass the call on to the wrapped participant."""
        self._participant.enter_initialization_mode(start_time)

    def exit_initialization_mode(self) -> None:
        """Pass the call on to the wrapped participant."""
        self._participant.exit_initialization_mode()

    def get(self, name: str) -> Array:
        """Return the wrapped participant's value, of the variable's shape, as (6,), and unit, as [m]; NaN for outputs after a NAN fault."""
        value = self._participant.get(name)
        is_output = self.variables[name].causality is Causality.OUTPUT
        return np.full_like(value, np.nan) if self._is_spoilt and is_output else value

    def set(self, name: str, value: Array) -> None:
        """Set the variable of the wrapped participant, of its shape, as (6,), and unit, as [m]."""
        self._participant.set(name, value)

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Make the wrapped participant's step, or the fault if `at_time` lies in it; RuntimeError if that is an exception."""
        if not time <= self._at_time < time + step_size:
            return self._participant.do_step(time, step_size)
        self._full_step = self._full_step or step_size
        text = f"injected at {self._at_time:g} s"
        if self._fault is Fault.EXCEPTION:
            raise RuntimeError(f"exception {text}")
        if self._fault is Fault.ERROR:
            return StepResult(Status.ERROR, time, f"error {text}")
        if self._fault is Fault.DISCARD and step_size > SHORTER * self._full_step:
            return StepResult(Status.DISCARD, time, f"discard {text}")
        if self._fault is Fault.EARLY_RETURN and step_size > SHORTER * self._full_step:
            half = self._participant.do_step(time, 0.5 * step_size)
            return StepResult(Status.EARLY_RETURN, half.last_successful_time, f"early return {text}")
        result = self._participant.do_step(time, step_size)
        self._is_spoilt = self._fault is Fault.NAN
        if self._fault is Fault.LATE:
            return StepResult(Status.OK, result.last_successful_time + step_size, f"late {text}")
        return result

    def update_discrete_states(self) -> bool:
        """Pass the call on to the wrapped participant; AttributeError if that has no events."""
        events: EventParticipant = self._participant  # type: ignore[assignment]
        return events.update_discrete_states()

    def save_state(self) -> object:
        """Return the state of the wrapped participant."""
        return self._participant.save_state()

    def restore_state(self, state: object) -> None:
        """Restore the state of the wrapped participant."""
        self._participant.restore_state(state)

    def terminate(self) -> None:
        """Terminate the wrapped participant."""
        self._participant.terminate()

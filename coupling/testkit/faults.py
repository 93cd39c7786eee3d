"""Faults on purpose: of participants, FMUs and observers; import them from `coupling.testkit`."""

from __future__ import annotations

import os
import signal
import time as wall_clock
from collections.abc import Sequence
from enum import Enum

import numpy as np

from coupling.master.participant import (
    Array,
    Causality,
    Participant,
    Status,
    StepResult,
)
from oilsim.fluid.checks import finite
from recordings.files.errors import RecordingError
from recordings.model.frame import Event, Frame, RunDescription

SHORTER = 0.75  # of the full step: the rest after an early return, and half a discarded step, are shorter
STALL = 0.5  # [s] of wall time that a hanging participant or observer in this process takes; chosen: longer than any step of a test
WRONG_UNIT = 1000.0  # [1] factor of values in a wrong unit: millimetres for metres, newtons for kilonewtons


class Fault(Enum):
    """Kind of fault.

    EARLY_RETURN: it stops half way and asks to be called again; DISCARD: it refuses a step of full length, its state unchanged;
    ERROR: it returns the status ERROR; EXCEPTION: it raises RuntimeError; NAN: the step succeeds, but all its outputs are NaN;
    LATE: it reports a time beyond the end of the step; WRONG_UNIT: from now on its outputs are WRONG_UNIT times too large;
    HANG: an FMU in a process of its own never comes back, anything else stalls for STALL and goes on; CRASH: the FMU's process dies.
    """

    EARLY_RETURN = "early return"
    DISCARD = "discard"
    ERROR = "error"
    EXCEPTION = "exception"
    NAN = "nan"
    LATE = "late"
    WRONG_UNIT = "wrong unit"
    HANG = "hang"
    CRASH = "crash"


OBSERVERS_FAULTS = (Fault.EXCEPTION, Fault.HANG)


class FaultyParticipant(Participant):
    """Wraps a participant and has a fault in the step that contains `at_time` [s]; all other calls go to that participant.

    Raises TypeError for a fault that is no `Fault`, and ValueError for a time that is no finite number, and for a crash of a participant
    that has no process of its own.
    """

    STATE = ("_participant", "_factor")

    def __init__(self, participant: Participant, fault: Fault, *, at_time: float) -> None:
        require_fault(fault, at_time, tuple(Fault))
        if fault is Fault.CRASH and not hasattr(participant, "process_id"):
            raise ValueError(
                f"fault of {participant.name!r} is {fault}, allowed: for an FMU in a process of its own, an IsolatedFmu"
            )
        self.name, self.variables = participant.name, participant.variables
        self._participant = participant
        self._fault = fault
        self._at_time = at_time
        self._factor = 1.0
        self._full_step: float | None = None

    def expect_step(self, step_size: float) -> None:
        """Pass the call on to the wrapped participant; step_size [s]."""
        self._participant.expect_step(step_size)

    def observe(self) -> bool:
        """Pass the call on to the wrapped participant."""
        return self._participant.observe()

    def enter_initialization_mode(self, start_time: float) -> None:
        """Pass the call on to the wrapped participant."""
        self._participant.enter_initialization_mode(start_time)

    def exit_initialization_mode(self) -> None:
        """Pass the call on to the wrapped participant."""
        self._participant.exit_initialization_mode()

    def get(self, name: str) -> Array:
        """Return the participant's value, of the variable's shape, as (6,), and unit, as [m]; outputs as the fault leaves them."""
        value = self._participant.get(name)
        is_output = self.variables[name].causality is Causality.OUTPUT
        return np.asarray(self._factor * value) if is_output and self._factor != 1.0 else value

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
        self._disturb_process()
        result = self._participant.do_step(time, step_size)
        if self._fault in (Fault.NAN, Fault.WRONG_UNIT):
            self._factor = np.nan if self._fault is Fault.NAN else WRONG_UNIT
        if self._fault is Fault.LATE:
            return StepResult(Status.OK, result.last_successful_time + step_size, f"late {text}")
        return result

    def _disturb_process(self) -> None:
        """Stop or kill the process of an FMU, or stall this one, if that is the fault."""
        process = getattr(self._participant, "process_id", None)
        if self._fault is Fault.CRASH and process is not None:
            os.kill(process, signal.SIGKILL)
        if self._fault is Fault.HANG and process is not None:
            os.kill(process, signal.SIGSTOP)
        elif self._fault is Fault.HANG:
            wall_clock.sleep(STALL)

    def update_discrete_states(self) -> bool:
        """Pass the call on to the wrapped participant."""
        return self._participant.update_discrete_states()

    def terminate(self) -> None:
        """Terminate the wrapped participant."""
        self._participant.terminate()


class FaultyObserver:
    """An observer, such as a viewer, that raises RecordingError (EXCEPTION) or stalls for STALL (HANG).

    It does so once, at the first frame at or after `at_time` [s]. Raises TypeError and ValueError for another fault or time.
    """

    def __init__(self, fault: Fault, *, at_time: float) -> None:
        require_fault(fault, at_time, OBSERVERS_FAULTS)
        self.fault, self.at_time, self._has_failed = fault, at_time, False

    def initialized(self, run: RunDescription) -> None:
        """Take the beginning without a fault."""

    def step_completed(self, frame: Frame) -> None:
        """Fail once, when it is time."""
        if self._has_failed or frame.time < self.at_time - 1e-9:
            return
        self._has_failed = True
        if self.fault is Fault.EXCEPTION:
            raise RecordingError("of the viewer", f"exception injected at {self.at_time:g} s")
        wall_clock.sleep(STALL)

    def event(self, event: Event) -> None:
        """Take an event without a fault."""

    def terminated(self, reason: str) -> None:
        """Take the end without a fault."""


def require_fault(fault: Fault, at_time: float, allowed: Sequence[Fault]) -> None:
    """Refuse what is no fault (TypeError), or is not allowed here, or a time [s] that is not finite (ValueError)."""
    if not isinstance(fault, Fault):
        raise TypeError(f"fault is {fault!r}, allowed: {', '.join(map(str, allowed))}")
    if fault not in allowed:
        raise ValueError(f"fault is {fault}, allowed: {', '.join(map(str, allowed))}")
    finite("at_time of the fault [s]", at_time)

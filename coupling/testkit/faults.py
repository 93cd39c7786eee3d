"""Faults on purpose: of participants, FMUs, lines and observers, in any run; import them from `coupling.testing`."""

from __future__ import annotations

import os
import signal
import time as wall_clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from coupling.observer import Observer
from coupling.participant import (
    Array,
    Causality,
    EvenStepParticipant,
    EventParticipant,
    Participant,
    SharedParticipant,
    Status,
    StepResult,
    Variable,
)
from coupling.rigid.rigid_body_world import RigidBodyWorld
from oilsim.checks import finite
from recordings.frame import Event, Frame, RunDescription

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


class FaultyParticipant:
    """Wraps a participant and has a fault in the step that contains `at_time` [s]; all other calls go to that participant.

    Raises TypeError for a fault that is no `Fault`, and ValueError for a time that is no finite number, and for a crash of a participant
    that has no process of its own.
    """

    def __init__(self, participant: Participant, fault: Fault, *, at_time: float) -> None:
        _require_fault(fault, at_time, tuple(Fault))
        if fault is Fault.CRASH and not hasattr(participant, "process_id"):
            raise ValueError(
                f"fault of {participant.name!r} is {fault}, allowed: for an FMU in a process of its own, an IsolatedFmu"
            )
        self._participant = participant
        self._fault = fault
        self._at_time = at_time
        self._factor = 1.0
        self._full_step: float | None = None

    @property
    def name(self) -> str:
        """Name of the wrapped participant."""
        return self._participant.name

    @property
    def variables(self) -> Mapping[str, Variable]:
        """Variables of the wrapped participant."""
        return self._participant.variables

    def expect_step(self, step_size: float) -> None:
        """Pass the call on if the wrapped participant takes it; step_size [s]."""
        if isinstance(self._participant, EvenStepParticipant):
            self._participant.expect_step(step_size)

    def observe(self) -> None:
        """Pass the call on if the wrapped participant takes it."""
        if isinstance(self._participant, SharedParticipant):
            self._participant.observe()

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


class FaultyObserver:
    """An observer, such as a viewer, that raises RuntimeError (EXCEPTION) or stalls for STALL (HANG).

    It does so once, at the first frame at or after `at_time` [s]. Raises TypeError and ValueError for another fault or time.
    """

    def __init__(self, fault: Fault, *, at_time: float) -> None:
        _require_fault(fault, at_time, OBSERVERS_FAULTS)
        self._fault, self._at_time, self._has_failed = fault, at_time, False

    def initialized(self, run: RunDescription) -> None:
        """Take the beginning without a fault."""

    def step_completed(self, frame: Frame) -> None:
        """Fail once, when it is time."""
        if self._has_failed or frame.time < self._at_time - 1e-9:
            return
        self._has_failed = True
        if self._fault is Fault.EXCEPTION:
            raise RuntimeError(f"exception injected at {self._at_time:g} s")
        wall_clock.sleep(STALL)

    def event(self, event: Event) -> None:
        """Take an event without a fault."""

    def terminated(self, reason: str) -> None:
        """Take the end without a fault."""


class PartingLine:
    """A participant that lets a line or a joint of a world part in the step that contains `at_time` [s]; ValueError for an unknown line."""

    def __init__(self, world: RigidBodyWorld, line: str, at_time: float) -> None:
        known = (*world.lines.names, *world.joint_names)
        if line not in known:
            raise ValueError(f"line {line!r} that is to part does not exist, allowed: {', '.join(known) or 'none'}")
        self.name = f"parting of {line}"
        self.variables: Mapping[str, Variable] = {}
        self._part = world.part_line if line in world.lines.names else world.part_joint
        self._line, self._at_time, self._has_parted = line, at_time, False

    def enter_initialization_mode(self, start_time: float) -> None:
        """Do nothing: there is nothing to prepare."""

    def exit_initialization_mode(self) -> None:
        """Do nothing: there is nothing to finish."""

    def get(self, name: str) -> Array:
        """Raise ValueError: there are no variables, of any shape (N,) or unit [-]."""
        raise ValueError(f"{self.name!r} has no variable {name!r}, allowed: none")

    def set(self, name: str, value: Array) -> None:
        """Raise ValueError: there are no variables, of any shape (N,) or unit [-]."""
        raise ValueError(f"{self.name!r} has no variable {name!r}, allowed: none")

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Let the line part when it is time, once."""
        if not self._has_parted and time <= self._at_time < time + step_size:
            self._has_parted = True
            self._part(self._line)
        return StepResult(Status.OK, time + step_size)

    def save_state(self) -> object:
        """Refuse with NotImplementedError: a parted line cannot be mended."""
        raise NotImplementedError("a line that parts on purpose cannot be mended")

    def restore_state(self, state: object) -> None:
        """Refuse with NotImplementedError, as `save_state` does."""
        raise NotImplementedError("a line that parts on purpose cannot be mended")

    def terminate(self) -> None:
        """Leave the world as it is."""


@dataclass
class FaultPlan:
    """The faults of a run, stated before it begins.

    scene.faults.participant("fluid", Fault.NAN, at_time=0.1)
    scene.faults.line("tow", at_time=0.2)
    scene.faults.observer(Fault.EXCEPTION, at_time=0.3)
    """

    _of_participants: dict[str, list[tuple[Fault, float]]] = field(default_factory=dict)
    _of_lines: dict[str, float] = field(default_factory=dict)
    _of_observers: list[FaultyObserver] = field(default_factory=list)

    def participant(self, name: str, fault: Fault, *, at_time: float) -> None:
        """Let a participant fail in the step that contains `at_time` [s]; errors are those of `FaultyParticipant`."""
        _require_fault(fault, at_time, tuple(Fault))
        self._of_participants.setdefault(name, []).append((fault, at_time))

    def line(self, name: str, *, at_time: float) -> None:
        """Let a line or a joint part at `at_time` [s]; ValueError for a time that is not finite."""
        finite("at_time of the parting line [s]", at_time)
        self._of_lines[name] = at_time

    def observer(self, fault: Fault, *, at_time: float) -> None:
        """Add a viewer that raises or stalls at `at_time` [s]; errors are those of `FaultyObserver`."""
        self._of_observers.append(FaultyObserver(fault, at_time=at_time))

    def applied(self, participant: Participant) -> Participant:
        """Return what takes part in the participant's place."""
        for fault, at_time in self._of_participants.get(participant.name, ()):
            participant = FaultyParticipant(participant, fault, at_time=at_time)
        return participant

    def observers(self, observers: Sequence[Observer]) -> list[Observer]:
        """Return the observers of the run, those that fail last."""
        return [*observers, *self._of_observers]

    def partings(self, world: RigidBodyWorld | None) -> list[PartingLine]:
        """Return the participants that let lines part; ValueError for an unknown line, or a line in a run without bodies."""
        if self._of_lines and world is None:
            raise ValueError(f"line {min(self._of_lines)!r} is to part, allowed: in a run with bodies")
        return [] if world is None else [PartingLine(world, *one) for one in self._of_lines.items()]

    def require_met(self, names: Sequence[str]) -> None:
        """Refuse faults of participants that the run does not have; ValueError."""
        strange = sorted(set(self._of_participants) - set(names))
        if strange:
            raise ValueError(f"fault of {strange[0]!r}, which does not take part, allowed: {', '.join(names)}")


def _require_fault(fault: Fault, at_time: float, allowed: Sequence[Fault]) -> None:
    if not isinstance(fault, Fault):
        raise TypeError(f"fault is {fault!r}, allowed: {', '.join(map(str, allowed))}")
    if fault not in allowed:
        raise ValueError(f"fault is {fault}, allowed: {', '.join(map(str, allowed))}")
    finite("at_time of the fault [s]", at_time)

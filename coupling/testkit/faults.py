"""Faults on purpose: of participants, FMUs and observers; import them from `coupling.testkit`.

The faults of a run: a plan of what fails when, which tells the run's log of each as it comes.
"""

from __future__ import annotations

import os
import signal
import time as wall_clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import partial

import numpy as np

from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.master.observer_dispatch import Observer
from coupling.master.participant import Causality, Participant, Status, StepResult
from oilsim.backend.arrays import Array
from oilsim.fluid.checks import finite
from recordings.files.writing import RecordingError
from recordings.model.frame import Frame

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


class FaultyObserver(Observer):
    """An observer, such as a viewer, that raises RecordingError (EXCEPTION) or stalls for STALL (HANG).

    It does so once, at the first frame at or after `at_time` [s]. Raises TypeError and ValueError for another fault or time.
    """

    def __init__(self, fault: Fault, *, at_time: float) -> None:
        require_fault(fault, at_time, OBSERVERS_FAULTS)
        self.fault, self.at_time, self._has_failed = fault, at_time, False

    def step_completed(self, frame: Frame) -> None:
        """Fail once, when it is time."""
        if self._has_failed or frame.time < self.at_time - 1e-9:
            return
        self._has_failed = True
        if self.fault is Fault.EXCEPTION:
            raise RecordingError("of the viewer", f"exception injected at {self.at_time:g} s")
        wall_clock.sleep(STALL)


def require_fault(fault: Fault, at_time: float, allowed: Sequence[Fault]) -> None:
    """Refuse what is no fault (TypeError), or is not allowed here, or a time [s] that is not finite (ValueError)."""
    if not isinstance(fault, Fault):
        raise TypeError(f"fault is {fault!r}, allowed: {', '.join(map(str, allowed))}")
    if fault not in allowed:
        raise ValueError(f"fault is {fault}, allowed: {', '.join(map(str, allowed))}")
    finite("at_time of the fault [s]", at_time)


ON_PURPOSE = "fault on purpose"  # how the text of a planned fault's event begins


class FaultClock(Participant):
    """A participant that tells the run's log of every fault in the step that contains it, and lets lines part.

    name: "faults". words: the text of each fault's event, with its time [s]. partings: calls that let a line or a joint part, by time [s].
    """

    STATE = ()

    def __init__(
        self, words: Sequence[tuple[float, str]], partings: Sequence[tuple[float, Callable[[], None]]]
    ) -> None:
        super().__init__("faults")
        self._words, self._partings = sorted(words), partings

    def do_step(self, time: float, step_size: float) -> StepResult:
        """Let lines part when it is time, and say what fails in this step."""
        end = time + step_size
        for at_time, part in self._partings:
            if time <= at_time < end:
                part()
        told = "; ".join(words for at_time, words in self._words if time <= at_time < end)
        return StepResult(Status.OK, end, told, event_handling_needed=bool(told), level="warning")

    def save_state(self) -> object:
        """Return nothing, which is all that is needed; NotImplementedError where a line parts, since it cannot be mended."""
        if self._partings:
            raise NotImplementedError("a line that parts on purpose cannot be mended")
        return None

    def restore_state(self, state: object) -> None:
        """Go back to any state; NotImplementedError as `save_state` does."""
        self.save_state()


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
        require_fault(fault, at_time, tuple(Fault))
        self._of_participants.setdefault(name, []).append((fault, at_time))

    def line(self, name: str, *, at_time: float) -> None:
        """Let a line or a joint part at `at_time` [s]; ValueError for a time that is not finite."""
        finite("at_time of the parting line [s]", at_time)
        self._of_lines[name] = at_time

    def observer(self, fault: Fault, *, at_time: float) -> None:
        """Add a viewer that raises or stalls at `at_time` [s]; errors are those of `FaultyObserver`."""
        self._of_observers.append(FaultyObserver(fault, at_time=at_time))

    def __bool__(self) -> bool:
        """Tell whether anything is to fail."""
        return bool(self._of_participants or self._of_lines or self._of_observers)

    @property
    def why_not_kept(self) -> str:
        """Reason why a run with these faults cannot be saved; empty if it can."""
        return f"line {min(self._of_lines)!r} parts on purpose, which cannot be undone" if self._of_lines else ""

    def words(self) -> list[tuple[float, str]]:
        """Return time [s] and text of the event by which each fault is told."""
        told = [
            (at, f"{name!r}: {fault.value}") for name, all_of in self._of_participants.items() for fault, at in all_of
        ]
        told += [(at, f"line {name!r} parts") for name, at in self._of_lines.items()]
        told += [(one.at_time, f"a viewer: {one.fault.value}") for one in self._of_observers]
        return sorted((at, f"{ON_PURPOSE}: {text}") for at, text in told)

    def applied(self, participant: Participant) -> Participant:
        """Return what takes part in the participant's place."""
        for fault, at_time in self._of_participants.get(participant.name, ()):
            participant = FaultyParticipant(participant, fault, at_time=at_time)
        return participant

    def observers(self, observers: Sequence[Observer]) -> list[Observer]:
        """Return the observers of the run, those that fail last."""
        return [*observers, *self._of_observers]

    def clock(self, world: RigidBodyWorld | None) -> list[FaultClock]:
        """Return the participant that tells of the faults and lets lines part, which steps first; none without faults.

        Raises ValueError for an unknown line, or a line in a run without bodies.
        """
        if not self:
            return []
        known = () if world is None else (*world.lines.names, *world.joint_names)
        strange = sorted(set(self._of_lines) - set(known))
        if strange:
            raise ValueError(
                f"line {strange[0]!r} that is to part does not exist, allowed: {', '.join(known) or 'none'}"
            )
        partings = [] if world is None else [(at, partial(_part, world, line)) for line, at in self._of_lines.items()]
        return [FaultClock(self.words(), partings)]

    def require_met(self, names: Sequence[str]) -> None:
        """Refuse faults of participants that the run does not have; ValueError."""
        strange = sorted(set(self._of_participants) - set(names))
        if strange:
            raise ValueError(f"fault of {strange[0]!r}, which does not take part, allowed: {', '.join(names)}")


def _part(world: RigidBodyWorld, line: str) -> None:
    """Let a line or a joint part, unless it has parted before."""
    if line in world.lines.names:
        world.part_line(line)
    elif line in world.joint_names:
        world.part_joint(line)

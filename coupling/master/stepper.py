"""One participant as the master steps it: sub-rate, early returns, discarded steps, events, and outputs that are read once.

Rules, after FMI 3:

early return  the participant is called again from where it stopped, with its present inputs
discard       its state is as before; it is asked for half the step, then half of that, down to 2^-HALVINGS of it
event         discrete states are updated until they do not change, and observers are informed
terminate     its progress counts, and it is not stepped again; the run ends once the others have made the step
error         `CoSimulationError` with the participant's name and the time; the same for times that do not fit

Outputs are read once after every step, checked to be finite, and handed on from here. An output that is a mean over the step
(`Variable.is_mean`) is the mean over all parts of the step, weighted by their durations.

The rollback test: step, restore, step again, and compare bit by bit, before a run relies on rollback.

The outputs after both steps, and every number and array in the two saved states, are compared. Opaque bytes are not, because they may
contain addresses. A participant that cannot save or restore its state is found before it has made a step. If the repeated step differs,
the participant has moved by something that its restore leaves out. No call of the interface can bring it back to the beginning then, and
the run ends.
"""

from __future__ import annotations

import time as wall_clock
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import NoReturn

import numpy as np

from coupling.master.connection import Connection
from coupling.master.errors import CoSimulationError, reason
from coupling.master.participant import Causality, Participant, Status, StepResult
from oilsim.backend.arrays import Array
from recordings.model.frame import Event

TIME_TOLERANCE = 1e-9  # of a step: far above rounding, far below anything that moves
HALVINGS = 10  # of a step that is discarded: a thousandth of it
PARTS_ALLOWED = 5000  # of one step, so that a participant that never advances is found
NUMBERS = "fiub"  # numpy's kinds of real numbers
EVENT_ROUNDS = 100  # at one time, so that states that never settle are found


class Discarded(Exception):
    """A step that a participant could not make, for a master that rolls all participants back and asks for a shorter step."""

    def __init__(self, participant: str, message: str) -> None:
        self.participant = participant
        self.message = message
        super().__init__(f"participant {participant!r} discarded a step: {message or 'no reason given'}")


class NotExchanged(Exception):
    """A value or state that a participant did not accept or give."""

    def __init__(self, participant: str, message: str) -> None:
        self.participant = participant
        self.message = message
        super().__init__(f"participant {participant!r}: {message}")


@dataclass(frozen=True)
class Snapshot:
    """A state that a participant can go back to, with its outputs, its wish to end, and events that nobody has been told of."""

    state: object
    outputs: dict[str, Array]
    wants_end: str | None = None
    events: tuple[Event, ...] = ()


class Stepper:
    """The driver of `participant`, which makes `sub_rate` equal steps for each of the master's.

    Inputs and outputs are arrays of the variables' shapes (N, ...) in their units [-].
    """

    def __init__(self, participant: Participant, sub_rate: int = 1) -> None:
        self.participant = participant
        self.sub_rate = sub_rate
        self.outputs: dict[str, Array] = {}
        self.inputs: dict[str, Array] = {}  # as they were set last
        self.wall_seconds = 0.0
        self.wants_end: str | None = None  # why, once the participant has asked for the run's end
        self.events: list[Event] = []  # those since the master took them
        self.passes_discards_on = False  # to the master, which rolls back everybody's step
        self._given = [v for v in participant.variables.values() if v.causality is Causality.OUTPUT]
        self._shapes = {variable.name: variable.shape for variable in self._given}
        self._means = [v for v in self._given if v.is_mean]
        self._sums: dict[str, Array] = {}

    @property
    def name(self) -> str:
        """Name of the participant."""
        return self.participant.name

    def set(self, name: str, value: Array, source: Connection | None = None) -> None:
        """Set an input of the participant; NotExchanged if it does not accept it. The message names the `source`, if there is one."""
        self.inputs[name] = value
        try:
            self.participant.set(name, value)
        except Exception as cause:
            origin = f" from {source.source}:{source.source_variable}" if source is not None else ""
            message = f"the input {name!r} does not accept {value}{origin}: {reason(cause)}"
            raise NotExchanged(self.name, message) from cause

    def get(self, name: str) -> Array:
        """Return the present value of an output; NotExchanged if the participant does not give it, or not in its shape."""
        try:
            value = self.participant.get(name)
        except Exception as cause:
            raise NotExchanged(self.name, f"the output {name!r} cannot be read: {reason(cause)}") from cause
        if not isinstance(value, np.ndarray):
            allowed = f"an array of shape {self._shapes[name]}"
            raise NotExchanged(self.name, f"the output {name!r} is a {type(value).__name__}, allowed: {allowed}")
        if value.shape != self._shapes[name]:
            raise NotExchanged(self.name, f"the output {name!r} has shape {value.shape}, allowed: {self._shapes[name]}")
        if value.dtype.kind not in NUMBERS:
            raise NotExchanged(self.name, f"the output {name!r} is of type {value.dtype}, allowed: real numbers")
        return value

    def advance(self, begin: float, end: float) -> None:
        """Step from `begin` to `end` [s]; CoSimulationError if the participant fails, Discarded for the master to roll back.

        A participant that has asked for the end of the run stays where it is, and its outputs hold.
        """
        if self.wants_end is not None:
            return
        started = wall_clock.perf_counter()
        self._sums.clear()
        span = (end - begin) / self.sub_rate
        for index in range(self.sub_rate):
            last = end if index == self.sub_rate - 1 else begin + (index + 1) * span
            self._cover(begin + index * span, last)
            if self.wants_end is not None:
                break
        self._read()
        self.outputs |= {name: total / (end - begin) for name, total in self._sums.items()}
        self._require_finite(end)
        self.wall_seconds += wall_clock.perf_counter() - started

    def observe(self, time: float) -> None:
        """Read a participant anew that others move between steps; CoSimulationError if it cannot be."""
        try:
            is_changed = self.participant.observe()
        except Exception as cause:
            self.fail(time, reason(cause), cause)
        if is_changed:
            self.read_outputs(time)

    def read_outputs(self, time: float) -> None:
        """Read every output of the participant; CoSimulationError for one that is not finite."""
        self._read()
        self._require_finite(time)

    def _read(self) -> None:
        self.outputs = {variable.name: self.get(variable.name) for variable in self._given}

    def _require_finite(self, time: float) -> None:
        if all_finite(self.outputs.values()):
            return
        for name, value in self.outputs.items():
            if not np.isfinite(value).all():
                self.fail(time, f"the output {name!r} is {value}, allowed: finite numbers")

    def save(self) -> Snapshot:
        """Return the participant's state with its outputs; NotExchanged if it cannot be saved."""
        try:
            state = self.participant.save_state()
        except NotImplementedError as cause:
            raise NotExchanged(self.name, str(cause) or "it cannot save its state") from cause
        except Exception as cause:
            raise NotExchanged(self.name, f"its state cannot be saved: {reason(cause)}") from cause
        return Snapshot(state, dict(self.outputs), self.wants_end, tuple(self.events))

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a state that `save` returned; NotExchanged if the participant does not accept it."""
        try:
            self.participant.restore_state(snapshot.state)
        except Exception as cause:
            raise NotExchanged(self.name, f"its state cannot be restored: {reason(cause)}") from cause
        self.outputs = dict(snapshot.outputs)
        self.events = list(snapshot.events)
        self.wants_end = snapshot.wants_end

    def fail(self, time: float, message: str, cause: BaseException | None = None) -> NoReturn:
        """Raise CoSimulationError under the participant's name."""
        raise CoSimulationError(self.name, time, message) from cause

    def _cover(self, begin: float, end: float) -> None:
        """Make one step, in as many parts as the participant needs."""
        tolerance, reached, span, halvings = TIME_TOLERANCE * (end - begin), begin, end - begin, 0
        for _ in range(PARTS_ALLOWED):
            part = min(span, end - reached)
            result = self._call(reached, part)
            if result.status is Status.DISCARD:
                halvings += 1
                self._refuse_discard(reached, part, halvings, result)
                span = 0.5 * part
                continue
            self._check(result, begin, reached, reached + part, tolerance)
            duration, reached = result.last_successful_time - reached, result.last_successful_time
            if self.sub_rate > 1 or duration < end - begin - tolerance:
                self._add_means(duration)
            self._note(result)
            if reached >= end - tolerance or result.terminate_simulation:
                return
        self.fail(begin, f"stopped at {reached} s, allowed: {end} s")

    def _call(self, time: float, step_size: float) -> StepResult:
        try:
            result = self.participant.do_step(time, step_size)
        except Exception as cause:
            self.fail(time, reason(cause), cause)
        if not isinstance(result, StepResult):
            self.fail(time, f"do_step returned {result!r}, allowed: a StepResult")
        if not isinstance(result.last_successful_time, Real):
            self.fail(time, f"last_successful_time is {result.last_successful_time!r}, allowed: a number of seconds")
        return result

    def _refuse_discard(self, time: float, part: float, halvings: int, result: StepResult) -> None:
        """Raise an error if the step should not be tried again here."""
        if self.passes_discards_on:
            raise Discarded(self.name, result.message)
        if halvings > HALVINGS:
            reason = result.message or "no reason given"
            self.fail(time, f"discard: {reason}, down to a step of {part:.3g} s")

    def _check(self, result: StepResult, begin: float, reached: float, asked: float, tolerance: float) -> None:
        """Raise an error for a failed step, and for a time that does not fit."""
        now = result.last_successful_time
        if result.status is Status.ERROR:
            self.fail(begin, f"error: {result.message or 'no reason given'}", result.cause)
        if not reached - tolerance <= now <= asked + tolerance:
            self.fail(begin, f"reached {now} s, allowed: {reached} to {asked} s")
        if result.status is Status.OK and now < asked - tolerance:
            self.fail(begin, f"stopped at {now} s without an early return, allowed: {asked} s")

    def _add_means(self, duration: float) -> None:
        """Add a part of a step to the means over all of it."""
        for variable in self._means:
            part = duration * self.get(variable.name)
            self._sums[variable.name] = self._sums.get(variable.name, 0.0) + part

    def _note(self, result: StepResult) -> None:
        """Handle events and a request to end."""
        if result.event_handling_needed:
            self._settle_events(result)
        if result.terminate_simulation:
            self.wants_end = result.message or "it has come to its end"

    def _settle_events(self, result: StepResult) -> None:
        time = result.last_successful_time
        for _ in range(EVENT_ROUNDS):
            try:
                again = self.participant.update_discrete_states()
            except Exception as cause:
                self.fail(time, reason(cause), cause)
            if not again:
                self.events.append(Event(time, result.message or "event", result.level, self.name))
                return
        self.fail(time, f"its discrete states still change after {EVENT_ROUNDS} rounds")


def all_finite(values: Iterable[Array]) -> bool:
    """Tell whether all numbers are finite; all arrays (N, ...) [-] in one call, since a call for each takes a good part of a small step."""
    flat = [value.ravel() for value in values]
    return not flat or bool(np.isfinite(np.concatenate(flat)).all())


def rollback_fault(stepper: Stepper, begin: float, end: float) -> str:
    """Give the reason why a participant cannot be rolled back from `end` to `begin` [s]; empty if it can. It is at `begin` afterwards.

    Raises CoSimulationError for a participant that was stepped and does not come back.
    """
    try:
        start = stepper.save()
        stepper.restore(start)
    except NotExchanged as refusal:
        return refusal.message
    results = []
    for _ in range(2):
        stepper.advance(begin, end)
        results.append(stepper.save())
        stepper.restore(start)
    difference = _difference(*results)
    if difference:
        allowed = "equality bit for bit, or NotImplementedError from save_state"
        stepper.fail(begin, f"restore_state leaves something out: {difference}, allowed: {allowed}")
    return ""


def _difference(first: Snapshot, second: Snapshot) -> str:
    """Describe the difference between two ends of one step; empty if there is none."""
    for name, value in first.outputs.items():
        if not _same(value, second.outputs[name]):
            largest = float(np.abs(value - second.outputs[name]).max())
            return f"the output {name!r} of a repeated step differs by up to {largest:.3g}"
    if not _same(first.state, second.state):
        return "the saved states after a step and after its repetition differ"
    return ""


def _same(first: object, second: object) -> bool:
    """Tell whether two saved values are equal bit for bit, as far as their contents are visible."""
    if isinstance(first, np.ndarray | np.generic) and isinstance(second, np.ndarray | np.generic):
        return first.shape == second.shape and first.dtype == second.dtype and first.tobytes() == second.tobytes()
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        return first.keys() == second.keys() and all(_same(first[key], second[key]) for key in first)
    if isinstance(first, list | tuple) and isinstance(second, list | tuple):
        return len(first) == len(second) and all(map(_same, first, second))
    if isinstance(first, float | int | complex | str) and isinstance(second, float | int | complex | str):
        return repr(first) == repr(second)
    return type(first) is type(second)

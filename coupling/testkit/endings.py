"""Checks of a run that fails or goes on after a fault: who is named, when, and that all are told."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from coupling.master.co_simulation import CoSimulation
from coupling.master.errors import CoSimulationError
from coupling.testkit.fault_plan import ON_PURPOSE
from coupling.testkit.history import History
from coupling.testkit.verdict import require_near


class Ending(Protocol):
    """A run that has a simulation and a history: a scene, a scenario run."""

    @property
    def simulation(self) -> CoSimulation:
        """The coupled run."""

    @property
    def history(self) -> History:
        """The history of the run."""


@contextmanager
def fails_in_order(run: Ending, *, participant: str, at: float | None = None, match: str = "") -> Iterator[None]:
    """Require that the block's steps end the run in order: by a CoSimulationError that names the participant and the time.

    at [s]: communication point at which the failing step began, to half a step; None: any. match: regular expression for the message.
    Afterwards the run must not go on, and the history must have been told the reason. Raises AssertionError for anything else.
    """
    simulation = run.simulation
    try:
        yield
    except CoSimulationError as error:
        failure = error
    else:
        raise _went_on(simulation, repr(participant))
    if failure.participant != participant:
        raise AssertionError(f"{failure.participant!r} is named ({failure}), expected: {participant!r}") from failure
    if at is not None:
        half = 0.5 * simulation.communication_point.step_size
        require_near(f"time at which {participant!r} fails", failure.time, at, half, "s")
    _require_end(run, failure, str(failure), match)


@contextmanager
def viewer_fails_in_order(run: Ending, *, match: str = "") -> Iterator[None]:
    """Require that an observer that raises in the block's steps ends the run in order: participants end, and other observers are told.

    match: regular expression for the observer's error, which the block raises as it is. Raises AssertionError for anything else.
    """
    simulation = run.simulation
    try:
        yield
    except CoSimulationError as error:
        raise AssertionError(f"{error.participant!r} is named ({error}), expected: an observer fails") from error
    except Exception as error:
        failure = error
    else:
        raise _went_on(simulation, "a viewer")
    _require_end(run, failure, f"failed: {failure}", match)


@contextmanager
def goes_on_in_order(run: Ending, *, match: str = "") -> Iterator[None]:
    """Require that the run goes on through the block, although something fails in it, and that its log tells of that.

    match: regular expression for the text of the event, "fault on purpose" for any planned fault. Raises AssertionError for a run that
    ends, and where nothing is told.
    """
    simulation, before = run.simulation, len(run.history.events)
    try:
        yield
    except Exception as error:
        raise AssertionError(f"the run failed: {error}, expected: it goes on") from error
    if not simulation.is_running:
        raise AssertionError(f"the run has ended: {run.history.ended!r}, expected: it goes on")
    told = [event.text for event in run.history.events[before:]]
    if not any(re.search(match or ON_PURPOSE, text) for text in told):
        raise AssertionError(f"the log tells of {told}, expected: {match or ON_PURPOSE!r}")


def _went_on(simulation: CoSimulation, who: str) -> AssertionError:
    return AssertionError(f"the run went on to {simulation.communication_point.time:g} s, expected: {who} ends it")


def _require_end(run: Ending, failure: Exception, reason: str, match: str) -> None:
    """Require that the failure says `match`, that the run has ended, and that the history was told the reason."""
    if not re.search(match, str(failure)):
        raise AssertionError(f"the failure says {str(failure)!r}, expected: {match!r}") from failure
    if run.simulation.is_running:
        raise AssertionError(f"the run goes on after {str(failure)!r}, expected: its end") from failure
    if reason not in run.history.ended:
        raise AssertionError(f"observers were told {run.history.ended!r} at the end, expected: {reason!r}") from failure

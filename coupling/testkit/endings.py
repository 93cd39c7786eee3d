"""Checks of a run's end after a failure: who is named, when, and that all are told."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from coupling.errors import CoSimulationError
from coupling.master.co_simulation import CoSimulation
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
        raise AssertionError(
            f"the run went on to {simulation.communication_point.time:g} s, expected: {participant!r} ends it"
        )
    if failure.participant != participant:
        raise AssertionError(f"{failure.participant!r} is named ({failure}), expected: {participant!r}") from failure
    if at is not None:
        half = 0.5 * simulation.communication_point.step_size
        require_near(f"time at which {participant!r} fails", failure.time, at, half, "s")
    if not re.search(match, str(failure)):
        raise AssertionError(f"the failure says {str(failure)!r}, expected: {match!r}") from failure
    if simulation.is_running:
        raise AssertionError(f"the run of {participant!r} goes on after its failure, expected: its end") from failure
    if str(failure) not in run.history.ended:
        raise AssertionError(
            f"observers were told {run.history.ended!r} at the end, expected: {str(failure)!r}"
        ) from failure

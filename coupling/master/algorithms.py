"""The order in which participants step and exchange values within one communication step.

A plain algorithm exchanges values once per step. With u_i the inputs and y_i the outputs of participant i at
communication point k, and c the connections:

    Jacobi        u(k) = c(y(k)) for all, then every participant steps: order does not matter
    Gauss-Seidel  participant i sees y(k+1) of those that stepped before it, y(k) of the others: order matters

`body_exchange.BodyExchange` is a third one, for bodies that do not tell how they answer an impulse.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

from coupling.master.connection import Link
from coupling.master.stepper import Stepper
from coupling.participant import Array

Steppers = Mapping[str, Stepper]  # by the participants' names, in the order in which they were given


class Algorithm(Protocol):
    """One communication step.

    1. `prepare` once, after initial values were exchanged, then `begin` with what a test has found.
    2. `step` for every communication step, or for its halves; `save` and `restore` between steps.
    """

    def prepare(self, steppers: Steppers, links: Sequence[Link]) -> Sequence[str]:
        """Returns names of participants whose steps it may repeat from a saved state; the master tests that they can."""

    def begin(self, faults: Mapping[str, str]) -> Sequence[str]:
        """`faults` tells, by name, why some of those cannot. Returns what observers are to be told.

        CoSimulationError for what cannot be coupled.
        """

    def step(self, steppers: Steppers, links: Sequence[Link], begin: float, end: float) -> None:
        """Transfer along every link and bring every participant from `begin` to `end` [s]."""

    def save(self) -> dict[str, dict[str, Array]]:
        """What it remembers from step to step."""

    def restore(self, state: Mapping[str, Mapping[str, Array]]) -> None:
        """Back to what `save` returned."""


class _Plain:
    """An algorithm that takes nothing back and remembers nothing."""

    def prepare(self, steppers: Steppers, links: Sequence[Link]) -> Sequence[str]:
        """See `Algorithm.prepare`."""
        return ()

    def begin(self, faults: Mapping[str, str]) -> Sequence[str]:
        """See `Algorithm.begin`."""
        return ()

    def save(self) -> dict[str, dict[str, Array]]:
        """See `Algorithm.save`."""
        return {}

    def restore(self, state: Mapping[str, Mapping[str, Array]]) -> None:
        """See `Algorithm.restore`."""


class GaussSeidel(_Plain):
    """Participants step in the given order, each fed with the newest outputs there are."""

    def step(self, steppers: Steppers, links: Sequence[Link], begin: float, end: float) -> None:
        """See `Algorithm.step`."""
        for name, stepper in steppers.items():
            transfer((link for link in links if link.connection.target == name), steppers)
            stepper.advance(begin, end)


class Jacobi(_Plain):
    """All inputs are taken at the communication point, then all participants step."""

    def step(self, steppers: Steppers, links: Sequence[Link], begin: float, end: float) -> None:
        """See `Algorithm.step`."""
        transfer(links, steppers)
        for stepper in steppers.values():
            stepper.advance(begin, end)


def transfer(links: Iterable[Link], steppers: Steppers) -> None:
    """Carry the value of every link from its output to its input."""
    for link in links:
        where = link.connection
        value = link.carried(steppers[where.source].outputs[where.source_variable])
        steppers[where.target].set(where.target_variable, value)

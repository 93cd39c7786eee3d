"""Algorithms: the order in which participants step and exchange values within one communication step.

A plain algorithm exchanges values once per step. With u_i the inputs and y_i the outputs of participant i at communication point k, and
c the connections:

    Jacobi        u(k) = c(y(k)) for all, then every participant steps: the order does not matter
    Gauss-Seidel  participant i gets y(k+1) of those that stepped before it, y(k) of the others: the order matters

`body_exchange.BodyExchange` is a third algorithm, for bodies that meet a fluid.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from coupling.master.connection import Link
from coupling.master.saved_fields import SavedFields
from coupling.master.stepper import Stepper

Steppers = Mapping[str, Stepper]  # by the participants' names, in the order in which they were given


class Algorithm(SavedFields):
    """The algorithm of one communication step; as it stands, it repeats no step and remembers nothing.

    1. `prepare` once, after initial values were exchanged, then `begin` with the results of the rollback test.
    2. `step` for every communication step, or for its halves; `save_state` and `restore_state` between steps.
    """

    def prepare(self, steppers: Steppers, links: Sequence[Link]) -> Sequence[str]:
        """Return the names of participants whose steps may be repeated from a saved state; the master tests whether they can."""
        return ()

    def begin(self, faults: Mapping[str, str]) -> Sequence[str]:
        """Begin the run; `faults` gives, by name, why some participants cannot be rolled back. Return messages for observers.

        Raises CoSimulationError for bodies that cannot be coupled.
        """
        return ()

    def step(self, steppers: Steppers, links: Sequence[Link], begin: float, end: float) -> None:
        """Transfer values along every link, and bring every participant from `begin` to `end` [s]."""
        raise NotImplementedError


class GaussSeidel(Algorithm):
    """Participants step in the given order, each with the newest outputs of the others."""

    def step(self, steppers: Steppers, links: Sequence[Link], begin: float, end: float) -> None:
        """Transfer to and step one participant after another; see `Algorithm.step`."""
        for name, stepper in steppers.items():
            transfer((link for link in links if link.connection.target == name), steppers)
            stepper.advance(begin, end)


class Jacobi(Algorithm):
    """All inputs are taken at the communication point, then all participants step."""

    def step(self, steppers: Steppers, links: Sequence[Link], begin: float, end: float) -> None:
        """Transfer to all participants, then step them; see `Algorithm.step`."""
        transfer(links, steppers)
        for stepper in steppers.values():
            stepper.advance(begin, end)


def transfer(links: Iterable[Link], steppers: Steppers) -> None:
    """Transfer the value of every link from its output to its input."""
    for link in links:
        where = link.connection
        value = link.carried(steppers[where.source].outputs[where.source_variable])
        steppers[where.target].set(where.target_variable, value, where)

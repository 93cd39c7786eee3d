"""Algorithms: the order in which participants step and exchange values within one communication step.

A plain algorithm exchanges values once per step. With u_i the inputs and y_i the outputs of participant i at communication point k, and
c the connections:

    Jacobi        u(k) = c(y(k)) for all, then every participant steps: the order does not matter
    Gauss-Seidel  participant i gets y(k+1) of those that stepped before it, y(k) of the others: the order matters

`body_exchange.BodyExchange` is a third algorithm, for bodies that meet a fluid.

Iterations for x = H(x) with an expensive H: a coupled step, or a round of initial values.

With the residual r_k = H(x_k) - x_k:

Aitken         x_{k+1} = x_k + w_k r_k,   w_{k+1} = -w_k r_k . (r_{k+1} - r_k) / |r_{k+1} - r_k|^2
Quasi-Newton   x_{k+1} = x_k + r_k + W c,  c = argmin |V c + r_k|; the columns of V are differences of residuals, those of W the
               corresponding differences of H(x)

Quasi-Newton (IQN-ILS: Degroote, Bathe and Vierendeels 2009) solves a linear problem of n unknowns in n + 2 calls, Aitken one with a
single unknown. `scale` weights entries of x of different units: it is the relevant size of each.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol

import numpy as np

from coupling.master.connection import Link
from coupling.master.saved_fields import SavedFields
from coupling.master.stepper import Stepper
from oilsim.backend.arrays import Array

LARGEST_RELAXATION = 1.0
NOISE = 1e-2  # relative to the largest singular value; below are columns with only the noise of solvers' tolerances


class Iteration(Protocol):
    """A way to choose the next x; created anew for every problem. Arrays (n,) have the units of x [-]."""

    def proposal(self, x: Array, residual: Array, scale: Array) -> Array:
        """Return the next x (n,) after `residual` (n,) at `x` (n,); scale (n,) is above 0; each in the units of x [-]."""


class Aitken:
    """Aitken's relaxation, whose factor [-] follows the last two residuals (n,); `relaxation` is the first factor."""

    def __init__(self, relaxation: float = 0.5) -> None:
        self._relaxation = relaxation
        self._last: Array | None = None

    def proposal(self, x: Array, residual: Array, scale: Array) -> Array:
        """Return the next x; see `Iteration.proposal`."""
        weighted = residual / scale
        if self._last is not None:
            change = weighted - self._last
            square = float(change @ change)
            if square > 0.0:
                factor = -self._relaxation * float(self._last @ change) / square
                self._relaxation = float(np.clip(factor, -LARGEST_RELAXATION, LARGEST_RELAXATION))
        self._last = weighted
        return np.asarray(x + self._relaxation * residual)


class QuasiNewton:
    """IQN-ILS from the differences of all calls so far, arrays (n,) [-]; `relaxation` is used until there are two calls.

    noise: singular values of those differences below this, relative to the largest, are ignored.
    """

    def __init__(self, relaxation: float = 0.5, noise: float = NOISE) -> None:
        self._relaxation, self._noise = relaxation, noise
        self._residuals: list[Array] = []
        self._results: list[Array] = []

    def proposal(self, x: Array, residual: Array, scale: Array) -> Array:
        """Return the next x; see `Iteration.proposal`."""
        self._residuals.append(residual)
        self._results.append(x + residual)
        if len(self._residuals) == 1:
            return np.asarray(x + self._relaxation * residual)
        columns = np.column_stack([earlier - residual for earlier in self._residuals[:-1]]) / scale[:, None]
        changes = np.column_stack([earlier - self._results[-1] for earlier in self._results[:-1]])
        weights, *_ = np.linalg.lstsq(columns, -residual / scale, rcond=self._noise)
        return np.asarray(self._results[-1] + changes @ weights)


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

"""Iterations for x = H(x), where a call of H is dear: a coupled step, or a round of initial values.

With the residual r_k = H(x_k) - x_k:

Aitken         x_{k+1} = x_k + w_k r_k,   w_{k+1} = -w_k r_k . (r_{k+1} - r_k) / |r_{k+1} - r_k|^2
Quasi-Newton   x_{k+1} = x_k + r_k + W c,  c = argmin |V c + r_k|, the columns of V being differences of residuals and those of W
               the differences of H(x) that go with them

The second (IQN-ILS: Degroote, Bathe and Vierendeels 2009) solves a linear problem of n unknowns in n + 2 calls, the first one with
a single unknown. Entries of x of different units are weighted by `scale`, the size that matters of each.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

LARGEST_RELAXATION = 1.0
NOISE = 1e-2  # of the largest singular value: what columns add below is noise of solvers that stop at a tolerance


class Iteration(Protocol):
    """One way to choose the next x; made anew for every problem."""

    def proposal(self, x: Array, residual: Array, scale: Array) -> Array:
        """The next x (n,) after `residual` (n,) at `x`; scale (n,) above 0."""


class Aitken:
    """Relaxation whose factor follows the last two residuals; `relaxation` is the first factor."""

    def __init__(self, relaxation: float = 0.5) -> None:
        self._relaxation = relaxation
        self._last: Array | None = None

    def proposal(self, x: Array, residual: Array, scale: Array) -> Array:
        """See `Iteration.proposal`."""
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
    """IQN-ILS from the differences of all calls so far; `relaxation` is used while there is only one.

    noise: of the largest singular value of those differences, below which they tell nothing.
    """

    def __init__(self, relaxation: float = 0.5, noise: float = NOISE) -> None:
        self._relaxation, self._noise = relaxation, noise
        self._residuals: list[Array] = []
        self._results: list[Array] = []

    def proposal(self, x: Array, residual: Array, scale: Array) -> Array:
        """See `Iteration.proposal`."""
        self._residuals.append(residual)
        self._results.append(x + residual)
        if len(self._residuals) == 1:
            return np.asarray(x + self._relaxation * residual)
        columns = np.column_stack([earlier - residual for earlier in self._residuals[:-1]]) / scale[:, None]
        changes = np.column_stack([earlier - self._results[-1] for earlier in self._results[:-1]])
        weights, *_ = np.linalg.lstsq(columns, -residual / scale, rcond=self._noise)
        return np.asarray(self._results[-1] + changes @ weights)

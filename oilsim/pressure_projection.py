"""Bound-constrained conjugate gradients for the pressure: kappa >= 0, A kappa - b >= 0, complementary.

MPRGP (modified proportioning with reduced gradient projections; Dostal & Schoeberl 2005) with diagonal scaling. A is symmetric
positive semi-definite. The scaled operator's largest eigenvalue was measured as 7.5 in three dimensions and 4.3 in two, so that in
liquid a gradient step of EXPANSION <= 2 / 7.5 never overshoots. A body far lighter than water ties all particles around it together and
makes it larger by orders: every step is cut to what reduces the error. Liquid that fills a closed box has no surface at which it
could part: its pressure has no bound there, and no level.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.parallel import BLOCK, Team, block_count, total
from oilsim.smoothing_kernels import FAST

Real = NDArray[np.float32]

EXPANSION = np.float32(0.26)
OVERSHOT = 0.5  # share of a gradient step that reduces the error, below which it is far too long
LEAST = 4  # products a solve, even if the tolerance is met before: what is left over piles up in water at rest


@njit(**FAST)
def split_gradient(begin, end, kappa, gradient, diagonal, closed, free, sums):
    """Split the gradient A kappa - b into its free and chopped parts, each over the diagonal.

    Fills `free` (gradient / diagonal where kappa > 0) and the block sums `sums` (blocks, 3): chopped^2, reduced free . free,
    and the residual |gradient| of both kinds, the rate by which density would still change [1/s].
    """
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            sums[i // BLOCK, 0] = sums[i // BLOCK, 1] = sums[i // BLOCK, 2] = 0.0
        g = gradient[i]
        scaled = g / diagonal[i]
        if closed:
            free[i] = scaled
            sums[i // BLOCK, 1] += scaled * g
            sums[i // BLOCK, 2] += abs(g)
        elif kappa[i] > np.float32(0.0):
            free[i] = scaled
            sums[i // BLOCK, 1] += min(kappa[i] / EXPANSION, scaled) * g
            sums[i // BLOCK, 2] += abs(g)
        else:
            free[i] = np.float32(0.0)
            if g < np.float32(0.0):
                sums[i // BLOCK, 0] += scaled * g
                sums[i // BLOCK, 2] -= g


@njit(**FAST)
def step_lengths(begin, end, kappa, gradient, direction, image, closed, sums):
    """Block sums (blocks, 3): gradient . direction, direction . A direction, and the longest feasible step."""
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            sums[i // BLOCK, 0] = sums[i // BLOCK, 1] = 0.0
            sums[i // BLOCK, 2] = np.inf
        p = direction[i]
        sums[i // BLOCK, 0] += gradient[i] * p
        sums[i // BLOCK, 1] += p * image[i]
        if p > np.float32(0.0) and not closed:
            sums[i // BLOCK, 2] = min(sums[i // BLOCK, 2], kappa[i] / p)


@njit(**FAST)
def advance(begin, end, kappa, gradient, direction, image, closed, step):
    """kappa -= step direction, gradient -= step A direction; kappa stays at or above 0."""
    for i in range(begin, end):
        value = kappa[i] - step * direction[i]
        kappa[i] = value if closed else max(value, np.float32(0.0))
        gradient[i] -= step * image[i]


@njit(**FAST)
def dot(begin, end, left, right, sums):
    """Block sums of left . right."""
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            sums[i // BLOCK] = 0.0
        sums[i // BLOCK] += left[i] * right[i]


class System(Protocol):
    """What is solved: A, and whatever else follows kappa."""

    def product(self, vector: Real, image: Real) -> None:
        """Write A vector into image."""

    def follow(self, length: float) -> None:
        """kappa has moved by -length times the vector of the last product."""


class BoundConstrainedSolver:
    """MPRGP on vectors of one size; keeps its work vectors over the steps.

    Each round takes one of three steps: along conjugate directions while particles under pressure dominate the error
    (proportional); to the bound and on by the projected gradient where such a step would make a pressure negative (expansion); or along
    the chopped gradient, which brings particles under pressure (proportioning).
    """

    def __init__(self, team: Team) -> None:
        self._team = team
        self._free, self._direction, self._image = np.empty((3, 0), np.float32)
        self._sums = np.empty((0, 3))

    def solve(
        self,
        system: System,
        gradient: Real,
        diagonal: Real,
        kappa: Real,
        tolerance: float,
        iterations: int,
        closed: bool,
        watched: NDArray[np.uint32] | None = None,
    ) -> tuple[int, float]:
        """Improve `kappa` in place until the mean residual is `tolerance` [1/s]; returns products used and that mean.

        kappa (N,) [m2/s], nowhere negative unless `closed`; gradient (N,) [1/s] is A kappa - b of it, and moves with it; diagonal (N,)
        [1/m2] is that of A. The mean over the `watched` particles, those that touch bodies, must meet the tolerance too: a small body
        would be lost in a large sea.
        """
        count = kappa.size
        if count == 0:
            return 0, 0.0
        if self._free.size != count:
            self._free, self._direction, self._image = np.empty((3, count), np.float32)
            self._sums = np.empty((block_count(count), 3))
        self._system, self._gradient, self._closed, self._stiff = system, gradient, closed, False
        if closed:
            _centre(gradient)
        used = 0
        chopped, reduced, residual = self._split(kappa, diagonal)
        self._direction[:] = self._free
        while used < iterations:
            near_bodies = _watched_residual(kappa, gradient, closed, watched)
            if (closed or used >= LEAST) and residual <= tolerance * count and near_bodies <= tolerance:
                break
            proportional = chopped <= reduced
            if not proportional:
                self._direction[:] = np.where((kappa > 0.0) | closed, 0.0, np.minimum(gradient, 0.0) / diagonal)
            self._multiply()
            used += 1
            step, feasible, curvature = self._step_lengths(kappa)
            if not curvature > 0.0:
                break
            if proportional and step > feasible:
                self._move(kappa, feasible)
                self._expand(kappa, diagonal, step - feasible)
                used += 1
                chopped, reduced, residual = self._split(kappa, diagonal)
                self._direction[:] = self._free
            else:
                self._move(kappa, step)
                chopped, reduced, residual = self._split(kappa, diagonal)
                self._conjugate(curvature if proportional else None)
        if closed:
            self._level(kappa)
        return used, residual / count

    def _multiply(self) -> None:
        """The image of the direction."""
        self._system.product(self._direction, self._image)
        if self._closed:
            _centre(self._image)

    def _move(self, kappa: Real, length: float) -> None:
        """kappa -= length direction, and all that hangs on it."""
        self._team.run(
            advance, kappa.size, kappa, self._gradient, self._direction, self._image, self._closed, np.float32(length)
        )
        self._system.follow(length)

    def _expand(self, kappa: Real, diagonal: Real, length: float) -> None:
        """A projected gradient step from the bound, no longer than reduces the error.

        Bodies far lighter than water make some directions so stiff that it overshoots. From then on it is the rest `length` of the
        conjugate direction, which knows them, bent along the bounds.
        """
        if self._stiff:
            self._direction[:] = kappa - np.maximum(kappa - np.float32(length) * self._direction, 0.0)
        else:
            self._split(kappa, diagonal)
            self._direction[:] = kappa - np.maximum(kappa - EXPANSION * self._free, 0.0)
        self._multiply()
        step, _, curvature = self._step_lengths(kappa)
        self._stiff = self._stiff or step < OVERSHOT
        self._move(kappa, max(min(step, 1.0), 0.0) if curvature > 0.0 else 0.0)

    def _level(self, kappa: Real) -> None:
        """Bring the mean of kappa, which nothing determines in a closed box, to 0."""
        self._direction[:] = kappa.mean(dtype=np.float64)
        self._multiply()
        self._move(kappa, 1.0)

    def _split(self, kappa: Real, diagonal: Real) -> tuple[float, float, float]:
        """See `split_gradient`; sums over all particles."""
        self._team.run(
            split_gradient, kappa.size, kappa, self._gradient, diagonal, self._closed, self._free, self._sums
        )
        chopped, reduced, residual = (float(value) for value in self._sums.sum(axis=0))
        return chopped, reduced, residual

    def _step_lengths(self, kappa: Real) -> tuple[float, float, float]:
        """Length of the minimising step, of the longest feasible one, and the curvature along the direction."""
        arguments = (kappa, self._gradient, self._direction, self._image, self._closed, self._sums)
        self._team.run(step_lengths, kappa.size, *arguments)
        along, curvature = (float(value) for value in self._sums[:, :2].sum(axis=0))
        return along / curvature if curvature > 0.0 else 0.0, float(self._sums[:, 2].min()), curvature

    def _conjugate(self, curvature: float | None) -> None:
        """The next direction: the free gradient, made conjugate to the last direction if `curvature` is given."""
        if curvature is None:
            self._direction[:] = self._free
            return
        partial = np.zeros(len(self._sums))
        self._team.run(dot, self._free.size, self._free, self._image, partial)
        self._direction *= np.float32(-total(partial) / curvature)
        self._direction += self._free


def _centre(values: Real) -> None:
    """Take the mean off."""
    values -= np.float32(values.mean(dtype=np.float64))


def _watched_residual(kappa: Real, gradient: Real, closed: bool, watched: NDArray[np.uint32] | None) -> float:
    """Mean residual [1/s] of some particles, as `split_gradient` counts it."""
    if watched is None or watched.size == 0:
        return 0.0
    chosen = gradient[watched]
    return float(
        np.where((kappa[watched] > 0.0) | closed, np.abs(chosen), np.maximum(-chosen, 0.0)).mean(dtype=np.float64)
    )

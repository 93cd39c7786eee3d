"""Bound-constrained conjugate gradients for the pressure: kappa >= 0, A kappa - b >= 0, complementary.

MPRGP (modified proportioning with reduced gradient projections; Dostal & Schoeberl 2005) with diagonal scaling. `product`
applies A to a vector; A is symmetric positive semi-definite. The scaled operator's largest eigenvalue was measured as 2.85,
so that a gradient step of EXPANSION <= 2 / 2.85 never overshoots.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.parallel import BLOCK, Team, block_count, total
from oilsim.smoothing_kernels import FAST

Real = NDArray[np.float32]

EXPANSION = np.float32(0.6)


@njit(**FAST)
def split_gradient(begin, end, kappa, gradient, diagonal, free, sums):
    """Split the gradient A kappa - b into its free and chopped parts, each over the diagonal.

    Fills `free` (gradient / diagonal where kappa > 0) and the block sums `sums` (blocks, 3): chopped^2, reduced free . free,
    and the residual |gradient| of both kinds, the rate by which density would still change [1/s].
    """
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            sums[i // BLOCK, 0] = sums[i // BLOCK, 1] = sums[i // BLOCK, 2] = 0.0
        g = gradient[i]
        scaled = g / diagonal[i]
        if kappa[i] > np.float32(0.0):
            free[i] = scaled
            sums[i // BLOCK, 1] += min(kappa[i] / EXPANSION, scaled) * g
            sums[i // BLOCK, 2] += abs(g)
        else:
            free[i] = np.float32(0.0)
            if g < np.float32(0.0):
                sums[i // BLOCK, 0] += scaled * g
                sums[i // BLOCK, 2] -= g


@njit(**FAST)
def step_lengths(begin, end, kappa, gradient, direction, image, sums):
    """Block sums (blocks, 3): gradient . direction, direction . A direction, and the longest feasible step."""
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            sums[i // BLOCK, 0] = sums[i // BLOCK, 1] = 0.0
            sums[i // BLOCK, 2] = np.inf
        p = direction[i]
        sums[i // BLOCK, 0] += gradient[i] * p
        sums[i // BLOCK, 1] += p * image[i]
        if p > np.float32(0.0):
            sums[i // BLOCK, 2] = min(sums[i // BLOCK, 2], kappa[i] / p)


@njit(**FAST)
def advance(begin, end, kappa, gradient, direction, image, step):
    """kappa -= step direction, gradient -= step A direction; kappa stays at or above 0."""
    for i in range(begin, end):
        kappa[i] = max(kappa[i] - step * direction[i], np.float32(0.0))
        gradient[i] -= step * image[i]


@njit(**FAST)
def dot(begin, end, left, right, sums):
    """Block sums of left . right."""
    for i in range(begin, end):
        if i % BLOCK == 0 or i == begin:
            sums[i // BLOCK] = 0.0
        sums[i // BLOCK] += left[i] * right[i]


class BoundConstrainedSolver:
    """MPRGP on vectors of one size; keeps its work vectors over the steps."""

    def __init__(self, team: Team) -> None:
        self._team = team
        self._vectors = np.empty((4, 0), np.float32)

    def solve(
        self,
        product: Callable[[Real, Real], None],
        source: Real,
        diagonal: Real,
        kappa: Real,
        tolerance: float,
        iterations: int,
        watched: NDArray[np.uint32] | None = None,
    ) -> tuple[int, float]:
        """Improve `kappa` in place until the mean residual is `tolerance` [1/s]; returns products used and that mean.

        product(vector, result) writes A vector into result. source (N,) is b [1/s], diagonal (N,) that of A. The mean over the
        `watched` particles, those that touch bodies, must meet the tolerance too: a small body would be lost in a large sea.
        """
        count = kappa.size
        if count == 0:
            return 0, 0.0
        if self._vectors.shape[1] != count:
            self._vectors = np.empty((4, count), np.float32)
        gradient, free, direction, image = self._vectors
        sums = np.zeros((block_count(count), 3))
        run = self._team.run
        product(kappa, gradient)
        gradient -= source
        used = 1
        run(split_gradient, count, kappa, gradient, diagonal, free, sums)
        direction[:] = free
        while True:
            chopped, reduced, residual = (float(s) for s in sums.sum(axis=0))
            settled = residual <= tolerance * count and _watched_residual(kappa, gradient, watched) <= tolerance
            if settled or used >= iterations:
                return used, residual / count
            proportional = chopped <= reduced
            if not proportional:
                np.minimum(gradient, 0.0, out=direction)
                direction[kappa > 0.0] = 0.0
                direction /= diagonal
            product(direction, image)
            used += 1
            run(step_lengths, count, kappa, gradient, direction, image, sums)
            along, curvature = float(sums[:, 0].sum()), float(sums[:, 1].sum())
            feasible = float(sums[:, 2].min())
            if not curvature > 0.0:
                return used, residual / count
            step = along / curvature
            if not proportional or step <= feasible:
                run(advance, count, kappa, gradient, direction, image, np.float32(step))
                run(split_gradient, count, kappa, gradient, diagonal, free, sums)
                if proportional:
                    partial = np.zeros(block_count(count))
                    run(dot, count, free, image, partial)
                    direction *= np.float32(-total(partial) / curvature)
                    direction += free
                else:
                    direction[:] = free
                continue
            run(advance, count, kappa, gradient, direction, image, np.float32(feasible))
            run(split_gradient, count, kappa, gradient, diagonal, free, sums)
            kappa -= EXPANSION * free
            np.maximum(kappa, 0.0, out=kappa)
            product(kappa, gradient)
            gradient -= source
            used += 1
            run(split_gradient, count, kappa, gradient, diagonal, free, sums)
            direction[:] = free


def _watched_residual(kappa: Real, gradient: Real, watched: NDArray[np.uint32] | None) -> float:
    """Mean residual [1/s] of some particles, as `split_gradient` counts it."""
    if watched is None or watched.size == 0:
        return 0.0
    chosen = gradient[watched]
    return float(np.where(kappa[watched] > 0.0, np.abs(chosen), np.maximum(-chosen, 0.0)).mean(dtype=np.float64))

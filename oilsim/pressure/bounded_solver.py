"""Bound-constrained conjugate residuals for the pressure: kappa >= 0, A kappa - b >= 0, complementary.

The face is the set of particles that are under pressure, or would be after one Jacobi step: kappa > g / diag A, g = A kappa - b. On it, and
as if there were no bound, conjugate residuals (Stiefel 1955; Saad 2003, 6.8), preconditioned by the diagonal and by what the system knows
besides (`coarse_grid`), bring down g, the rate of compression that is left, and what the tolerance is about. Pressures that have become
negative count as the compression that clamping them would add. Where that is too much they are set to 0, which takes one product more, and
the face is chosen anew: the primal-dual active set strategy of Hintermueller, Ito & Kunisch (2003), with a few steps in place of the exact
solution. A round ends when the clamping would undo a quarter of what is left to be gained, and after three digits: what the preconditioner
makes of g is carried on by recurrence, and drifts off.

A slick of oil with the water it touches, or what is beside a body, would be lost in the mean over a sea: such groups must meet the
tolerance for themselves. What one still needs when all together have enough is solved for on it alone, the pressure of all others as it is,
and a product of the whole tells them: a subdomain of the multiplicative Schwarz method (Smith, Bjorstad & Gropp 1996, 1.1). Its products
cost its share of the particles.

A body far lighter than water ties all particles around it together, and clamping some may then do more harm than the steps did good. A
round that leaves the error's energy greater than it found it is taken back, and a projected gradient step, cut to what reduces the error,
begins the next. Liquid that fills a closed box has no surface at which it could part: its pressure has no bound there, and no level. Under
suction particles draw together, under pressure they keep apart, so its mean is put AMBIENT standard deviations above 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import FAST
from oilsim.backend.simd import LANES, above_zero, below, load, only, positive, spread, store, summed
from oilsim.backend.thread_team import BLOCK, Team, block_count, total

Real = NDArray[np.float32]
Index = NDArray[np.uint32]

AMBIENT = 1.5  # standard deviations by which the mean of the pressure in a closed box lies above 0: all but a fifteenth is pressed
SPOILT = 0.25  # of the residual on the face, that clamping may undo before it is due: with 1 solves take up to a sixth more products
FAITHFUL = 1e-6  # of a round's first curvature, down to which M^-1 g is known by recurrence: the coarse grid's own solve is not linear
LEAST = 2  # products a solve, even if the tolerance is met before: what is left over piles up in water at rest
ZERO, ONE = np.float32(0.0), np.float32(1.0)


@njit(**FAST)
def choose_face(begin, end, kappa, gradient, mobility, closed, opening, face, scaled, sums):
    """Set `face` to 1 on the face, 0 elsewhere, and `scaled` to g / diag A on it; mobility 1 / diag A.

    Block sums `sums` (blocks, 3) [1/s]: the residual, with what clamping negative pressures would add to it.
    """
    for block in range(begin, end, BLOCK):
        last, residual = min(block + BLOCK, end), spread(ZERO)
        for k in range(block, last, LANES):
            present = below(last, k)
            pressure, excess = load(kappa, k, present), load(gradient, k, present)
            on = spread(ONE) if closed else only(above_zero(pressure), spread(ONE), ZERO)
            ease = load(mobility, k, present)
            residual += positive(-excess) + on * positive(excess)
            if not closed:
                residual += only(present, positive(-pressure) / ease, ZERO)
            if opening:
                on = only(above_zero(-excess), spread(ONE), on)
            store(face, k, present, on)
            store(scaled, k, present, on * excess * ease)
        sums[block // BLOCK, 0] = summed(residual)


@njit(**FAST)
def advance(begin, end, kappa, gradient, scaled, direction, image, answer, diagonal, closed, face, step, sums):
    """kappa -= step direction, gradient -= step image, scaled -= step answer.

    Block sums `sums` (blocks, 3) [1/s]: the residual on the face and off it, and what clamping negative pressures would add to it.
    """
    for block in range(begin, end, BLOCK):
        last = min(block + BLOCK, end)
        on_face = off_face = harm = spread(ZERO)
        for k in range(block, last, LANES):
            present = below(last, k)
            pressure = load(kappa, k, present) - step * load(direction, k, present)
            excess = load(gradient, k, present) - step * load(image, k, present)
            on = load(face, k, present)
            store(kappa, k, present, pressure)
            store(gradient, k, present, excess)
            store(scaled, k, present, load(scaled, k, present) - step * load(answer, k, present))
            on_face += on * (positive(excess) + positive(-excess))
            off_face += (ONE - on) * positive(-excess)
            harm += on * load(diagonal, k, present) * positive(-pressure)
        sums[block // BLOCK, 0], sums[block // BLOCK, 1] = summed(on_face), summed(off_face)
        sums[block // BLOCK, 2] = ZERO if closed else summed(harm)


@njit(**FAST)
def turn(begin, end, scaled, product, share, mobility, face, direction, image, answer):
    """The next direction, scaled + share direction, its image, and of the answer to that, M^-1 image, what 1 / diag A has of it."""
    for k in range(begin, end, LANES):
        present = below(end, k)
        store(direction, k, present, load(scaled, k, present) + share * load(direction, k, present))
        follows = load(product, k, present) + share * load(image, k, present)
        store(image, k, present, follows)
        store(answer, k, present, load(face, k, present) * load(mobility, k, present) * follows)


@njit(**FAST)
def dot(begin, end, left, right, sums):
    """Block sums (blocks,) of left . right."""
    for block in range(begin, end, BLOCK):
        last, product = min(block + BLOCK, end), spread(ZERO)
        for k in range(block, last, LANES):
            present = below(last, k)
            product += load(left, k, present) * load(right, k, present)
        sums[block // BLOCK] = summed(product)


@njit(**FAST)
def left_over(begin, end, group, kappa, gradient, diagonal, closed, face, sums):
    """Block sums (blocks,) [1/s] over a group (n,): the residual, and what clamping negative pressures would add to it."""
    for block in range(begin, end, BLOCK):
        left = 0.0
        for n in range(block, min(block + BLOCK, end)):
            i = group[n]
            left += abs(gradient[i]) if face[i] > ZERO else max(-gradient[i], ZERO)
            if not closed:
                left += diagonal[i] * max(-kappa[i], ZERO)
        sums[block // BLOCK] = left


class System:
    """What is solved: A, and whatever else follows kappa, nothing unless a system says more."""

    def product(self, vector: Real, image: Real) -> None:
        """Write A vector into image."""
        raise NotImplementedError

    def part(self, group: Index) -> System:
        """The rows and columns of A that belong to a group of particles."""
        raise NotImplementedError

    def centre(self, values: Real) -> None:
        """Take off what no pressure can mend."""

    def correct(self, residual: Real, face: Real, correction: Real) -> None:
        """Add to the correction what is known of A^-1 residual on the face besides the diagonal, symmetric and not negative."""

    def turn(self, share: float) -> None:
        """The way to follow becomes the vector of the last product, and `share` of the way so far."""

    def follow(self, length: float) -> None:
        """kappa has moved by -length times the way."""


class BoundConstrainedSolver:
    """Solves systems of one size; keeps its work vectors over the steps."""

    def __init__(self, team: Team) -> None:
        self._team = team
        self._room = self._size = -1
        self._inner: BoundConstrainedSolver | None = None  # for groups alone

    def _begin(
        self, system: System, gradient: Real, diagonal: Real, kappa: Real, tolerance: float, closed: bool, count: int
    ) -> None:
        self._system, self._closed = system, closed
        self._kappa, self._gradient, self._diagonal = kappa, gradient, diagonal
        self._mobility, self._limit = np.float32(1.0) / diagonal[:count], tolerance * count
        if (self._room, self._size) != (kappa.size, count):
            self._room, self._size = kappa.size, count
            vectors = np.zeros((8, kappa.size), np.float32)
            self._scaled, self._product, self._direction, self._image, self._answer = vectors[:5]
            self._first_kappa, self._first_gradient, self._face = vectors[5:]
            self._sums = np.zeros((block_count(count), 3))

    def solve(
        self,
        system: System,
        gradient: Real,
        diagonal: Real,
        kappa: Real,
        tolerance: float,
        iterations: int,
        closed: bool,
        watched: Sequence[Index] = (),
        count: int | None = None,
    ) -> tuple[int, float]:
        """Improve `kappa` in place until the mean residual is `tolerance` [1/s]; returns products used and that mean.

        kappa (N,) [m2/s], nowhere negative unless `closed`; gradient (N,) [1/s] is A kappa - b of it, and moves with it; diagonal (N,)
        [1/m2] is that of A. The mean over each of the `watched` groups must meet the tolerance too: a small body, or a slick of oil,
        would be lost in a large sea. Products among a group alone count by its share of the particles. `iterations` may be exceeded by
        a few. With a `count` that many of kappa are solved for, the first ones, and those behind stay as they are; gradient is 0
        there.
        """
        count = kappa.size if count is None else count
        if count == 0:
            return 0, 0.0
        self._begin(system, gradient, diagonal, kappa, tolerance, closed, count)
        system.centre(gradient)
        used, residual = self._solve_all(0 if closed else LEAST, iterations)
        while used < iterations:
            late = [group for group in watched if group.size and self._left(group) > tolerance]
            if not late:
                break
            for group in late:
                used += self._solve_group(group, tolerance, iterations - used)
            more, residual = self._solve_all(0, iterations - used)
            used += more
        if closed:
            self._level()
        else:
            np.maximum(kappa, 0.0, out=kappa)
        return used, residual / count

    def _level(self) -> None:
        """Bring the mean of kappa, which nothing determines in a filled box, to its level."""
        level = self._kappa.mean(dtype=np.float64) - AMBIENT * self._kappa.std(dtype=np.float64)
        self._become(self._kappa - np.float32(level))

    def _solve_all(self, least: int, most: int) -> tuple[int, float]:
        """Improve kappa until the residual is within the limit; returns products and the residual. Some of it may be left negative."""
        used, opening = 0, True
        self._begin_round()
        while True:
            residual, *_ = self._run(
                choose_face, self._kappa, self._gradient, self._mobility, self._closed, opening, self._face, self._scaled
            )  # fmt: skip
            if opening and (used >= most or (used >= least and residual <= self._limit)):
                return used, residual
            if not self._closed and self._kappa.min() < 0.0:  # left by a solve that had enough, but a group had not
                used += self._clamp()
                self._begin_round()
                continue
            more, left = self._descend(opening, max(least - used, 1), max(most - used, 1))
            used += more
            if self._closed:
                continue
            if left <= self._limit:
                return used, left
            clamped = self._clamp()
            used += clamped
            if self._worse():
                opening = not clamped or used >= most
                if opening:
                    used += self._take_back()
            else:
                opening = True
            if opening:
                self._begin_round()

    def _solve_group(self, group: Index, tolerance: float, iterations: int) -> int:
        """Solve for a group alone, and let the others know; returns products."""
        self._inner = self._inner or BoundConstrainedSolver(self._team)
        inner, goal, kappa = self._inner, self._kappa.copy(), self._kappa[group]
        inner._begin(
            self._system.part(group), self._gradient[group], self._diagonal[group], kappa, tolerance, self._closed, group.size
        )  # fmt: skip
        used, _ = inner._solve_all(0, iterations)
        goal[group] = kappa
        self._become(goal)
        return 1 + math.ceil(used * group.size / self._size)

    def _descend(self, opening: bool, least: int, most: int) -> tuple[int, float]:
        """Conjugate residuals on the face, bounds ignored; returns products, and the residual with the bounds that it leaves."""
        vectors = self._direction, self._image, self._answer
        self._direction[:], self._image[:] = 0.0, 0.0
        self._system.correct(self._gradient, self._face, self._scaled)
        share, first, before, left, used = 0.0, 0.0, 0.0, math.inf, 0
        while True:
            self._multiply(self._scaled)
            used += 1
            curvature = self._dot(self._scaled, self._product)
            if not curvature > FAITHFUL * first:
                return used, left
            first = first or curvature
            share = curvature / before if used > 1 else 0.0
            self._team.run(
                turn, self._size, self._scaled, self._product, np.float32(share), self._mobility, self._face, *vectors
            )
            self._system.correct(self._image, self._face, self._answer)
            self._system.turn(share)
            square = self._dot(self._image, self._answer)
            if not square > 0.0:  # by underflow
                return used, left
            step, before = curvature / square, curvature
            on_face, off_face, harm = self._run(
                advance, self._kappa, self._gradient, self._scaled, *vectors, self._diagonal, self._closed, self._face,
                np.float32(step),
            )  # fmt: skip
            self._system.follow(step)
            left = on_face + off_face + harm
            spoilt = harm > on_face if harm > 0.0 and not opening else off_face + harm > SPOILT * on_face
            if spoilt or used >= most or (used >= least and left <= self._limit):
                return used, left

    def _begin_round(self) -> None:
        """Note where a round begins."""
        self._first_kappa[:], self._first_gradient[:] = self._kappa, self._gradient

    def _clamp(self) -> int:
        """Set negative pressures to 0; returns products."""
        if self._kappa.min() >= 0.0:
            return 0
        self._become(np.maximum(self._kappa, 0.0))
        return 1

    def _worse(self) -> bool:
        """Whether the error's energy, x A x / 2 - b x, has grown since the round began."""
        np.subtract(self._kappa, self._first_kappa, out=self._direction)
        np.add(self._gradient, self._first_gradient, out=self._image)
        return self._dot(self._direction, self._image) > 0.0

    def _take_back(self) -> int:
        """Undo the round, and take a projected gradient step; returns products."""
        self._become(self._first_kappa)
        way, scaled = self._direction, np.zeros_like(self._scaled)
        np.divide(self._gradient[: self._size], self._diagonal[: self._size], out=scaled[: self._size])
        np.subtract(self._kappa, np.maximum(self._kappa - scaled, 0.0), out=way)
        self._multiply(way)
        slope, curvature = self._dot(way, self._gradient), self._dot(way, self._product)
        self._go(way, min(slope / curvature, 1.0) if curvature > 0.0 else 0.0)
        np.maximum(self._kappa, 0.0, out=self._kappa)
        return 2

    def _left(self, group: Index) -> float:
        """Mean residual of some particles, with what clamping negative pressures would add to it [1/s]."""
        sums = np.empty(block_count(group.size))
        pressures = self._kappa, self._gradient, self._diagonal
        self._team.run(left_over, group.size, group, *pressures, self._closed, self._face, sums)
        return total(sums) / group.size

    def _multiply(self, vector: Real) -> None:
        """The product of A and a vector."""
        self._system.product(vector, self._product)
        self._system.centre(self._product)

    def _become(self, kappa: Real) -> None:
        """Change kappa to this, by a product, and all that hangs on it."""
        np.subtract(self._kappa, kappa, out=self._direction)
        self._multiply(self._direction)
        self._go(self._direction, 1.0)
        self._kappa[:] = kappa

    def _go(self, vector: Real, length: float) -> None:
        """kappa -= length times the vector of the last product."""
        self._kappa -= np.float32(length) * vector
        self._gradient -= np.float32(length) * self._product
        self._system.turn(0.0)
        self._system.follow(length)

    def _dot(self, left: Real, right: Real) -> float:
        sums = self._sums[:, 0].copy()
        self._team.run(dot, self._size, left, right, sums)
        return total(sums)

    def _run(self, kernel: object, *arguments: object) -> tuple[float, float, float]:
        """Run a kernel that ends with block sums over all particles; returns the totals."""
        self._team.run(kernel, self._size, *arguments, self._sums)  # type: ignore[arg-type]
        return total(self._sums[:, 0]), total(self._sums[:, 1]), total(self._sums[:, 2])

"""Bound-constrained conjugate residuals for the pressure: kappa >= 0, A kappa - b >= 0, complementary.

The free set is the set of particles that are under pressure or would be after one Jacobi step: kappa > g / diag A, with g = A kappa - b,
the rate of compression that is left. On the free set, and as if there were no bound, the solver minimises g by conjugate residuals (Stiefel
1955; Saad 2003, 6.8). The preconditioner is the diagonal, and a term that the system may add (`coarse_grid`). The tolerance is for |g|.
Pressures that have become negative count as the compression that clamping them would add. Where that is too much the solver sets them to 0,
which takes one application of A more, and chooses the free set anew. This is the primal-dual active set strategy of Hintermueller, Ito and
Kunisch (2003), with a few steps in place of the exact solution. A round ends when clamping would undo a quarter of the residual in the free
set. It also ends after three digits, because the preconditioner's effect on g is carried on by recurrence and drifts off.

The mean over a sea hides a slick of oil with the water that it touches, or the particles beside a body. These groups must meet the
tolerance for themselves. When all particles together have enough, the solver works on a group that has not, with the pressure of all
others as it is, and tells the others by one application of the whole: a subdomain of the multiplicative Schwarz method (Smith, Bjorstad and
Gropp 1996, 1.1). Applications to a group cost its share of the particles.

A body far lighter than water ties all particles around it together, and clamping some may then do more harm than the steps did good. The
solver rolls back a round that leaves the energy of the error greater than it found it, and begins the next round with a projected gradient
step, cut to what reduces the error. Liquid that fills a closed box has no surface at which it could part: its pressure has no bound and no
level there. Particles draw together under suction and keep apart under pressure, so the mean lies AMBIENT standard deviations above 0, or
as high as tensions ask for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from oilsim.backend.arrays import Index, Real
from oilsim.backend.thread_team import Team, block_count, total
from oilsim.pressure.residual_steps import (
    Pressures,
    SearchDirection,
    advance,
    choose_free_set,
    dot,
    left_over,
    next_direction,
)

# [1] standard deviations by which the mean pressure of a closed box lies above 0; measured; all but a fifteenth of the particles is pressed
AMBIENT = 1.5
# [1] share of the residual in the free set that clamping may undo before a round ends; measured; with 1 solves take a sixth longer
SPOILT = 0.25
# [1] share of a round's first curvature at which a round ends; measured; further on recurrence drifts off: the coarse grid is not linear
FAITHFUL = 1e-6
# [1] applications of A in a solve at least; measured; residuals left at the tolerance add up in water at rest
LEAST = 2


class System:
    """The system of equations: A, its parts, its preconditioner, and the quantities that follow kappa.

    A system overrides the methods that it needs.
    """

    def apply(self, vector: Real, image: Real) -> None:
        """Write A vector [1/s] into image, both (N,); vector [m2/s]."""
        raise NotImplementedError

    def part(self, group: Index) -> System:
        """Return the rows and columns of A that belong to a group (K,) of particles."""
        raise NotImplementedError

    def centre(self, values: Real) -> None:
        """Take off the values (N,) [1/s] what no pressure can repair."""

    def correct(self, residual: Real, free: Real, correction: Real) -> None:
        """Add to `correction` (N,) [m2/s] the preconditioner's part beside the diagonal, symmetric and positive semi-definite.

        residual (N,) [1/s]; free (N,): 1 in the free set, 0 elsewhere.
        """

    def set_direction(self, beta: float) -> None:
        """Set the search direction to the vector of the last application plus `beta` times the last direction."""

    def take_step(self, length: float) -> None:
        """Move by -length along the search direction, as kappa has."""


class BoundConstrainedSolver:
    """Solves systems of one size; keeps its work vectors over the steps."""

    def __init__(self, team: Team) -> None:
        self._team = team
        self._room = self._size = -1
        self._inner: BoundConstrainedSolver | None = None  # for groups alone

    def _begin(self, system: System, pressures: Pressures, tolerance: float, closed: bool, count: int) -> None:
        self._system, self._closed, self._pressures = system, closed, pressures
        self._kappa, self._gradient, self._diagonal = kappa, _, diagonal = pressures
        self._mobility, self._limit = np.float32(1.0) / diagonal[:count], tolerance * count
        if (self._room, self._size) != (kappa.size, count):
            self._room, self._size = kappa.size, count
            vectors = np.zeros((8, kappa.size), np.float32)
            self._scaled, self._product = vectors[:2]
            self._search = SearchDirection(*vectors[2:5])
            self._first_kappa, self._first_gradient, self._free = vectors[5:]
            self._sums = np.zeros((block_count(count), 3))

    def solve(
        self,
        system: System,
        pressures: Pressures,
        tolerance: float,
        iterations: int,
        level: float | None,
        watched: Sequence[Index] = (),
        count: int | None = None,
    ) -> tuple[int, float]:
        """Refine kappa (N,) [m2/s] in place until the mean residual is `tolerance` [1/s]; return the applications of A and that mean [1/s].

        pressures      `Pressures`, (N,) each; kappa is nowhere negative where `level` is None, and gradient moves with it
        iterations     applications at most; a few more may be needed to end with a valid pressure
        level          least mean kappa [m2/s] of liquid that fills a box, whose pressure has no bound; None of other liquid
        watched        groups of particles whose own means must meet the tolerance too; applications to a group count by its share
        count          number of particles to solve for, the first ones, all by default; kappa of the others stays, their gradient is 0
        """
        kappa, gradient = pressures.kappa, pressures.gradient
        count = kappa.size if count is None else count
        if count == 0:
            return 0, 0.0
        closed = level is not None
        self._begin(system, pressures, tolerance, closed, count)
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
        if level is not None:
            self._lift_to(level)
        else:
            np.maximum(kappa, 0.0, out=kappa)
        return used, residual / count

    def _lift_to(self, level: float) -> None:
        """Bring the mean of kappa, which nothing determines in a filled box, to at least `level` [m2/s]."""
        mean = max(AMBIENT * self._kappa.std(dtype=np.float64), level)
        self._become(self._kappa + np.float32(mean - self._kappa.mean(dtype=np.float64)))

    def _solve_all(self, least: int, most: int) -> tuple[int, float]:
        """Refine kappa until the residual is within the limit; return applications and the residual.

        Kappa may be left negative in places.
        """
        used, opening = 0, True
        self._begin_round()
        while True:
            residual, *_ = self._run(
                choose_free_set, self._pressures, self._mobility, self._closed, opening, self._free, self._scaled
            )
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
                    used += self._roll_back()
            else:
                opening = True
            if opening:
                self._begin_round()

    def _solve_group(self, group: Index, tolerance: float, iterations: int) -> int:
        """Solve for a group alone, and let the others know; returns applications."""
        self._inner = self._inner or BoundConstrainedSolver(self._team)
        inner, goal, kappa = self._inner, self._kappa.copy(), self._kappa[group]
        pressures = Pressures(kappa, self._gradient[group], self._diagonal[group])
        inner._begin(self._system.part(group), pressures, tolerance, self._closed, group.size)
        used, _ = inner._solve_all(0, iterations)
        goal[group] = kappa
        self._become(goal)
        return 1 + math.ceil(used * group.size / self._size)

    def _descend(self, opening: bool, least: int, most: int) -> tuple[int, float]:
        """Run conjugate residuals in the free set, bounds ignored; return applications, and the residual with the bounds that it leaves."""
        search = self._search
        search.direction[:], search.image[:] = 0.0, 0.0
        self._system.correct(self._gradient, self._free, self._scaled)
        beta, first, before, left, used = 0.0, 0.0, 0.0, math.inf, 0
        while True:
            self._multiply(self._scaled)
            used += 1
            curvature = self._dot(self._scaled, self._product)
            if not curvature > FAITHFUL * first:
                return used, left
            first = first or curvature
            beta = curvature / before if used > 1 else 0.0
            self._team.run(
                next_direction,
                self._size,
                self._scaled,
                self._product,
                np.float32(beta),
                self._mobility,
                self._free,
                search,
            )
            self._system.correct(search.image, self._free, search.preconditioned)
            self._system.set_direction(beta)
            square = self._dot(search.image, search.preconditioned)
            if not square > 0.0:  # by underflow
                return used, left
            step, before = curvature / square, curvature
            on_free, off_free, harm = self._run(
                advance, self._pressures, self._scaled, search, self._closed, self._free, np.float32(step)
            )
            self._system.take_step(step)
            left = on_free + off_free + harm
            spoilt = harm > on_free if harm > 0.0 and not opening else off_free + harm > SPOILT * on_free
            if spoilt or used >= most or (used >= least and left <= self._limit):
                return used, left

    def _begin_round(self) -> None:
        """Note where a round begins."""
        self._first_kappa[:], self._first_gradient[:] = self._kappa, self._gradient

    def _clamp(self) -> int:
        """Set negative pressures to 0; returns applications."""
        if self._kappa.min() >= 0.0:
            return 0
        self._become(np.maximum(self._kappa, 0.0))
        return 1

    def _worse(self) -> bool:
        """Tell whether the energy of the error, x A x / 2 - b x, has grown since the round began."""
        direction, image, _ = self._search
        np.subtract(self._kappa, self._first_kappa, out=direction)
        np.add(self._gradient, self._first_gradient, out=image)
        return self._dot(direction, image) > 0.0

    def _roll_back(self) -> int:
        """Undo the round, and take a projected gradient step; return applications."""
        self._become(self._first_kappa)
        direction, scaled = self._search.direction, np.zeros_like(self._scaled)
        np.divide(self._gradient[: self._size], self._diagonal[: self._size], out=scaled[: self._size])
        np.subtract(self._kappa, np.maximum(self._kappa - scaled, 0.0), out=direction)
        self._multiply(direction)
        slope, curvature = self._dot(direction, self._gradient), self._dot(direction, self._product)
        self._go(direction, min(slope / curvature, 1.0) if curvature > 0.0 else 0.0)
        np.maximum(self._kappa, 0.0, out=self._kappa)
        return 2

    def _left(self, group: Index) -> float:
        """Return the mean residual [1/s] of a group, with what clamping negative pressures would add to it."""
        sums = np.empty(block_count(group.size))
        self._team.run(left_over, group.size, group, self._pressures, self._closed, self._free, sums)
        return total(sums) / group.size

    def _multiply(self, vector: Real) -> None:
        """Multiply A and a vector (N,)."""
        self._system.apply(vector, self._product)
        self._system.centre(self._product)

    def _become(self, kappa: Real) -> None:
        """Change kappa (N,) to this by one application, with everything that follows it."""
        direction = self._search.direction
        np.subtract(self._kappa, kappa, out=direction)
        self._multiply(direction)
        self._go(direction, 1.0)
        self._kappa[:] = kappa

    def _go(self, vector: Real, length: float) -> None:
        """Move kappa by -length times the vector of the last application."""
        self._kappa -= np.float32(length) * vector
        self._gradient -= np.float32(length) * self._product
        self._system.set_direction(0.0)
        self._system.take_step(length)

    def _dot(self, left: Real, right: Real) -> float:
        sums = self._sums[:, 0].copy()
        self._team.run(dot, self._size, left, right, sums)
        return total(sums)

    def _run(self, kernel: object, *arguments: object) -> tuple[float, float, float]:
        """Run a kernel that ends with block sums over all particles; returns the totals."""
        self._team.run(kernel, self._size, *arguments, self._sums)  # type: ignore[arg-type]
        return total(self._sums[:, 0]), total(self._sums[:, 1]), total(self._sums[:, 2])

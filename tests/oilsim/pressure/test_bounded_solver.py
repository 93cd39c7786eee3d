"""The bounded solve against the exact solution: in plain systems, and where a light body ties many particles together."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from oilsim.backend.thread_team import Team
from oilsim.pressure.bounded_solver import BoundConstrainedSolver, Pressures, System

COUNT = 200


class DenseSystem(System):
    """A as a matrix; `moved` is what has followed kappa."""

    def __init__(self, root):
        self.root = root
        self.moved = np.zeros(len(root))
        self._direction = np.zeros(len(root))

    def apply(self, vector, image):
        self._change = self.root @ vector
        image[:] = self.root.T @ self._change

    def part(self, group):
        return DenseSystem(self.root[:, group])

    def set_direction(self, beta):
        self._direction = self._change + beta * self._direction

    def take_step(self, length):
        self.moved += length * self._direction


def laplacian_root(stiffness):
    """H of a chain of particles, and one row more: a body that all particles push, of A's largest eigenvalue `stiffness` over it."""
    chain = np.eye(COUNT) - 0.95 * np.eye(COUNT, k=1)
    body = np.sqrt(stiffness / COUNT) * np.random.default_rng(2).uniform(0.5, 1.5, COUNT)
    return np.vstack([chain, body])


def warm_start():
    """A pressure that lies far off."""
    return np.random.default_rng(5).uniform(0.0, 1.0, COUNT).astype(np.float32)


def velocities(root):
    """What a pressure on half of the particles undoes, and noise, in which others want to part."""
    rng = np.random.default_rng(3)
    pressed = np.where(rng.random(COUNT) < 0.5, rng.uniform(0.5, 1.5, COUNT), 0.0)
    return root @ pressed + 0.1 * rng.normal(size=len(root))


@pytest.mark.parametrize("stiffness", [0.0, 3.0, 3e2, 3e4])
def test_solution_is_exact_however_light_the_body(stiffness):
    root = laplacian_root(stiffness)
    wanted = velocities(root)
    exact, _ = nnls(root, wanted)
    system, start = DenseSystem(root), warm_start()
    kappa = start.copy()
    gradient = (root.T @ (root @ start - wanted)).astype(np.float32)
    scale = float(np.abs(gradient).mean())
    diagonal = (root**2).sum(axis=0).astype(np.float32)
    used, residual = BoundConstrainedSolver(Team(1)).solve(
        system, Pressures(kappa, gradient, diagonal), 1e-6 * scale, 2000, None
    )
    assert used < 2000 and residual <= 1e-6 * scale
    assert 0.2 < (exact > 0.0).mean() < 0.99
    assert kappa.min() >= 0.0
    # the energy left over, of that at the start; quadratic in the residual, times the condition number
    at_start, left, least = (0.5 * np.square(root @ x - wanted).sum() for x in (start, kappa, exact))
    assert left - least < 1e-6 * at_start
    # what follows kappa is the effect of all that it moved by
    assert -system.moved == pytest.approx(root @ (kappa.astype(np.float64) - start), abs=1e-3)


@pytest.mark.parametrize("stiffness", [0.0, 3e4])
def test_wherever_the_solve_is_cut_off_the_error_is_smaller_than_before(stiffness):
    root = laplacian_root(stiffness)
    wanted = velocities(root)
    exact, _ = nnls(root, wanted)
    at_start, least = (0.5 * np.square(root @ x - wanted).sum() for x in (warm_start(), exact))
    errors = []
    for iterations in range(1, 80):
        system, kappa = DenseSystem(root), warm_start()
        gradient = (root.T @ (root @ kappa - wanted)).astype(np.float32)
        diagonal = (root**2).sum(axis=0).astype(np.float32)
        used, _ = BoundConstrainedSolver(Team(1)).solve(
            system, Pressures(kappa, gradient, diagonal), 0.0, iterations, None
        )
        assert kappa.min() >= 0.0 and used <= iterations + 3
        errors.append((0.5 * np.square(root @ kappa - wanted).sum() - least) / (at_start - least))
    assert max(errors) < 1.0
    assert errors[-1] < 0.01


@pytest.mark.parametrize("watched", [False, True])
def test_few_particles_are_not_lost_among_many_where_they_are_watched(watched):
    # all that there is to do lies with the first twenty
    root = laplacian_root(0.0)
    few = np.arange(20)
    wanted = np.where(np.arange(len(root)) < 20, velocities(root), 0.0)
    gradient = (-root.T @ wanted).astype(np.float32)
    diagonal = (root**2).sum(axis=0).astype(np.float32)
    tolerance = 0.05 * float(np.abs(gradient[few]).mean())
    kappa = np.zeros(COUNT, np.float32)
    groups = [few] if watched else []
    BoundConstrainedSolver(Team(1)).solve(
        DenseSystem(root), Pressures(kappa, gradient, diagonal), tolerance, 200, None, [np.array([], np.intp), *groups]
    )
    left = root.T @ (root @ kappa - wanted)
    among_few = np.where(kappa > 0.0, np.abs(left), np.maximum(-left, 0.0))[few].mean()
    assert (among_few <= 1.01 * tolerance) == watched


class CountedSystem(DenseSystem):
    """Counts the applications of the whole and those of its parts."""

    whole = parts = 0

    def apply(self, vector, image):
        super().apply(vector, image)
        self.whole += 1

    def part(self, group):
        return PartOfCounted(self, group)


class PartOfCounted(DenseSystem):
    def __init__(self, counted, group):
        super().__init__(counted.root[:, group])
        self.counted = counted

    def apply(self, vector, image):
        super().apply(vector, image)
        self.counted.parts += 1


@pytest.mark.parametrize("closed", [False, True])
def test_what_a_watched_group_needs_costs_the_others_one_application(closed):
    # a watched forty, of which many want to part, before 1500 that stay under pressure and have little to do
    few, count = np.arange(40), 1540
    root, whole = np.eye(count) - 0.9 * np.eye(count, k=1), []
    if closed:
        root -= root.mean(axis=1, keepdims=True)  # in a filled box nothing feels the pressure's mean
    for seed in range(20):
        rng = np.random.default_rng(seed)
        wanted = np.concatenate([rng.normal(0.2, 1.0, 40), 0.1 * rng.normal(1.0, 0.3, 1500)])
        gradient, diagonal = (-root.T @ wanted).astype(np.float32), (root**2).sum(axis=0).astype(np.float32)
        tolerance = 0.01 * float(np.abs(gradient[few]).mean())
        system, kappa = CountedSystem(root), np.zeros(count, np.float32)
        used, _ = BoundConstrainedSolver(Team(1)).solve(
            system, Pressures(kappa, gradient, diagonal), tolerance, 500, 0.0 if closed else None, [few]
        )
        left = root.T @ (root @ kappa - wanted)
        residual = np.abs(left) if closed else np.where(kappa > 0.0, np.abs(left), np.maximum(-left, 0.0))
        assert residual[few].mean() <= 1.01 * tolerance
        assert residual.mean() <= 1.01 * tolerance
        # those of the group count by its share
        assert system.whole <= used <= system.whole + 1 + np.ceil(system.parts * few.size / count)
        assert system.parts > 0
        whole.append(system.whole)
    assert np.mean(whole) < 13.0  # 24 where all go on until the group has enough


class CorrectedSystem(DenseSystem):
    """Knows A^-1 of what twenty particles have in common, to two digits, as a solve that stops early does: corrections are not linear."""

    def __init__(self, root):
        super().__init__(root)
        self.smooth = np.repeat(np.eye(COUNT // 20), 20, axis=0)
        self.inverse = np.linalg.inv(self.smooth.T @ root.T @ root @ self.smooth)

    def correct(self, residual, free, correction):
        exact = self.inverse @ (self.smooth.T @ (free * residual))
        unit = 10.0 ** (np.floor(np.log10(np.abs(exact) + 1e-300)) - 1.0)
        correction += (free * (self.smooth @ (np.round(exact / unit) * unit))).astype(np.float32)


def test_corrections_that_are_not_linear_do_not_stop_a_long_solve():
    # by recurrence alone a thousand products leave 9e-4 of the residual
    root = np.eye(COUNT) - 0.999 * np.eye(COUNT, k=1)
    wanted = root @ np.random.default_rng(1).uniform(0.5, 1.5, COUNT)
    kappa, diagonal = np.ones(COUNT, np.float32), (root**2).sum(axis=0).astype(np.float32)
    gradient = (root.T @ (root @ kappa - wanted)).astype(np.float32)
    tolerance = 1e-6 * float(np.abs(gradient).mean())
    used, residual = BoundConstrainedSolver(Team(1)).solve(
        CorrectedSystem(root), Pressures(kappa, gradient, diagonal), tolerance, 200, None
    )
    assert used < 100 and residual <= tolerance


@pytest.mark.parametrize("size", [1e-20, 1e-22, 5e-23, 1e-24])
def test_a_residual_whose_square_is_no_number_any_more_is_no_fault(size):
    root = laplacian_root(0.0)
    diagonal = (root**2).sum(axis=0).astype(np.float32)
    kappa, gradient = np.zeros(COUNT, np.float32), np.full(COUNT, -size, np.float32)
    used, residual = BoundConstrainedSolver(Team(1)).solve(
        DenseSystem(root), Pressures(kappa, gradient, diagonal), 0.0, 10, None
    )
    assert used <= 13 and 0.0 <= residual <= 1.1 * size and np.isfinite(kappa).all()

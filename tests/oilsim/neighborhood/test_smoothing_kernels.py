"""The kernel's lattice sums are 1, its integral nearly so, its slope is its derivative, and its moments are those of the lattice."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from oilsim.neighborhood.smoothing_kernels import (
    SUPPORT,
    kernel,
    kernel_slope_over_q,
    lattice_diagonal,
    lattice_moment,
    lattice_stiffness,
    normalisation,
    steepest_slope,
)


def lattice(dimension):
    """All lattice points (K, dimension) of spacing 1 within the support's cube, and their distances."""
    axis = np.arange(-3.0, 4.0)
    points = np.stack(np.meshgrid(*[axis] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    return points, np.linalg.norm(points, axis=1)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("spacing", [1.0, 0.03])
def test_lattice_sum_is_one(dimension, spacing):
    _, distance = lattice(dimension)
    total = kernel(distance / SUPPORT, normalisation(spacing, dimension)).sum() * spacing**dimension
    # computed in float64
    assert total == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("dimension", "shell", "exact"),
    [(2, lambda r: 2 * np.pi * r, np.pi / 7), (3, lambda r: 4 * np.pi * r**2, 2 * np.pi / 21)],
)
def test_kernel_integrates_nearly_to_one(dimension, shell, exact):
    # of (1 - q)^4 (1 + 4 q): pi / 7 over the plane, 2 pi / 21 over space
    q = np.linspace(0.0, 1.0, 4001)
    values = kernel(q, 1.0)
    # trapezoid rule: error of order 1 / 4000^2
    assert np.trapezoid(values * shell(q), q) == pytest.approx(exact, rel=1e-6)
    # the lattice sum is the integral up to the kernel's Fourier transform at 1 / d: 0.7 and 0.5 %
    assert normalisation(1.0, dimension) * exact * SUPPORT**dimension == pytest.approx(1.0, abs=0.008)


@pytest.mark.parametrize("q", np.array([0.0, 0.05, 0.3, 0.4999, 0.5001, 0.7, 0.95]))
def test_slope_matches_finite_differences(q):
    step = 1e-5
    difference = (kernel(q + step, 1.0) - kernel(abs(q - step), 1.0)) / (2 * step)
    # central differences: error step^2 / 6 times the third derivative 120 (1 - q) (1 - 2 q), at most 120
    assert kernel_slope_over_q(q, 1.0) * q == pytest.approx(difference, abs=4e-9)


def test_slope_over_q_is_finite_at_the_centre():
    # (dW/dq) / q -> W''(0) = -20
    assert kernel_slope_over_q(0.0, 1.0) == pytest.approx(-20.0)


def test_kernel_has_compact_support():
    beyond = np.array([1.0, 1.2, 1.5])
    assert not kernel(beyond, 1.0).any()
    assert not kernel_slope_over_q(beyond, 1.0).any()


def test_kernel_is_the_same_compiled():
    @njit
    def compiled(q):
        return kernel(q, np.float32(2.0)), kernel_slope_over_q(q, np.float32(2.0))

    for q in np.linspace(0.0, 1.5, 31, dtype=np.float32):
        assert compiled(q) == pytest.approx(
            (kernel(q, np.float32(2.0)), kernel_slope_over_q(q, np.float32(2.0))), rel=1e-6, abs=1e-12
        )


@pytest.mark.parametrize("dimension", [2, 3])
def test_moment_and_diagonal_of_the_lattice(dimension):
    points, distance = lattice(dimension)
    step = 1e-5
    sigma = normalisation(1.0, dimension)
    # grad W by central differences of the kernel itself: error of order step^2
    r = distance[distance > 0.0]
    slope = (kernel((r + step) / SUPPORT, sigma) - kernel((r - step) / SUPPORT, sigma)) / (2 * step)
    towards = points[distance > 0.0] / r[:, None]
    gradient = slope[:, None] * towards
    moment = -np.einsum("ij,ik->jk", points[distance > 0.0], gradient)
    assert moment == pytest.approx(lattice_moment(dimension) * np.eye(dimension), abs=1e-7)
    assert lattice_diagonal(dimension) == pytest.approx((gradient**2).sum(), rel=1e-6)
    # 2 % short of an exact gradient
    assert lattice_moment(dimension) == pytest.approx(1.0, abs=0.025)


@pytest.mark.parametrize("dimension", [2, 3])
def test_steepest_slope_is_the_steepest(dimension):
    spacing, q = 0.03, np.linspace(0.0, 1.0, 20001)
    slope = np.gradient(kernel(q, normalisation(spacing, dimension)), q * SUPPORT * spacing)
    assert steepest_slope(spacing, dimension) == pytest.approx(np.abs(slope).max(), rel=1e-6)


@pytest.mark.parametrize("dimension", [2, 3])
def test_stiffness_of_the_lattice_is_the_curvature_of_its_kernels(dimension):
    """Layers z = ..., 0, 1, ... that move against each other by 1 change the pair vectors of every second layer by twice that."""
    points, _ = lattice(dimension)
    points, step = points[np.abs(points[:, -1]) % 2.0 == 1.0], 1e-4
    sigma = normalisation(1.0, dimension)

    def density(shift):
        return kernel(np.linalg.norm(points + shift, axis=1) / SUPPORT, sigma).sum()

    # along a layer and across it, by central differences: error of order step^2
    curvature = [
        (density(step * e) - 2.0 * density(0.0 * e) + density(-step * e)) / step**2 for e in np.eye(dimension)[[0, -1]]
    ]
    # 2 p / (m rho) times the curvature times the distance 2 by which the layers part
    assert lattice_stiffness(dimension) == pytest.approx(4.0 / lattice_moment(dimension) * max(curvature), rel=1e-5)

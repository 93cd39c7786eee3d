"""The kernel integrates to 1, its slope is its derivative, and lattices of it sum to 1."""

from __future__ import annotations

import numpy as np
import pytest

from oilsim.smoothing_kernels import kernel, kernel_slope, normalisation


@pytest.mark.parametrize(("dimension", "shell"), [(2, lambda r: 2 * np.pi * r), (3, lambda r: 4 * np.pi * r**2)])
def test_kernel_integrates_to_one(dimension, shell):
    support = 0.06
    r = np.linspace(0.0, support, 4001)
    values = np.array([kernel(x / support, normalisation(support, dimension)) for x in r])
    # trapezoid rule: error of order (support / 4000)^2
    assert np.trapezoid(values * shell(r), r) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("q", [0.05, 0.3, 0.4999, 0.5001, 0.7, 0.95])
def test_slope_matches_finite_differences(q):
    step = 1e-5
    difference = (kernel(q + step, 1.0) - kernel(q - step, 1.0)) / (2 * step)
    # central differences: error of order step^2 times the third derivative, at most 36
    assert kernel_slope(q, 1.0) == pytest.approx(difference, abs=1e-8)


def test_kernel_has_compact_support():
    assert kernel(1.0, 1.0) == 0.0
    assert kernel(1.5, 1.0) == 0.0
    assert kernel_slope(1.2, 1.0) == 0.0


@pytest.mark.parametrize("dimension", [2, 3])
def test_lattice_sum_is_one(dimension):
    axis = np.arange(-2, 3)
    points = np.stack(np.meshgrid(*[axis] * dimension, indexing="ij"), axis=-1).reshape(-1, dimension)
    distance = np.linalg.norm(points, axis=1)
    total = sum(kernel(r / 2.0, normalisation(2.0, dimension)) for r in distance)
    assert total == pytest.approx(1.0, abs=1e-3)

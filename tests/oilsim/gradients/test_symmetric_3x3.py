"""Inverse and smallest eigenvalue of symmetric matrices against numpy."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from oilsim.gradients.gradient_correction import inverse, smallest_eigenvalue

EPSILON = float(np.finfo(np.float32).eps)


@njit
def solve_all(entries, inverses, smallest):
    for n in range(len(entries)):
        m = (entries[n, 0], entries[n, 1], entries[n, 2], entries[n, 3], entries[n, 4], entries[n, 5])
        inverses[n, 0], inverses[n, 1], inverses[n, 2], inverses[n, 3], inverses[n, 4], inverses[n, 5] = inverse(m)
        smallest[n] = smallest_eigenvalue(m)


def full(entries):
    """Matrices (N, 3, 3) of xx, xy, xz, yy, yz, zz."""
    return entries[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)


def packed(matrices):
    return np.ascontiguousarray(matrices.reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]])


def solved(matrices, kind):
    entries = packed(matrices).astype(kind)
    inverses, smallest = np.empty_like(entries), np.empty(len(entries), kind)
    solve_all(entries, inverses, smallest)
    return full(entries.astype(np.float64)), full(inverses.astype(np.float64)), smallest.astype(np.float64)


def turned(values, seed):
    """Symmetric matrices (N, 3, 3) with the eigenvalues (N, 3), in random directions."""
    bases = np.linalg.qr(np.random.default_rng(seed).normal(size=(len(values), 3, 3)))[0]
    return np.einsum("nik,nk,njk->nij", bases, values, bases)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_inverse_against_numpy(kind):
    values = np.random.default_rng(1).uniform(0.1, 1.5, (500, 3))
    matrices, inverses, _ = solved(turned(values, 2), kind)
    exact = np.linalg.inv(matrices)
    # the determinant, at least 1e-3, has a dozen roundings of products up to 1.5^3, each at eps, and TINY 1e-12 in it
    bound = 12 * 1.5**3 * np.finfo(kind).eps / 1e-3 + 1e-9
    assert np.abs(inverses - exact).max() < bound * np.abs(exact).max()


def test_inverse_of_matrices_that_are_not_positive():
    # a moment of one-sided neighbours can have any sign
    matrices, inverses, _ = solved(turned(np.array([[-0.5, 0.7, 1.1], [-0.9, -0.4, 0.6]]), 3), np.float64)
    assert inverses @ matrices == pytest.approx(np.broadcast_to(np.eye(3), (2, 3, 3)), abs=1e-10)


def eigenvalue_tolerance(size):
    """Error of mean + 2 size cos((acos c + 2 pi) / 3) in float32 at c = 1, where two eigenvalues meet and acos loses half the digits.

    c carries a dozen roundings, so that acos is off by the root of twice that.
    """
    return 2.0 * size / 3.0 * np.sin(2.0 * np.pi / 3.0) * np.sqrt(2.0 * 12.0 * EPSILON) + 12.0 * EPSILON


# the constants of `smallest_eigenvalue` are float32, as everything it is used on
def test_smallest_eigenvalue_against_numpy():
    values = np.random.default_rng(4).uniform(-0.2, 1.5, (500, 3))
    matrices, _, smallest = solved(turned(values, 5), np.float32)
    error = np.abs(smallest - np.linalg.eigvalsh(matrices)[:, 0])
    # size, the standard deviation over the root of 2, is at most 0.57 for eigenvalues in [-0.2, 1.5]
    assert error.max() < eigenvalue_tolerance(0.57)
    # where no two of them meet, round-off alone
    assert np.median(error) < 12.0 * EPSILON


@pytest.mark.parametrize(
    "values", [(1.0, 1.0, 1.0), (0.2, 1.0, 1.0), (0.2, 0.2, 1.0), (0.0, 0.0, 0.0), (0.0, 0.5, 1.0)]
)
def test_smallest_eigenvalue_where_eigenvalues_meet(values):
    for matrices in (np.diag(values)[None], turned(np.array([values] * 50), 6)):
        _, _, smallest = solved(matrices, np.float32)
        assert np.isfinite(smallest).all()
        # std / sqrt 2; where all three meet the size itself is round-off
        assert np.abs(smallest - values[0]).max() < eigenvalue_tolerance(float(np.std(values)) / np.sqrt(2.0))

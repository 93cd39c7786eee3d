"""Cholesky's factor of a symmetric matrix with a skyline: entries before a row's first nonzero entry are never touched.

Rows of joints depend only on joints of the same bodies. Along a chain they form a narrow band, and the cost of the factor grows with the
length of the chain, not with its cube. For a full matrix it is the usual factor.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]

COLUMNS = 64  # right hand sides that are solved at once and fit into the processor's cache


class EnvelopeCholesky:
    """The factor L with L L^T = `matrix` (R, R) [-], whose lower half is read; LinAlgError if it is not positive definite.

    first: (R,) column of each row's first entry, if it is known.
    """

    def __init__(self, matrix: Array, first: npt.NDArray[np.int64] | None = None) -> None:
        self._first = first_entries(matrix) if first is None else first
        self._factor = matrix.copy()
        if not factorize(self._factor, self._first):
            raise np.linalg.LinAlgError("the matrix of the joints is not positive definite")

    def solved(self, right: Array) -> Array:
        """Return matrix^-1 `right` (R, N) or (R,) [-]."""
        found = np.array(right, dtype=np.float64, order="C")
        if found.ndim == 1:
            solve_one(self._factor, self._first, found)
            return found
        solve(self._factor, self._first, found)
        return found


@njit(nogil=True, cache=True, error_model="numpy")
def first_entries(matrix: Array) -> npt.NDArray[np.int64]:
    """Return the column (R,) of each row's first nonzero entry in `matrix` (R, R) [-], at most that of the diagonal."""
    first = np.zeros(len(matrix), np.int64)
    for i in range(len(matrix)):
        while first[i] < i and matrix[i, first[i]] == 0.0:
            first[i] += 1
    return first


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def factorize(matrix: Array, first: npt.NDArray[np.int64]) -> bool:
    """Replace the lower half of `matrix` (R, R) [-] by its factor, with `first` (R,); tell whether it is positive definite."""
    for i in range(len(matrix)):
        for j in range(first[i], i + 1):
            value = matrix[i, j]
            for k in range(max(first[i], first[j]), j):
                value -= matrix[i, k] * matrix[j, k]
            if j < i:
                matrix[i, j] = value / matrix[j, j]
            elif value > 0.0:
                matrix[i, i] = np.sqrt(value)
            else:
                return False
    return True


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def solve(factor: Array, first: npt.NDArray[np.int64], right: Array) -> None:
    """Replace the right hand sides `right` (R, N) [-] by the solutions, with `factor` (R, R) and `first` (R,)."""
    for begin in range(0, right.shape[1], COLUMNS):
        columns = right[:, begin : begin + COLUMNS]
        for i in range(len(factor)):
            for k in range(first[i], i):
                for n in range(columns.shape[1]):
                    columns[i, n] -= factor[i, k] * columns[k, n]
            for n in range(columns.shape[1]):
                columns[i, n] /= factor[i, i]
        for i in range(len(factor) - 1, -1, -1):
            for n in range(columns.shape[1]):
                columns[i, n] /= factor[i, i]
            for k in range(first[i], i):
                for n in range(columns.shape[1]):
                    columns[k, n] -= factor[i, k] * columns[i, n]


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def solve_one(factor: Array, first: npt.NDArray[np.int64], right: Array) -> None:
    """Replace the right hand side `right` (R,) [-] by the solution, with `factor` (R, R) and `first` (R,)."""
    for i in range(len(factor)):
        value = right[i]
        for k in range(first[i], i):
            value -= factor[i, k] * right[k]
        right[i] = value / factor[i, i]
    for i in range(len(factor) - 1, -1, -1):
        right[i] /= factor[i, i]
        for k in range(first[i], i):
            right[k] -= factor[i, k] * right[i]

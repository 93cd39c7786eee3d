"""Cholesky's factor of a symmetric matrix whose rows begin late: what lies before a row's first entry is never touched.

Rows of joints know only those of the bodies that they hold. Along a chain that is a narrow band, so that the factor takes as long as the
chain is long, and not the cube of that; of a full matrix it is the usual factor.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]

COLUMNS = 64  # of right hand sides that are solved for at once: they stay in the processor's cache


class EnvelopeCholesky:
    """L with L L^T = `matrix` (R, R), of which the lower half is read; LinAlgError if that is not positive."""

    def __init__(self, matrix: Array) -> None:
        self._first = first_entries(matrix)
        self._factor = matrix.copy()
        if not factorize(self._factor, self._first):
            raise np.linalg.LinAlgError("the rows of joints are no positive definite matrix")

    def solved(self, right: Array) -> Array:
        """matrix^-1 `right` (R, N)."""
        found = np.array(right, dtype=np.float64, order="C")
        solve(self._factor, self._first, found)
        return found


@njit(nogil=True, cache=True, error_model="numpy")
def first_entries(matrix: Array) -> npt.NDArray[np.int64]:
    """The column (R,) of each row's first entry that is not 0, at most that of its diagonal."""
    first = np.zeros(len(matrix), np.int64)
    for i in range(len(matrix)):
        while first[i] < i and matrix[i, first[i]] == 0.0:
            first[i] += 1
    return first


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def factorize(matrix: Array, first: npt.NDArray[np.int64]) -> bool:
    """The factor in place of the lower half; whether the matrix is positive definite."""
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
    """The solutions in place of the right hand sides (R, N)."""
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

"""Cholesky's factor of a symmetric matrix with a skyline: entries before a row's first nonzero entry are neither kept nor touched.

Rows of joints depend only on joints of the same bodies. Along a chain they form a narrow band, and the cost of the factor grows with the
length of the chain, not with its cube. For a full matrix it is the usual factor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from oilsim.backend.arrays import Array, Ints
from oilsim.backend.jit import njit

COLUMNS = 64  # right hand sides that are solved at once and fit into the processor's cache


class Skyline(NamedTuple):
    """The lower half of a symmetric matrix of R rows, row after row from each one's first entry.

    first (R,): column of a row's first entry; start (R,): entry (i, k) is values[start[i] + k]; values [-].
    """

    first: Ints
    start: Ints
    values: Array

    @property
    def diagonal(self) -> Ints:
        """Places (R,) of the diagonal's entries in `values`."""
        return self.start + np.arange(len(self.first))


def empty_skyline(first: Ints) -> Skyline:
    """Return the matrix of zeros whose rows begin at the columns `first` (R,)."""
    ends = np.cumsum(np.arange(1, len(first) + 1) - first)
    return Skyline(first, ends - np.arange(1, len(first) + 1), np.zeros(ends[-1] if len(ends) else 0))


def skyline_of(matrix: Array) -> Skyline:
    """Return the lower half of a matrix (R, R) [-]."""
    skyline = empty_skyline(first_entries(matrix))
    for row, (first, start) in enumerate(zip(skyline.first.tolist(), skyline.start.tolist(), strict=True)):
        skyline.values[start + first : start + row + 1] = matrix[row, first : row + 1]
    return skyline


class EnvelopeCholesky:
    """The factor L with L L^T = `matrix`, whose values it replaces; LinAlgError if it is not positive definite."""

    def __init__(self, matrix: Skyline) -> None:
        self._factor = matrix
        if not factorize(matrix):
            raise np.linalg.LinAlgError("the matrix of the joints is not positive definite")

    def solved(self, right: Array) -> Array:
        """Return matrix^-1 `right` (R,) [-]."""
        found = np.array(right, dtype=np.float64)
        solve(self._factor, found)
        return found

    def half_solved(self, right: Array) -> Array:
        """Return L^-1 `right` (R, N) [-], of which right^T matrix^-1 right is the square."""
        found = np.array(right, dtype=np.float64, order="C")
        solve_lower(self._factor, found)
        return found


@njit(nogil=True, cache=True, error_model="numpy")
def first_entries(matrix: Array) -> Ints:
    """Return the column (R,) of each row's first nonzero entry in `matrix` (R, R) [-], at most that of the diagonal."""
    first = np.zeros(len(matrix), np.int64)
    for i in range(len(matrix)):
        while first[i] < i and matrix[i, first[i]] == 0.0:
            first[i] += 1
    return first


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def factorize(matrix: Skyline) -> bool:
    """Replace `matrix` by its factor; tell whether it is positive definite."""
    first, start, values = matrix
    for i in range(len(first)):
        for j in range(first[i], i + 1):
            value = values[start[i] + j]
            for k in range(max(first[i], first[j]), j):
                value -= values[start[i] + k] * values[start[j] + k]
            if j < i:
                values[start[i] + j] = value / values[start[j] + j]
            elif value > 0.0:
                values[start[i] + i] = np.sqrt(value)
            else:
                return False
    return True


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def solve_lower(factor: Skyline, right: Array) -> None:
    """Replace `right` (R, N) [-] by L^-1 right."""
    first, start, values = factor
    for begin in range(0, right.shape[1], COLUMNS):
        columns = right[:, begin : begin + COLUMNS]
        for i in range(len(first)):
            for k in range(first[i], i):
                for n in range(columns.shape[1]):
                    columns[i, n] -= values[start[i] + k] * columns[k, n]
            for n in range(columns.shape[1]):
                columns[i, n] /= values[start[i] + i]


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def solve(factor: Skyline, right: Array) -> None:
    """Replace the right hand side `right` (R,) [-] by the solution."""
    first, start, values = factor
    for i in range(len(first)):
        value = right[i]
        for k in range(first[i], i):
            value -= values[start[i] + k] * right[k]
        right[i] = value / values[start[i] + i]
    for i in range(len(first) - 1, -1, -1):
        right[i] /= values[start[i] + i]
        for k in range(first[i], i):
            right[k] -= values[start[i] + k] * right[i]

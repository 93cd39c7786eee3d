"""Spreads points evenly: chooses some that keep a distance, then lets them push each other apart.

Neither step knows the surface; the caller puts the points back on it.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

PACKING = 0.7  # count times distance^2 over area of what random choice at a least distance reaches on a plane


@njit(nogil=True, cache=True, error_model="numpy")
def _choose(order, start, neighbor, chosen):
    """Go through candidates in `order` and choose each that has no chosen neighbour."""
    for candidate in order:
        free = True
        for k in range(start[candidate], start[candidate + 1]):
            if chosen[neighbor[k]]:
                free = False
                break
        chosen[candidate] = free


def random_distance(pitch: float) -> float:
    """Return the least distance [m] at which random choice leaves one point per pitch^2 of a surface."""
    return math.sqrt(PACKING) * pitch


def choose_apart(candidates: Array, least: float, ordered: int = 0) -> Integers:
    """Return the indices of candidates (K, 3) [m] that are `least` [m] or more apart and leave no room for another.

    The first `ordered` of them are asked first and in their order, the others in a fixed random one (Poisson-disk choice).
    """
    count = len(candidates)
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    pairs = cKDTree(candidates).query_pairs(least, output_type="ndarray")
    near = coo_array((np.ones(len(pairs), dtype=np.bool_), pairs.T), shape=(count, count))
    near = (near + near.T).tocsr()
    others = ordered + np.random.default_rng(0).permutation(count - ordered)
    chosen = np.zeros(count, dtype=np.bool_)
    _choose(np.concatenate([np.arange(ordered), others]), near.indptr, near.indices, chosen)
    return np.flatnonzero(chosen)


def push_apart(points: Array, distance: float) -> Array:
    """Return displacements (N, 3) [m] that spread the points (N, 3) [m] evenly.

    A point's displacement is the sum over neighbours nearer than 1.5 `distance` [m] of 0.15 distance (1 - r / (1.5 distance))^2 along the
    line from the neighbour.
    """
    reach = 1.5 * distance
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    between = points[pairs[:, 0]] - points[pairs[:, 1]]
    gap = np.maximum(np.linalg.norm(between, axis=1), 1e-9 * distance)
    push = (0.15 * distance * np.clip(1.0 - gap / reach, 0.0, 1.0) ** 2 / gap)[:, None] * between
    moves = np.zeros_like(points)
    np.add.at(moves, pairs[:, 0], push)
    np.add.at(moves, pairs[:, 1], -push)
    return moves

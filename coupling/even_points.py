"""Even points from many: choose some at equal distances, then let them push each other apart.

Both steps know nothing of the shape; whoever uses them puts points back on the surface.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy.spatial import cKDTree

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

PACKING = 0.7  # count times radius^2 over area of what random choice at a least distance reaches on a plane
BISECTIONS = 12


@njit(nogil=True, cache=True, error_model="numpy")
def _choose(order, start, neighbor, gap2, least2, chosen):
    """Go through candidates in `order` and choose each that no chosen neighbour is nearer to than the least distance."""
    chosen[:] = False
    count = 0
    for candidate in order:
        free = True
        for k in range(start[candidate], start[candidate + 1]):
            if gap2[k] < least2 and chosen[neighbor[k]]:
                free = False
                break
        chosen[candidate] = free
        count += free
    return count


def choose_evenly(candidates: Array, count: int, area: float) -> Integers:
    """Indices of about `count` of the candidates (K, 3) that lie on a surface of `area` [m2], at even distances.

    Poisson-disk choice in a fixed random order; the least distance that leaves `count` is found by bisection.
    """
    if len(candidates) <= count:
        return np.arange(len(candidates))
    low, high = 0.0, 1.5 * math.sqrt(PACKING * area / count)
    pairs = cKDTree(candidates).query_pairs(high, output_type="ndarray")
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    start = np.searchsorted(both[:, 0], np.arange(len(candidates) + 1))
    neighbor = np.ascontiguousarray(both[:, 1])
    gap2 = ((candidates[both[:, 0]] - candidates[neighbor]) ** 2).sum(axis=1)
    order = np.random.default_rng(0).permutation(len(candidates))
    chosen = np.zeros(len(candidates), dtype=np.bool_)
    for _ in range(BISECTIONS):
        least = 0.5 * (low + high)
        found = _choose(order, start, neighbor, gap2, least * least, chosen)
        if abs(found - count) <= 0.002 * count:
            break
        low, high = (least, high) if found > count else (low, least)
    return np.flatnonzero(chosen)


def push_apart(points: Array, distance: float) -> Array:
    """Displacements (N, 3) [m] that even the points out: sum over neighbours nearer than 1.5 `distance` of
    0.15 `distance` (1 - r / (1.5 distance))^2 along the line between them."""
    reach = 1.5 * distance
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    between = points[pairs[:, 0]] - points[pairs[:, 1]]
    gap = np.maximum(np.linalg.norm(between, axis=1), 1e-9 * distance)
    push = (0.15 * distance * np.clip(1.0 - gap / reach, 0.0, 1.0) ** 2 / gap)[:, None] * between
    moves = np.zeros_like(points)
    np.add.at(moves, pairs[:, 0], push)
    np.add.at(moves, pairs[:, 1], -push)
    return moves

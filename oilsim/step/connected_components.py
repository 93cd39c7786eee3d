"""Connected parts of the liquid: particles within each other's reach, directly, through others, or through a body that both touch.

Union-find after Sutton, Ben-Nun and Barak 2018 ("Afforest"): joining each particle to two of its neighbours puts nearly all particles into
their final part. Only particles outside the largest part then look at all their neighbours. Lists are symmetric, so a link between the
largest part and another one is seen from the other side.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.disjoint_sets import find, join
from oilsim.backend.jit import ALLOCATING, FAST
from oilsim.boundaries.contacts import BodyPairs
from oilsim.neighborhood.neighbor_search import Pairs

Part = NDArray[np.int32]

# [1] neighbours of each particle that are joined first; paper (Sutton et al. 2018); their two rounds
SAMPLED = 2


@njit(**FAST)
def join_bodies(pairs, bodies, parent):
    """Join particles to the bodies that they touch.

    pairs: the step's `BodyPairs`; bodies: their number; parent (bodies + N,) int32, a node above each body and particle in its tree.
    """
    for n in range(pairs.particle.size):
        join(parent, np.int64(pairs.body[n]), bodies + pairs.particle[n])


@njit(**ALLOCATING)
def join_neighbors(fluid, bodies, parent):
    """Join particles to their neighbours in the lists `fluid`; `parent` (bodies + N,) int32 becomes the index of every node's root."""
    size = np.zeros(parent.size, np.int64)
    for node in range(bodies, parent.size):
        begin, number = fluid.start[node - bodies], np.int64(fluid.number[node - bodies])
        for k in range(begin, begin + min(number, SAMPLED)):
            join(parent, node, bodies + np.int64(fluid.neighbor[k]))
    for node in range(parent.size):
        parent[node] = find(parent, node)
        size[parent[node]] += 1
    largest = np.argmax(size)
    for node in range(bodies, parent.size):
        if find(parent, node) == find(parent, largest):
            continue
        begin = fluid.start[node - bodies]
        for k in range(begin, begin + np.int64(fluid.number[node - bodies])):
            join(parent, node, bodies + np.int64(fluid.neighbor[k]))
    for node in range(parent.size):
        parent[node] = find(parent, node)


@njit(**ALLOCATING)
def number_parts(bodies, parent, part):
    """Fill `part` (bodies + N,) int32 with the part of every node, in the order of their first particles, and return their number.

    parent (bodies + N,) int32: index of every node's root. A dry body gets -1.
    """
    count = 0
    of_root = np.full(parent.size, np.int32(-1))
    for node in range(bodies, parent.size):
        if of_root[parent[node]] < 0:
            of_root[parent[node]] = count
            count += 1
        part[node] = of_root[parent[node]]
    for node in range(bodies):
        part[node] = of_root[parent[node]]
    return count


def connected_parts(fluid: Pairs, pairs: BodyPairs, bodies: int, count: int) -> tuple[Part, Part, int]:
    """Return the part of each particle (N,) and of each moving body (B,), -1 for one that is dry, and the number of parts.

    fluid: lists of fluid neighbours; pairs: the step's `BodyPairs`; bodies: B; count: N. Walls at rest join nothing.
    """
    parent = np.arange(bodies + count, dtype=np.int32)
    part = np.empty_like(parent)
    join_bodies(pairs, bodies, parent)
    join_neighbors(fluid, bodies, parent)
    parts = number_parts(bodies, parent, part)
    return part[bodies:], part[:bodies], parts

"""Which liquid hangs together: particles within each other's reach, directly or by others or by a body that both touch.

Union-find after Sutton, Ben-Nun and Barak 2018 ("Afforest"): two neighbours of each particle join nearly everything into its final
part, and only what lies outside the largest one looks at all its neighbours. Lists are symmetric, so what joins the largest
part to others is seen from there.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from oilsim.backend.jit import ALLOCATING, FAST, inlined
from oilsim.boundaries.walls import Walls
from oilsim.neighborhood.neighbor_search import Pairs

Part = NDArray[np.int32]

SAMPLED = 2  # neighbours of each particle that are joined first


@inlined
def find(parent, node):
    """The root of a node; the way there is halved."""
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node


@inlined
def join(parent, a, b):
    """Put two nodes under one root, the smaller of both."""
    a, b = find(parent, a), find(parent, b)
    parent[max(a, b)] = min(a, b)


@njit(**FAST)
def join_bodies(walls, touching, resting, owner, bodies, parent):
    """Join particles to the bodies that they touch."""
    for i in touching:
        for k in range(walls.start[i], walls.start[i] + np.int64(walls.number[i])):
            if walls.neighbor[k] >= resting:
                join(parent, np.int64(owner[walls.neighbor[k] - resting]), bodies + i)


@njit(**ALLOCATING)
def join_neighbors(fluid, bodies, parent):
    """Join particles to their neighbours; `parent` (bodies + N,) ends with every node at its root."""
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
    """Fill `part` with the parts of all nodes, numbered in the order of their first particles; returns how many there are."""
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


def connected_parts(
    fluid: Pairs, wall_pairs: Pairs, walls: Walls, touching: NDArray[np.uint32], count: int
) -> tuple[Part, Part, int]:
    """The part of each particle (N,) and of each moving body (B,), -1 for one that is dry; and the number of parts.

    touching: indices of the particles that have a moving body within reach. Walls at rest join nothing.
    """
    bodies = len(walls.moving)
    parent = np.arange(bodies + count, dtype=np.int32)
    part = np.empty_like(parent)
    join_bodies(wall_pairs, touching, walls.resting, walls.owner, bodies, parent)
    join_neighbors(fluid, bodies, parent)
    parts = number_parts(bodies, parent, part)
    return part[bodies:], part[:bodies], parts

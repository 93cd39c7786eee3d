"""Disjoint sets of numbered nodes as a forest: every node points to another of its set, and the root to itself.

The root is the smallest number of its set. Sources: Galler and Fischer 1964; paths are halved on the way (van Leeuwen and Tarjan 1984).
"""

from __future__ import annotations

from oilsim.backend.jit import inlined


@inlined
def find(parent, node):
    """Return the root of a node by the indices in `parent` (nodes,) int32, halving the way there."""
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node


@inlined
def join(parent, a, b):
    """Put the nodes a and b under one root, the smaller of both; parent (nodes,) int32: index of each node's parent."""
    a, b = find(parent, a), find(parent, b)
    parent[max(a, b)] = min(a, b)

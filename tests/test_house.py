"""No two folders import each other: a package's own names may lead into its rooms, and no room leads back."""

from __future__ import annotations

import ast

from tests.house import ROOT, circles, imports_of, sources


def test_folders_are_acyclic() -> None:
    trees = {name: ast.parse(text) for name, text in sources(ROOT)}
    assert circles({name: imports_of(tree, frozenset(trees)) for name, tree in trees.items()}) == []


def test_a_package_root_that_is_floor_and_roof_is_a_circle() -> None:
    graph = {
        "a": set[str](),
        "a.roof": {"a.room.one"},
        "a.floor": set[str](),
        "a.room": set[str](),
        "a.room.one": {"a.floor"},
    }
    assert circles(graph) == [("a", "a.room")]

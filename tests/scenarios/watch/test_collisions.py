"""Vessels that run into something are told of, each pair once."""

from __future__ import annotations

from scenarios.watch.boom_scoring import Collisions


def test_each_pair_is_told_of_once_and_in_words() -> None:
    collisions = Collisions()
    met = [("", "vessels/one"), ("land/quay", "vessels/two"), ("vessels/one", "vessels/two"), ("boom/main/segment-03", "vessels/one"),
           ("boom/main/segment-03", "rock"), ("rock", "vessels/two"), ("shore", "vessels/two")]  # fmt: skip
    assert sorted(notice.text for notice in collisions.notices(met)) == [
        "one and two collide", "one runs aground", "one runs into boom main", "two runs aground", "two runs aground on quay",
        "two runs into rock",
    ]  # fmt: skip
    assert not list(collisions.notices(met))

"""Relations between the keys of a section: what is declared is refused with the key, its value and what is allowed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from oilsim.core.quantity import quantity
from scenarios.schema.cross_checks import problems_between
from scenarios.schema.liquid import BlockFill
from scenarios.schema.parsing.relations import (
    Relation,
    above,
    at_least_one,
    at_most_one,
    exactly_one,
    needed_with,
    only_with,
    together,
)
from scenarios.schema.tables import NAMED_TABLES, Parts


@dataclass(frozen=True, kw_only=True)
class Line:
    """Fields of a section."""

    length: float | None = quantity("m", default=None)
    reach: float | None = quantity("m", default=None)
    kind: str = "rope"
    fast: bool = False


@pytest.mark.parametrize(
    ("relation", "fine", "wrong", "problem"),
    [
        (
            only_with("fast", "reach"),
            {"fast": True, "reach": 1.0},
            {"fast": True},
            "fast is true, allowed: only with reach",
        ),
        (
            only_with("length", "kind", "rope", "chain"),
            {"length": 2.0},
            {"length": 2.0, "kind": "wire"},
            'length is 2, allowed: only with kind = "rope" or "chain"',
        ),
        (
            only_with("fast", "length or reach"),
            {"fast": True, "length": 1.0},
            {"fast": True},
            "fast is true, allowed: only with length or reach",
        ),
        (
            needed_with("length", "kind", "rope", "chain"),
            {"kind": "wire"},
            {"kind": "chain"},
            'length is missing, allowed: a number in m with kind = "chain"',
        ),
        (
            together("length", "reach"),
            {},
            {"length": 1.0},
            "reach is missing, allowed: length and reach together, or none",
        ),
        (
            at_most_one("length", "reach"),
            {},
            {"length": 1.0, "reach": 1.0},
            "reach is given beside length, allowed: one of length or reach",
        ),
        (at_least_one("length", "reach"), {"reach": 1.0}, {}, "length is missing, allowed: length or reach"),
        (exactly_one("length", "reach"), {"reach": 1.0}, {}, "length is missing, allowed: length or reach"),
        (
            above("length", "reach"),
            {"length": 2.0, "reach": 1.0},
            {"length": 1.0, "reach": 1.0},
            "length is 1, allowed: above reach = 1 m",
        ),
    ],
)
def test_a_declared_relation_is_kept(relation: Relation, fine: dict, wrong: dict, problem: str) -> None:
    assert [str(one) for one in relation(Line(**fine))] == []
    assert [str(one) for one in relation(Line(**wrong))] == [problem]


def test_a_name_that_leads_nowhere_is_told_with_those_that_are_there() -> None:
    block = BlockFill(phase="oyl", lower=(0.0, 0.0, 0.0), upper=(1.0, 1.0, 1.0))
    names = dict.fromkeys(NAMED_TABLES, ()) | {"phases": ("oil",), "fill": ("one",)}
    parts = Parts(names=names, given=frozenset({"phases", "fill"}), fill={"one": block})
    (problem,) = problems_between(parts)
    assert str(problem) == "fill.one.phase is 'oyl', which is no phase, did you mean 'oil'? allowed: oil"
    assert not list(problems_between(replace(parts, fill={"one": replace(block, phase="oil")})))

"""Declaration of a scenario's sections: each checks its own fields, numbers by the limits that `oilsim.core.quantity` declares."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, get_type_hints

from oilsim.core.quantity import Quantity, quantities
from scenarios.schema.parsing.relations import Relation
from scenarios.schema.parsing.type_checks import Misfit, shape_of, taken
from scenarios.text.problems import Problem, ScenarioError

Vector = tuple[float, float, float]
Point2 = tuple[float, float]


_KINDS: dict[type, Mapping[str, Any]] = {}  # resolving names takes two thirds of the time in which a file is read


def field_kinds(section: type) -> Mapping[str, Any]:
    """Return the type of each field of a section, resolved."""
    if section not in _KINDS:
        kinds = get_type_hints(section)
        _KINDS[section] = {item.name: kinds[item.name] for item in fields(section)}
    return _KINDS[section]


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a scenario that refuses impossible values when it is created.

    A subclass is a frozen keyword-only dataclass. `RELATIONS` declares how its fields go together (`scenarios.schema.parsing.relations`),
    and its `problems` may yield what is no plain relation. A file chooses a subclass with ``TAG = ("shape", "box")`` by ``shape = "box"``,
    and the USUAL one by leaving that out. COMPASS is the key of a compass course that gives its heading or direction, where it has one.
    Raises ScenarioError with every problem of the section.
    """

    TAG: ClassVar[tuple[str, str] | None] = None
    USUAL: ClassVar[bool] = False
    COMPASS: ClassVar[str | None] = None
    RELATIONS: ClassVar[tuple[Relation, ...]] = ()

    def __post_init__(self) -> None:
        """Raise one ScenarioError with every problem of this section; numbers and lists become floats, ints and tuples."""
        found = [problem for name, kind in field_kinds(type(self)).items() for problem in self._problems_of(name, kind)]
        if not found:
            of_classes = [vars(one).get("RELATIONS", ()) for one in type(self).__mro__]
            found = [problem for relations in of_classes for relation in relations for problem in relation(self)]
            found += self.problems()
        if found:
            raise ScenarioError(found, type(self).__name__)

    def _problems_of(self, name: str, kind: Any) -> Iterator[Problem]:
        """Find the problems of one field by itself, and convert its value to its type."""
        given, limits = getattr(self, name), quantities(type(self)).get(name)
        try:
            value = taken(given, kind)
        except Misfit as misfit:
            if limits is None:
                yield Problem(".".join((name, *misfit.path)), misfit.text)
            else:
                yield Problem(name, f"is {given!r}, allowed: {shape_of(kind)}, {limits.allowed}")
            return
        object.__setattr__(self, name, value)
        found = None if limits is None or value is None else faulty_entry(limits, value)
        if found is not None:
            steps, fault = found
            yield Problem(".".join((name, *steps)), fault)

    def problems(self) -> Iterable[Problem]:
        """Yield the problems that concern several fields together; called only if each field is valid by itself."""
        return ()


def faulty_entry(limits: Quantity, value: Any) -> tuple[tuple[str, ...], str] | None:
    """Find the first number that is not allowed, in lists down to any depth: the places that lead to it, and what is wrong with it."""
    if isinstance(value, tuple):
        for index, entry in enumerate(value):
            found = faulty_entry(limits, entry)
            if found is not None:
                return (str(index), *found[0]), found[1]
        return None
    fault = limits.fault(value)
    return None if fault is None else ((), fault)

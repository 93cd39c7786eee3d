"""Declaration of a scenario's sections: each checks its own fields, numbers by the limits that `oilsim.core.quantity` declares.

A catalogue section takes what a scenario does not state from an entry of a catalogue.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, ClassVar, get_type_hints

from oilsim.core.catalogue import CatalogueEntry
from oilsim.core.quantity import Quantity, quantities
from scenarios.schema.parsing.relations import Relation
from scenarios.schema.parsing.type_checks import Misfit, shape_of, taken
from scenarios.text.problems import Problem, ScenarioError, unknown

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


@dataclass(frozen=True, kw_only=True)
class CatalogueSection(Section):
    """A section whose field KEY may name an entry of CATALOGUE, which gives the fields of USUAL_VALUES that are None.

    USUAL_VALUES are those of a section without an entry, or whose entry has none; MISSING is one that must be stated then.
    """

    KEY: ClassVar[str]
    CATALOGUE: ClassVar[Callable[[], Mapping[str, CatalogueEntry]]]
    USUAL_VALUES: ClassVar[Mapping[str, Any]]

    def __post_init__(self) -> None:
        """Take what is not stated from the catalogue, then check everything; ScenarioError with every problem."""
        named, entries = getattr(self, self.KEY), type(self).CATALOGUE()
        entry = entries.get(named) if isinstance(named, str) else None
        found = []
        if named is not None and entry is None:
            found.append(
                Problem(self.KEY, f"is {named!r}, which {unknown(str(named), entries, f'{self.KEY} of the catalogue')}")
            )
        open_fields = [name for name in self.USUAL_VALUES if getattr(self, name) is None]
        for name in open_fields:
            given = getattr(entry, name, None)
            object.__setattr__(self, name, self.USUAL_VALUES[name] if given is None else given)
        lacking = [name for name in open_fields if getattr(self, name) is MISSING]
        if not found:
            other = (
                f", or {self.KEY} = a name of the catalogue"
                if entry is None
                else f": {named!r} of the catalogue has none"
            )
            found += [Problem(name, f"is missing, allowed: a value{other}") for name in lacking]
        try:
            super().__post_init__()
        except ScenarioError as error:
            found += [problem for problem in error.problems if problem.path not in (self.KEY, *lacking)]
        if found:
            raise ScenarioError(found, type(self).__name__)

"""Fields of a scenario: numbers with unit and limits, and sections that check themselves."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, ClassVar, get_type_hints

from scenarios.problems import Problem, ScenarioError
from scenarios.schema.type_checks import Misfit, shape_of, taken

Vector = tuple[float, float, float]
Point2 = tuple[float, float]

_QUANTITY = "quantity"
LARGEST = 1e12  # largest magnitude of any number; its square still fits into single precision

SHORTEST = 1e-100  # shortest vector that gives a direction; the square of a shorter one may vanish


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """Unit and limits of a number, or of each number of a vector."""

    unit: str
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None
    whole: bool = False

    @property
    def allowed(self) -> str:
        """The allowed values in words, with the unit."""
        low = f"above {self.above:g}" if self.above is not None else ""
        low = f"{self.at_least:g} or more" if self.at_least is not None else low
        high = f"at most {self.at_most:g}" if self.at_most is not None else ""
        limits = " and ".join(filter(None, (low, high)))
        unit = self.unit if limits or not self.unit else f"in {self.unit}"
        return " ".join(filter(None, (limits or "finite", unit))).replace("finite in", "finite, in")

    def accepts(self, number: float) -> bool:
        """Tell whether ``number`` is finite and within the limits."""
        return (
            math.isfinite(number)
            and (self.above is None or number > self.above)
            and (self.at_least is None or number >= self.at_least)
            and (self.at_most is None or number <= self.at_most)
        )

    def fault(self, value: Any) -> str | None:
        """Describe the fault of ``value``, a number or numbers in nested tuples; None if there is none."""
        if isinstance(value, tuple):
            return next((fault for fault in map(self.fault, value) if fault), None)
        if math.isfinite(value) and abs(float(value)) > LARGEST:
            return f"is {float(value):g}, allowed: magnitudes up to {LARGEST:g}"
        return None if self.accepts(float(value)) else f"is {value!r}, allowed: {self.allowed}"


def quantity(
    unit: str,
    *,
    default: Any = MISSING,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    whole: bool = False,
) -> Any:
    """Declare a dataclass field that holds a number, a vector or a table of numbers of ``unit`` within the limits."""
    limits = Quantity(unit=unit, above=above, at_least=at_least, at_most=at_most, whole=whole)
    return field(default=default, metadata={_QUANTITY: limits})


def quantities(section: type) -> dict[str, Quantity]:
    """Return the declared quantities of a section by field name."""
    return {item.name: item.metadata[_QUANTITY] for item in fields(section) if _QUANTITY in item.metadata}


def field_kinds(section: type) -> Mapping[str, Any]:
    """Return the type of each field of a section, resolved."""
    kinds = get_type_hints(section)
    return {item.name: kinds[item.name] for item in fields(section)}


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a scenario that refuses impossible values when it is created.

    A subclass is a frozen keyword-only dataclass. Its `problems` may yield further problems, which concern several fields together. A file
    chooses a subclass with ``TAG = ("shape", "box")`` by ``shape = "box"``. Raises ScenarioError with every problem of the section.
    """

    TAG: ClassVar[tuple[str, str] | None] = None

    def __post_init__(self) -> None:
        """Raise one ScenarioError with every problem of this section; numbers and lists become floats, ints and tuples."""
        found = [problem for name, kind in field_kinds(type(self)).items() for problem in self._problems_of(name, kind)]
        if not found:
            found = list(self.problems())
        if found:
            raise ScenarioError(found, type(self).__name__)

    def _problems_of(self, name: str, kind: Any) -> Iterator[Problem]:
        """Yield the problem of one field by itself, or convert its value to its type."""
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
        fault = limits.fault(value) if limits is not None and value is not None else None
        if fault:
            yield Problem(name, fault)

    def problems(self) -> Iterable[Problem]:
        """Yield the problems that concern several fields together; called only if each field is valid by itself."""
        return ()


def directed(name: str, vector: Vector) -> Iterator[Problem]:
    """Yield a problem if a vector (3,) is too short to give a direction."""
    if math.hypot(*vector) < SHORTEST:
        yield Problem(name, f"is {vector}, allowed: a direction, not all zero")


def above_lower(lower: Iterable[float], upper: Iterable[float]) -> Iterator[Problem]:
    """Yield problems of a box whose upper corner is not above its lower one [m]."""
    for axis, low, high in zip("xyz", lower, upper, strict=True):
        if not high > low:
            yield Problem("upper", f"has {axis} = {high:g} m, allowed: above lower {axis} = {low:g} m")


def exactly_one(section: Section, *names: str) -> Iterator[Problem]:
    """Yield a problem unless exactly one of the named fields is given."""
    given = [name for name in names if getattr(section, name) is not None]
    choices = " or ".join(names)
    if not given:
        yield Problem(names[0], f"is missing, allowed: {choices}")
    elif len(given) > 1:
        yield Problem(given[1], f"is given beside {given[0]}, allowed: one of {choices}")

"""Numbers with a unit and limits, declared once by the class that takes them.

A frozen dataclass declares them field by field with `quantity`; another class names them in `QUANTITIES`. A reader of the
same numbers, such as the schema of scenario files, declares its own fields from these and so allows exactly the same.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from numbers import Integral, Real
from typing import Any

# [SI unit] largest magnitude of any number; numerical; no quantity that occurs here is larger, and its square fits into 32 bits
LARGEST = 1e12
# [1] least length of a vector that gives a direction; numerical; the square of a shorter one may vanish
SHORTEST_DIRECTION = 1e-100
_KEY = "quantity"


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """Unit and limits of a number, or of each number of a vector.

    unit      as text, "" for a pure number
    above, at_least, below, at_most  limits; None: none on that side
    whole     whether only whole numbers are allowed
    """

    unit: str = ""
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    whole: bool = False

    @property
    def allowed(self) -> str:
        """The allowed values in words, with the unit: ``above 0 and below 0.1 m``."""
        low = f"above {self.above:g}" if self.above is not None else ""
        low = f"{self.at_least:g} or more" if self.at_least is not None else low
        high = f"below {self.below:g}" if self.below is not None else ""
        high = f"at most {self.at_most:g}" if self.at_most is not None else high
        limits = " and ".join(filter(None, (low, high)))
        if not limits:
            return f"finite, in {self.unit}" if self.unit else "finite"
        return f"{limits} {self.unit}".rstrip()

    def accepts(self, number: float) -> bool:
        """Return whether `number` is finite and within the limits."""
        return (
            math.isfinite(number)
            and (self.above is None or number > self.above)
            and (self.at_least is None or number >= self.at_least)
            and (self.below is None or number < self.below)
            and (self.at_most is None or number <= self.at_most)
        )

    def fault(self, value: Any) -> str | None:
        """Say what is wrong with `value` (a number, or numbers in tuples down to any depth); None for one that is allowed."""
        if isinstance(value, tuple):
            return next((fault for fault in map(self.fault, value) if fault), None)
        try:
            number = float(value)
        except OverflowError:
            return f"is larger than any float, allowed: magnitudes up to {LARGEST:g}"
        if math.isfinite(number) and abs(number) > LARGEST:
            return f"is {number:g}, allowed: magnitudes up to {LARGEST:g}"
        return None if self.accepts(number) else f"is {value!r}, allowed: {self.allowed}"

    def misfit(self, value: Any) -> str | None:
        """Say that `value`, of any type, is no number, or holds entries that are none; None for numbers."""
        if all(is_number(entry, whole=self.whole) for entry in _entries(value)):
            return None
        kind = "a whole number" if self.whole else "a number"
        return f"is {value!r}, allowed: {kind}, {self.allowed}"


class LimitedAttributes:
    """Base of a class whose attributes named in `QUANTITIES` may change: the limits hold whenever one is assigned.

    It does not matter who assigns: an order, a signal, a saved state or a program. Raises ValueError, like `require`.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if name in quantities(type(self)):
            require(type(self).__name__.lower(), type(self), {name: value})
        super().__setattr__(name, value)


def quantity(
    unit: str,
    *,
    default: Any = MISSING,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    whole: bool = False,
) -> Any:
    """Declare a dataclass field that holds a number, a vector or a table of numbers of `unit` within the limits."""
    declared = Quantity(unit=unit, above=above, at_least=at_least, below=below, at_most=at_most, whole=whole)
    return field(default=default, metadata={_KEY: declared})


def quantity_of(owner: type, name: str, *, default: Any = ...) -> Any:
    """Declare a dataclass field with the unit, the limits and the default of the quantity `name` of `owner`.

    A `default` that is given replaces the owner's; without either the field must be given.
    """
    if default is ...:
        parameter = inspect.signature(owner).parameters.get(name)
        default = MISSING if parameter is None or parameter.default is inspect.Parameter.empty else parameter.default
    return field(default=default, metadata={_KEY: quantities(owner)[name]})


def quantities(owner: type) -> dict[str, Quantity]:
    """Return the quantities that a class declares, by name."""
    if is_dataclass(owner):
        return {item.name: item.metadata[_KEY] for item in fields(owner) if _KEY in item.metadata}
    return dict(getattr(owner, "QUANTITIES", {}))


def require(what: str, owner: type, values: Mapping[str, Any], problems: Iterable[str] = ()) -> None:
    """Raise one ValueError that names `what` and every value that `owner` does not allow.

    None is allowed where it is the default. `problems`, of several values together, are asked for only
    where all values are numbers.
    """
    parameters = inspect.signature(owner).parameters
    given = {}
    for name, declared in quantities(owner).items():
        may_be_none = name in parameters and parameters[name].default is None
        if name in values and not (may_be_none and values[name] is None):
            given[name] = (declared, values[name])
    found = _texts((name, declared.misfit(value)) for name, (declared, value) in given.items())
    found = found or [
        *_texts((name, declared.fault(_plain(value))) for name, (declared, value) in given.items()),
        *problems,
    ]
    if found:
        raise ValueError(f"{what}: " + "; ".join(found))


def _texts(faults: Iterable[tuple[str, str | None]]) -> list[str]:
    return [f"{name} {fault}" for name, fault in faults if fault]


def _plain(value: Any) -> Any:
    """Return a number as it is, the numbers of a sequence as a tuple."""
    return value if isinstance(value, Real) else _entries(value)


def _entries(value: Any) -> tuple[Any, ...]:
    """Return a number, or the numbers of a sequence, a table or an array, as one tuple."""
    if isinstance(value, Real | str) or not isinstance(value, Iterable):
        return (value,)
    return tuple(number for entry in value for number in _entries(entry))


def is_number(value: Any, *, whole: bool = False) -> bool:
    """Return whether `value` is a real number, or a whole one; truth values are none."""
    return isinstance(value, Integral if whole else Real) and not isinstance(value, bool)

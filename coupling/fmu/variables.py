"""Turns the variables of an FMU into those of a participant, with its arrays and units.

A unit keeps its name, with the dot of a product written as a space ("N m"), and its relation to SI, which FMI defines by exponents, factor
and offset. A variable whose elements have several units names each once ("N, N m"). If the FMU names no unit, the user may name it; else
the variable has none, "1".

Keeps the log messages of FMUs, which are not printed, so that an error can quote them.

FMPy formats the messages of FMI 2 in a native function that knows one logger for the whole process, the one registered last. So there is
one logger here, and the environment that each FMU is given identifies the sender of a message.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from ctypes import byref
from dataclasses import replace
from itertools import count
from weakref import WeakValueDictionary

from fmpy import calloc, free
from fmpy.fmi2 import (
    addLoggerProxy,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.model_description import ModelDescription, ModelVariable

from coupling.master.participant import ELEMENT, Causality, Numbers, Variable, variable_table
from coupling.master.units import BASE, Unit, read_unit

WARNING = 1  # status of FMI 2 and 3; messages of lower rank are not kept
KEPT = 5


class FmuMessages:
    """The last warnings and errors of one FMU; `callbacks` (FMI 2) and `listener` (FMI 3) must live as long as the FMU."""

    def __init__(self) -> None:
        self._messages: deque[str] = deque(maxlen=KEPT)
        self.listener: Callable[..., None] = lambda _, status, category, message: self.keep(status, message)
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = _LOGGER
        self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        self.callbacks.componentEnvironment = next(_ENVIRONMENTS)
        _LISTENING[self.callbacks.componentEnvironment] = self
        addLoggerProxy(byref(self.callbacks))

    def explain(self, failure: object) -> str:
        """Describe a failure on one line, followed by the FMU's messages since the last call."""
        said = "; ".join(self._messages)
        self._messages.clear()
        return f"{failure}: {said}" if said else str(failure)

    def keep(self, status: int, message: bytes | None) -> None:
        """Keep a message if its status is a warning or worse."""
        text = " ".join((message or b"").decode("utf-8", "replace").split())
        if status >= WARNING and text:
            self._messages.append(text)


def _log(environment: int | None, _name: bytes, status: int, _category: bytes, message: bytes) -> None:
    listener = _LISTENING.get(environment or 0)
    if listener is not None:
        listener.keep(status, message)


_ENVIRONMENTS = count(1)
_LISTENING: WeakValueDictionary[int, FmuMessages] = WeakValueDictionary()
_LOGGER = fmi2CallbackLoggerTYPE(_log)


NUMBERS = {"Real", "Integer", "Enumeration", "Boolean", "Float64", "Float32"} | {
    f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)
}
FLOATS = ("Real", "Float64", "Float32")
INTEGERS = {"Integer": (32, True)} | {  # bits, and whether one of them is a sign
    f"{'' if signed else 'U'}Int{bits}": (bits, signed) for bits in (8, 16, 32, 64) for signed in (True, False)
}


def grouped(description: ModelDescription) -> dict[str, list[ModelVariable]]:
    """Group the numeric inputs, outputs and parameters by name; an array of FMI 2 is the list of its elements in order.

    Two or more elements with consecutive indices form an array if they have one type and causality and no variable has the array's name.
    Each element remains a variable of its own as well.
    """
    offered = {
        variable.name: [variable]
        for variable in description.modelVariables
        if variable.causality in ("input", "output", "parameter")
        and variable.type in NUMBERS
        and math.prod(variable.shape)  # an array may be empty
    }
    elements: dict[str, dict[int, ModelVariable]] = {}
    for name, (variable,) in offered.items():
        match = ELEMENT.match(name)
        if match and not variable.shape:
            elements.setdefault(match["name"], {})[int(match["index"])] = variable
    arrays = {
        name: [by_index[index] for index in sorted(by_index)]
        for name, by_index in elements.items()
        if name not in offered and _are_array(by_index)
    }
    return offered | arrays


def _are_array(by_index: Mapping[int, ModelVariable]) -> bool:
    """Tell whether these elements, by their indices, form one array."""
    alike = len({(element.type, element.causality) for element in by_index.values()}) == 1
    return alike and len(by_index) > 1 and max(by_index) - min(by_index) + 1 == len(by_index)


def variables_of(
    description: ModelDescription, members: Mapping[str, list[ModelVariable]], said: Mapping[str, str]
) -> dict[str, Variable]:
    """Create the participant's variables from groups of the FMU's variables; `said` gives units that the FMU does not name.

    Raises ValueError for the unit of a variable that does not exist or has one in the FMU, and for a unit that is not known.
    """
    stated = {name: [_unit_name(member) for member in group] for name, group in members.items()}
    for name, unit in said.items():
        if name not in members:
            raise ValueError(f"unit of {name!r} is given, which is no variable, allowed: {', '.join(members)}")
        if any(stated[name]):
            raise ValueError(f"unit of {name!r} is given as {unit!r}, but the FMU itself says {stated[name][0]!r}")
        if read_unit(unit) is None:
            raise ValueError(
                f"unit of {name!r} is {unit!r}, which is not known, allowed: as in 'N', 'kN', 'm/s', 'kn', 'deg'"
            )
    defined = {unit.name: _defined(unit.baseUnit) for unit in description.unitDefinitions if unit.baseUnit is not None}
    return variable_table(
        _declare(name, group, [said.get(name) or unit or "1" for unit in stated[name]], defined)
        for name, group in members.items()
    )


def _declare(name: str, members: list[ModelVariable], unit_names: list[str], defined: Mapping[str, Unit]) -> Variable:
    """Create the variable that represents these members."""
    distinct = list(dict.fromkeys(unit_names))
    shape = tuple(members[0].shape) or (len(members),)
    units = {_unit(member, unit, defined) for member, unit in zip(members, unit_names, strict=True)}
    si = units.pop() if len(units) == 1 else None
    unit, causality = ", ".join(distinct).replace(".", " "), Causality(members[0].causality)
    return Variable(name, unit, shape, causality, si=si, numbers=_numbers(members[0].type))


def _numbers(kind: str) -> Numbers:
    """Which numbers a variable of this type holds; an enumeration's are whole."""
    return Numbers.REAL if kind in FLOATS else Numbers.BOOLEAN if kind == "Boolean" else Numbers.WHOLE


def _unit(member: ModelVariable, name: str, defined: Mapping[str, Unit]) -> Unit | None:
    """Return a unit's relation to SI, None if it is not known; a difference has no offset, so that one of 5 degC is 5 K."""
    unit = defined.get(name) or read_unit(name.replace(".", " "))
    return replace(unit, offset=0.0) if unit is not None and member.relativeQuantity else unit


def _unit_name(member: ModelVariable) -> str:
    """Return the unit that a variable or its type states; empty if neither does."""
    return member.unit or (member.declaredType.unit if member.declaredType is not None else None) or ""


def _defined(base: object) -> Unit:
    """Read a unit from its definition in the model description."""
    exponents = tuple(int(getattr(base, name)) for name in BASE)
    return Unit(exponents, float(base.factor), float(base.offset))  # type: ignore[attr-defined, arg-type]


def whole(variable: str, kind: str, numbers: Sequence[float]) -> list[int] | list[bool]:
    """Convert numbers to integers or booleans of the FMI type `kind`; ValueError for a number that is not whole or out of range."""
    bits, signed = INTEGERS.get(kind, (1, False))
    lowest, highest = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    for number in numbers:
        if not (lowest <= number <= highest and number == int(number)):
            allowed = "0 or 1" if kind == "Boolean" else f"whole numbers from {lowest} to {highest}"
            raise ValueError(f"{variable} is {number:g}, allowed: {allowed}")
    return [number != 0.0 for number in numbers] if kind == "Boolean" else [int(number) for number in numbers]

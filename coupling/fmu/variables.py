"""The variables of an FMU as those of a participant: arrays put together, units as the model description defines them.

A unit's name is taken over with the dot of a product written as a space ("N m"), and with it how it stands to SI, which FMI
defines by exponents, factor and offset; elements of mixed units name each once ("N, N m"). An FMU that names no unit leaves it open:
whoever connects it may say what it is, else the variable has none, "1".
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from fmpy.model_description import ModelDescription, ModelVariable

from coupling.participant import Causality, Numbers, Variable, variable_table
from coupling.units import BASE, Unit, read_unit

ELEMENT = re.compile(r"^(?P<name>.+)\[(?P<index>\d+)\]$")
NUMBERS = {"Real", "Integer", "Enumeration", "Boolean", "Float64", "Float32"} | {
    f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)
}
FLOATS = ("Real", "Float64", "Float32")
INTEGERS = {"Integer": (32, True)} | {  # bits, and whether one of them is a sign
    f"{'' if signed else 'U'}Int{bits}": (bits, signed) for bits in (8, 16, 32, 64) for signed in (True, False)
}


def grouped(description: ModelDescription) -> dict[str, list[ModelVariable]]:
    """Numeric inputs, outputs and parameters by name, and arrays of FMI 2: their elements together and in order.

    An array is what two elements or more with neighbouring indices make, if they are alike and no variable has its name; each
    of them can be had by its own name as well.
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
    """Whether these elements, by their indices, are one array."""
    alike = len({(element.type, element.causality) for element in by_index.values()}) == 1
    return alike and len(by_index) > 1 and max(by_index) - min(by_index) + 1 == len(by_index)


def variables_of(
    description: ModelDescription, members: Mapping[str, list[ModelVariable]], said: Mapping[str, str]
) -> dict[str, Variable]:
    """The variables that stand for the members, by name; `said` gives units that the FMU leaves open.

    ValueError for a unit said of a variable that has one or does not exist, and for one that nobody knows.
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
    """The variable that stands for these members."""
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
    """How a variable's unit stands to SI, if that is known; a difference has no offset, 5 degC of it are 5 K."""
    unit = defined.get(name) or read_unit(name.replace(".", " "))
    return replace(unit, offset=0.0) if unit is not None and member.relativeQuantity else unit


def _unit_name(member: ModelVariable) -> str:
    """The unit that a variable or its type states; empty if neither does."""
    return member.unit or (member.declaredType.unit if member.declaredType is not None else None) or ""


def _defined(base: object) -> Unit:
    """A unit by what the model description says of it."""
    exponents = tuple(int(getattr(base, name)) for name in BASE)
    return Unit(exponents, float(base.factor), float(base.offset))  # type: ignore[attr-defined, arg-type]


def whole(variable: str, kind: str, numbers: Sequence[float]) -> list[int] | list[bool]:
    """The numbers as the integers or booleans that they are; ValueError for others."""
    bits, signed = INTEGERS.get(kind, (1, False))
    lowest, highest = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    for number in numbers:
        if not (lowest <= number <= highest and number == int(number)):
            allowed = "0 or 1" if kind == "Boolean" else f"whole numbers from {lowest} to {highest}"
            raise ValueError(f"{variable} is {number:g}, allowed: {allowed}")
    return [number != 0.0 for number in numbers] if kind == "Boolean" else [int(number) for number in numbers]

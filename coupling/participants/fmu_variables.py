"""The variables of an FMU as those of a participant: arrays put together, units as the model description defines them.

A unit's name is taken over with the dot of a product written as a space ("N m"), and with it how it stands to SI, which FMI
defines by exponents, factor and offset; elements of mixed units name each once ("N, N m"). An FMU that names no unit leaves it open:
whoever connects it may say what it is, else the variable has none, "1".
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from fmpy.model_description import ModelDescription, ModelVariable

from coupling.participant import Causality, Variable, variable_table
from coupling.units import BASE, Unit, read_unit

ELEMENT = re.compile(r"^(?P<name>.+)\[(?P<index>\d+)\]$")
NUMBERS = {"Real", "Integer", "Enumeration", "Boolean", "Float64", "Float32"} | {
    f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)
}


def grouped(description: ModelDescription) -> dict[str, list[ModelVariable]]:
    """Numeric inputs, outputs and parameters by name, elements of one FMI 2 array together and in order."""
    offered = [
        variable
        for variable in description.modelVariables
        if variable.causality in ("input", "output", "parameter") and variable.type in NUMBERS
    ]

    def place(variable: ModelVariable) -> tuple[str, int]:
        match = ELEMENT.match(variable.name)
        return (match["name"], int(match["index"])) if match else (variable.name, 0)

    groups: dict[str, list[ModelVariable]] = {}
    for variable in offered:
        groups.setdefault(place(variable)[0], []).append(variable)
    result: dict[str, list[ModelVariable]] = {}
    for name, members in groups.items():
        members.sort(key=lambda member: place(member)[1])
        alike = len({(member.type, member.causality) for member in members}) == 1
        indices = [place(member)[1] for member in members]
        if alike and indices == list(range(indices[0], indices[0] + len(members))):
            result[name] = members
        else:
            result |= {member.name: [member] for member in members}
    return result


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
    dimensions = [int(dimension.start) for dimension in members[0].dimensions or [] if dimension.start is not None]
    shape = tuple(dimensions) if dimensions else (len(members),)
    if math.prod(shape) == 0:
        shape = (1,)
    si = defined.get(distinct[0]) if len(distinct) == 1 else None
    return Variable(name, ", ".join(distinct).replace(".", " "), shape, Causality(members[0].causality), si=si)


def _unit_name(member: ModelVariable) -> str:
    """The unit that a variable or its type states; empty if neither does."""
    return member.unit or (member.declaredType.unit if member.declaredType is not None else None) or ""


def _defined(base: object) -> Unit:
    """A unit by what the model description says of it."""
    exponents = tuple(int(getattr(base, name)) for name in BASE)
    return Unit(exponents, float(base.factor), float(base.offset))  # type: ignore[attr-defined, arg-type]

"""Connections: which output feeds which input, whether the two fit, and how the value is transferred.

Units that differ are converted if both are known (see `units`): an output in knots feeds an input in m/s.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from coupling.master.participant import Causality, Numbers, Participant, Variable, array_of
from coupling.master.units import Conversion, conversion
from oilsim.backend.arrays import Array

_KINDS = {Causality.INPUT: "an input", Causality.OUTPUT: "an output", Causality.PARAMETER: "a parameter"}


@dataclass(frozen=True)
class Connection:
    """The output `source_variable` of participant `source` feeds the input `target_variable` of `target`."""

    source: str
    source_variable: str
    target: str
    target_variable: str

    def __str__(self) -> str:
        return f"{self.source}:{self.source_variable} -> {self.target}:{self.target_variable}"


@dataclass(frozen=True)
class Link:
    """A connection that has been checked, with the conversion from the source's value to the target's."""

    connection: Connection
    conversion: Conversion

    def carried(self, value: Array) -> Array:
        """Convert the source's value, of any shape (N, ...), to the target's unit [-]."""
        if self.conversion.is_identity:
            return value
        return np.asarray(self.conversion.factor * value + self.conversion.offset)


def link(connection: Connection, participants: Mapping[str, Participant]) -> Link:
    """Return the link of a connection that has no problems."""
    source = participants[connection.source].variables[connection.source_variable]
    target = participants[connection.target].variables[connection.target_variable]
    return Link(connection, _unit_conversion(source, target) or Conversion())


def setup_problems(participants: Sequence[Participant], connections: Sequence[Connection]) -> list[str]:
    """List all problems that keep these participants and connections from running together, one sentence each."""
    names = [participant.name for participant in participants]
    problems = [f"participant {name!r} appears twice" for name in sorted(set(names)) if names.count(name) > 1]
    by_name = {participant.name: participant for participant in participants}
    for connection in connections:
        problems += connection_problems(connection, by_name)
    problems += _doubly_fed(connections, by_name)
    return problems


def connection_problems(connection: Connection, participants: Mapping[str, Participant]) -> list[str]:
    """List the problems of one connection, one sentence each: existence first, then causality, shape, kind of numbers and unit."""
    problems: list[str] = []
    source = _find(connection, "source", connection.source, connection.source_variable, participants, problems)
    target = _find(connection, "target", connection.target, connection.target_variable, participants, problems)
    if source is not None and source.causality is not Causality.OUTPUT:
        problems.append(f"{connection}: source is {_KINDS[source.causality]}, allowed: output")
    if target is not None and target.causality is not Causality.INPUT:
        problems.append(f"{connection}: target is {_KINDS[target.causality]}, allowed: input")
    if source is not None and target is not None:
        if source.shape != target.shape:
            problems.append(f"{connection}: shape {source.shape} feeds shape {target.shape}, allowed: equal shapes")
        converted = _unit_conversion(source, target)
        if not source.numbers.fits(target.numbers):
            kinds = f"{source.numbers.value} numbers feed {target.numbers.value} ones"
            problems.append(f"{connection}: {kinds}, allowed: {_fitting(target.numbers)}")
        elif converted is not None and not converted.is_identity and target.numbers is not Numbers.REAL:
            units = f"{source.unit!r} to {target.unit!r}"
            problems.append(
                f"{connection}: {target.numbers.value} numbers are converted from {units}, allowed: one unit"
            )
        if converted is None:
            allowed = "equal units, or known units of the same dimension"
            problems.append(f"{connection}: unit {source.unit!r} feeds unit {target.unit!r}, allowed: {allowed}")
    return problems


def _fitting(taken: Numbers) -> str:
    return " or ".join(kind.value for kind in Numbers if kind.fits(taken))


def _unit_conversion(source: Variable, target: Variable) -> Conversion | None:
    """Return the conversion; None if the units do not fit: of different dimensions, or different in text and unknown."""
    known = source.known_unit, target.known_unit
    if known[0] is not None and known[1] is not None:
        return conversion(known[0], known[1])
    return Conversion() if source.unit == target.unit else None


def _find(
    connection: Connection,
    end: str,
    participant_name: str,
    variable_name: str,
    participants: Mapping[str, Participant],
    problems: list[str],
) -> Variable | None:
    """Find the variable at one end; if it does not exist, return None and add a sentence to `problems`."""
    participant = participants.get(participant_name)
    if participant is None:
        allowed = ", ".join(participants) or "none"
        problems.append(f"{connection}: {end} participant {participant_name!r} does not exist, allowed: {allowed}")
        return None
    variable = participant.variables.get(variable_name)
    if variable is None:
        allowed = ", ".join(participant.variables) or "none"
        problems.append(f"{connection}: {end} variable {variable_name!r} does not exist, allowed: {allowed}")
    return variable


def _doubly_fed(connections: Sequence[Connection], participants: Mapping[str, Participant]) -> list[str]:
    """List the inputs that more than one connection feeds, an element of an array also as a part of it."""
    feeders: dict[tuple[str, str], list[Connection]] = {}
    for connection in connections:
        feeders.setdefault((connection.target, connection.target_variable), []).append(connection)
    problems = [
        f"the input {target}:{variable} is fed by {len(several)} connections, allowed: one"
        for (target, variable), several in feeders.items()
        if len(several) > 1
    ]
    for target, variable in feeders:
        array = array_of(variable, participants[target].variables) if target in participants else None
        if array is not None and (target, array) in feeders:
            problems.append(
                f"the input {target}:{variable} is fed, and so is the array {target}:{array}, allowed: one of them"
            )
    return problems

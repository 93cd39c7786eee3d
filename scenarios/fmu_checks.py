"""FMUs and their connections, checked before anything is built: files, variables, causalities, units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from coupling.connection import Connection, connection_problems, setup_problems
from coupling.participant import Variable
from coupling.participants.fmu import FmuParticipant
from scenarios.fmus import PREFIX, SIGNALS, FmuSettings, connections_of
from scenarios.problems import Problem, problems_of, suggestion
from scenarios.signal_board import signal_variables
from scenarios.signals import Signal


@dataclass(frozen=True)
class _Declared:
    """Stands for the signals of a run that has not been built."""

    name: str
    variables: Mapping[str, Variable]


def fmu_problems(fmus: Mapping[str, FmuSettings], signals: Mapping[str, Signal]) -> Iterator[Problem]:
    """Everything that is wrong with the FMUs of a scenario."""
    loaded: dict[str, FmuParticipant] = {}
    for name, settings in fmus.items():
        try:
            loaded[PREFIX + name] = FmuParticipant(PREFIX + name, settings.file, settings.start)
        except (ValueError, OSError) as error:
            yield Problem(f"fmus.{name}", f"cannot be used: {error}")
    participants: dict[str, Any] = {SIGNALS: _Declared(SIGNALS, signal_variables(signals)), **loaded}
    connections = {}
    for path, connection in connections_of(fmus).items():
        ends = {connection.source, connection.target}
        if any(PREFIX + name in ends and PREFIX + name not in loaded for name in fmus):
            continue  # its FMU has been reported
        connections[path] = connection
        for text in connection_problems(connection, participants):
            yield Problem(path, f"does not fit: {_readable(text, connection, signals)}")
    yield from _doubly_driven(connections)


def _readable(text: str, connection: Connection, signals: Mapping[str, Signal]) -> str:
    """A connection's problem without what its path says already, and with a near signal where one was meant."""
    text = text.removeprefix(f"{connection}: ")
    for end, variable in (
        (connection.source, connection.source_variable),
        (connection.target, connection.target_variable),
    ):
        if end == SIGNALS and variable not in signals:
            hint = suggestion(variable, signals)
            return text.replace(", allowed:", f"{hint or ','} allowed:", 1)
    return text


def _doubly_driven(connections: Mapping[str, Connection]) -> Iterator[Problem]:
    """Signals that more than one FMU drives."""
    for text in setup_problems((), list(connections.values())):
        if "is fed" in text:
            yield Problem("fmus", f"drive a signal twice: {text}")


def fmu_participants(fmus: Mapping[str, FmuSettings]) -> tuple[FmuParticipant, ...]:
    """The FMUs, each of them tried out; ScenarioError for one that cannot run here, before anything is computed."""
    participants = []
    for name, settings in fmus.items():
        with problems_of(f"fmus.{name}", "cannot be used"):
            participants.append(FmuParticipant(PREFIX + name, settings.file, settings.start))
            participants[-1].rehearse()
    return tuple(participants)

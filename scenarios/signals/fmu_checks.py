"""FMUs and their connections, checked before anything is built: files, variables, causalities, units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from coupling.fmu.fmu_participant import FmuParticipant
from coupling.master.connection import Connection, connection_problems
from coupling.participant import Variable
from scenarios.problems import Problem, problems_of, suggestion
from scenarios.schema.fmu_settings import ORDER_BOARD, PREFIX, READING_BOARD, FmuSettings, connections_of
from scenarios.signals.signal_participant import signal_variables
from scenarios.signals.signal_table import Signal

SIGNALS_SHOWN = 12  # signals that an error names


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
            loaded[PREFIX + name] = FmuParticipant(PREFIX + name, settings.file, settings.start, settings.units)
        except (ValueError, OSError) as error:
            yield Problem(f"fmus.{name}", f"cannot be used: {error}")
    yield from _several_of_one(loaded)
    boards = {board: _Declared(board, signal_variables(signals)) for board in (ORDER_BOARD, READING_BOARD)}
    participants: dict[str, Any] = {**boards, **loaded}
    connections = {}
    for path, connection in connections_of(fmus).items():
        ends = {connection.source, connection.target}
        if any(PREFIX + name in ends and PREFIX + name not in loaded for name in fmus):
            continue  # its FMU has been reported
        connections[path] = connection
        unknown = _unknown_signal(connection, signals) or _unknown_fmu(connection, fmus)
        if unknown:
            yield Problem(path, unknown)
            continue
        for text in connection_problems(connection, participants):
            yield Problem(path, f"does not fit: {text.removeprefix(f'{connection}: ')}")
    yield from _doubly_driven(connections)


def _several_of_one(loaded: Mapping[str, FmuParticipant]) -> Iterator[Problem]:
    """FMUs that a process can run only once, and another runs already."""
    first: dict[str, str] = {}
    for name, fmu in loaded.items():
        other = first.setdefault(fmu.only_one_of, name)
        if fmu.only_one_of and other != name:
            text = (
                f"is the same FMU as {other}, which runs only once in a process (canBeInstantiatedOnlyOncePerProcess)"
            )
            yield Problem(name, f"{text}, allowed: one of them")


def _unknown_signal(connection: Connection, signals: Mapping[str, Signal]) -> str:
    """Find a connection to a signal that does not exist, and name those that may have been meant."""
    takes = connection.target == ORDER_BOARD
    name = connection.target_variable if takes else connection.source_variable
    if not (takes or connection.source == READING_BOARD) or name in signals:
        return ""
    fitting = [signal for signal, one in signals.items() if one.is_input == takes]
    place = name.rpartition(".")[0] + "."
    near = [signal for signal in fitting if signal.startswith(place)] or fitting
    shown = near[:SIGNALS_SHOWN] + (
        [f"... {len(near) - SIGNALS_SHOWN} more, see oilsim signals"] if len(near) > SIGNALS_SHOWN else []
    )
    direction = "that a run takes" if takes else "that a run gives"
    hint = suggestion(name, fitting) or ","
    return f"is {name!r}, which is no signal {direction}{hint} allowed: {', '.join(shown) or 'none is there'}"


def _unknown_fmu(connection: Connection, fmus: Mapping[str, FmuSettings]) -> str:
    """Find a connection from an FMU that does not exist."""
    name = connection.source.removeprefix(PREFIX)
    if connection.source == READING_BOARD or name in fmus:
        return ""
    return f"is from {connection.source!r}, which does not exist, allowed: {', '.join(PREFIX + one for one in fmus)}, a signal"


def _doubly_driven(connections: Mapping[str, Connection]) -> Iterator[Problem]:
    """Signals that more than one output drives."""
    drivers: dict[str, list[str]] = {}
    for path, connection in connections.items():
        if connection.target == ORDER_BOARD:
            drivers.setdefault(connection.target_variable, []).append(path)
    for signal, paths in drivers.items():
        if len(paths) > 1:
            yield Problem(paths[1], f"drives {signal!r}, which {paths[0]} drives already, allowed: one of them")


def all_are_kept(fmus: Mapping[str, FmuSettings]) -> bool:
    """Whether the state of every FMU can be kept outside it, and so that of the run; each of them is tried out."""
    return not any(_why_not_kept(fmu) for fmu in fmu_participants(fmus))


def _why_not_kept(fmu: FmuParticipant) -> str:
    """Say why, found by initializing it; of one that cannot be initialized by itself, its own words."""
    with suppress(RuntimeError):
        fmu.enter_initialization_mode(0.0)
        fmu.exit_initialization_mode()
    why = fmu.why_not_kept
    with suppress(Exception):  # nothing is lost with it
        fmu.terminate()
    return why


def fmu_participants(fmus: Mapping[str, FmuSettings]) -> tuple[FmuParticipant, ...]:
    """The FMUs, each of them tried out; ScenarioError for one that cannot run here, before anything is computed."""
    participants = []
    for name, settings in fmus.items():
        with problems_of(f"fmus.{name}", "cannot be used"):
            participants.append(FmuParticipant(PREFIX + name, settings.file, settings.start, settings.units))
            participants[-1].rehearse()
    return tuple(participants)

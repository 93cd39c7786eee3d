"""Checks of FMUs and their connections before anything is built: files, variables, causalities, units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from coupling.fmu.fmu_participant import FmuParticipant
from coupling.fmu.isolated_fmu import Fmu, fmu
from coupling.master.connection import Connection, connection_problems
from coupling.master.participant import Participant, array_of
from scenarios.controls.signals import Signal, signal_variables
from scenarios.schema.fmu_settings import ORDER_BOARD, PREFIX, READING_BOARD, FmuSettings, connections_of
from scenarios.text.problems import Problem, problems_of, suggestion

SIGNALS_SHOWN = 12  # signals that an error names


def fmu_problems(fmus: Mapping[str, FmuSettings], signals: Mapping[str, Signal]) -> Iterator[Problem]:
    """Yield every problem of a scenario's FMUs."""
    loaded: dict[str, FmuParticipant] = {}
    for name, settings in fmus.items():
        try:
            loaded[PREFIX + name] = FmuParticipant(PREFIX + name, settings.file, settings.start, settings.units)
        except (ValueError, OSError) as error:
            yield Problem(f"fmus.{name}", f"cannot be used: {error}")
    yield from _several_of_one(loaded)
    boards = {board: Participant(board, signal_variables(signals).values()) for board in (ORDER_BOARD, READING_BOARD)}
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
            yield Problem(path, f"cannot be made: {text.removeprefix(f'{connection}: ')}")
    yield from _doubly_driven(connections)
    yield from _doubly_fed(connections, loaded)


def _several_of_one(loaded: Mapping[str, FmuParticipant]) -> Iterator[Problem]:
    """Yield problems of FMUs that a process can run only once, if the scenario has them twice."""
    first: dict[str, str] = {}
    for name, one in loaded.items():
        other = first.setdefault(one.only_one_of, name)
        if one.only_one_of and other != name:
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
    direction = "input of the run" if takes else "output of the run"
    hint = suggestion(name, fitting) or ","
    return f"is {name!r}, which is no {direction}{hint} allowed: {', '.join(shown) or 'none is there'}"


def _unknown_fmu(connection: Connection, fmus: Mapping[str, FmuSettings]) -> str:
    """Find a connection from an FMU that does not exist."""
    name = connection.source.removeprefix(PREFIX)
    if connection.source == READING_BOARD or name in fmus:
        return ""
    return f"is from {connection.source!r}, which does not exist, allowed: {', '.join(PREFIX + one for one in fmus)}, a signal"


def _doubly_driven(connections: Mapping[str, Connection]) -> Iterator[Problem]:
    """Yield problems of signals that several outputs drive."""
    drivers: dict[str, list[str]] = {}
    for path, connection in connections.items():
        if connection.target == ORDER_BOARD:
            drivers.setdefault(connection.target_variable, []).append(path)
    for signal, paths in drivers.items():
        if len(paths) > 1:
            yield Problem(paths[1], f"drives {signal!r}, which {paths[0]} already drives; allowed: only one of them")


def _doubly_fed(connections: Mapping[str, Connection], loaded: Mapping[str, FmuParticipant]) -> Iterator[Problem]:
    """Yield inputs of an FMU that are fed by two of their names, or as an element of an array that is fed as a whole."""
    fed: dict[tuple[str, str], str] = {}
    for path, connection in connections.items():
        if connection.target in loaded:
            name = connection.target_variable
            first = fed.setdefault((connection.target, loaded[connection.target].other_names.get(name, name)), path)
            if first != path:
                yield Problem(path, f"feeds another name of what {first} feeds already, allowed: one of them")
    for (target, name), path in fed.items():
        array = array_of(name, loaded[target].variables)
        if array is not None and (target, array) in fed:
            yield Problem(path, f"feeds an element of what {fed[target, array]} feeds, allowed: one of them")


def all_are_kept(fmus: Mapping[str, FmuSettings]) -> bool:
    """Tell whether the state of every FMU, and so that of the run, can be saved outside it; this tries each FMU."""
    return not any(_why_not_kept(one) for one in fmu_participants(fmus))


def _why_not_kept(one: Fmu) -> str:
    """Say why, found by initializing it; of one that cannot be initialized by itself, its own words."""
    with suppress(RuntimeError):
        one.enter_initialization_mode(0.0)
        one.exit_initialization_mode()
    why = one.why_not_kept
    with suppress(Exception):  # nothing is lost with it
        one.terminate()
    return why


def fmu_participants(fmus: Mapping[str, FmuSettings]) -> tuple[Fmu, ...]:
    """Create the FMUs, each tried before; ScenarioError for one that cannot run here, before anything is computed."""
    participants = []
    for name, settings in fmus.items():
        with problems_of(f"fmus.{name}", "cannot be used"):
            participants.append(fmu(PREFIX + name, settings.file, settings.start, settings.units))
            participants[-1].rehearse()
    return tuple(participants)

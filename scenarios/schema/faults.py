"""Faults on purpose in a scenario: what fails when, so that a run's end, or its going on, can be tried."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from oilsim.quantity import quantity
from scenarios.problems import Problem, unknown
from scenarios.schema.fmu_settings import ORDER_BOARD, PREFIX, READING_BOARD
from scenarios.schema.parsing.quantity_fields import Section

ParticipantsFault = Literal[
    "early return", "discard", "error", "exception", "nan", "late", "wrong unit", "hang", "crash"
]


@dataclass(frozen=True, kw_only=True)
class ParticipantFault(Section):
    """A participant fails in the communication step that contains the time `at`.

    name   ``fluid``, ``bodies``, an FMU, such as ``fmus.winch``, or a vessel's helmsman, such as ``port-control``
    fault  "early return": it stops half way and is called again; "discard": it refuses a step of full length; "error": it cannot go on;
           "exception": it raises; "nan": its outputs are no numbers; "late": it says that it came further than asked; "wrong unit": its
           outputs are 1000 times too large from then on; "hang": an FMU's process never comes back, another participant stalls for half a
           second; "crash": an FMU's process dies
    at     [s] of the run
    """

    TAG: ClassVar[tuple[str, str]] = ("of", "participant")
    name: str
    fault: ParticipantsFault
    at: float = quantity("s", at_least=0.0)


@dataclass(frozen=True, kw_only=True)
class LineFault(Section):
    """A line or a joint parts, such as a mooring's leg, or the joint ``boom/main/joint-03`` of a boom.

    name   of the line or joint, as in the series ``tension/<name>``
    at     [s] of the run
    """

    TAG: ClassVar[tuple[str, str]] = ("of", "line")
    name: str
    at: float = quantity("s", at_least=0.0)


@dataclass(frozen=True, kw_only=True)
class ViewerFault(Section):
    """A viewer fails at the first frame at or after `at`, beside the run's own recorder and displays.

    fault  "exception": it raises, as a recorder does whose disk is full; "hang": it stalls for half a second
    at     [s] of the run
    """

    TAG: ClassVar[tuple[str, str]] = ("of", "viewer")
    fault: Literal["exception", "hang"]
    at: float = quantity("s", at_least=0.0)


FaultSettings = ParticipantFault | LineFault | ViewerFault


def fault_problems(
    faults: Mapping[str, FaultSettings], duration: float | None, participants: Collection[str]
) -> Iterator[Problem]:
    """Yield problems of faults that would never come in a run of `duration` [s], which has these `participants`."""
    for name, fault in faults.items():
        if isinstance(fault, ParticipantFault):
            yield from (problem.below(name) for problem in _participant_problems(fault, participants))
        if duration is not None and fault.at >= duration:
            yield Problem(
                f"{name}.at", f"is {fault.at:g} s, allowed: before the run's end, run.duration = {duration:g} s"
            )


def participants_of(names: Mapping[str, Collection[str]], *, has_particles: bool, has_wind: bool) -> tuple[str, ...]:
    """Name what may take part in a run with these entries by table; whether its bodies move, and its sea has oil, a run knows itself."""
    solids = any(names[table] for table in ("bodies", "vessels", "booms"))
    return (
        "fluid",
        *(["bodies"] if solids else []),
        *(["wind"] if solids and has_wind else []),
        *([] if has_particles else ["slick"]),
        *(f"{name}-control" for name in names["vessels"]),
        *(f"skimmers/{name}" for name in names["skimmers"]),
        *(PREFIX + name for name in names["fmus"]),
        *([ORDER_BOARD, READING_BOARD] if names["fmus"] else []),
    )


def line_fault_problems(faults: Mapping[str, FaultSettings], lines: Collection[str]) -> Iterator[Problem]:
    """Yield faults of lines and joints that a run with these `lines` does not have."""
    for name, fault in faults.items():
        if isinstance(fault, LineFault) and fault.name not in lines:
            text = f"is {fault.name!r}, which {unknown(fault.name, lines, 'line or joint of this run')}"
            yield Problem(f"faults.{name}.name", text)


def _participant_problems(fault: ParticipantFault, participants: Collection[str]) -> Iterator[Problem]:
    if fault.name not in participants:
        yield Problem(
            "name", f"is {fault.name!r}, which {unknown(fault.name, participants, 'participant of this run')}"
        )
    elif fault.fault == "crash" and not fault.name.startswith(PREFIX):
        fmus = [name for name in participants if name.startswith(PREFIX)]
        said = f"is 'crash' of {fault.name!r}, allowed: of an FMU, which has a process of its own"
        yield Problem("fault", f"{said}: {', '.join(fmus) or 'this scenario has none'}")

"""Faults on purpose in a scenario: what fails when, so that a run's end, or its going on, can be tried."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from oilsim.quantity import quantity
from scenarios.problems import Problem
from scenarios.schema.parsing.quantity_fields import Section

ParticipantsFault = Literal[
    "early return", "discard", "error", "exception", "nan", "late", "wrong unit", "hang", "crash"
]


@dataclass(frozen=True, kw_only=True)
class ParticipantFault(Section):
    """A participant fails in the communication step that contains the time `at`.

    name   ``fluid``, ``bodies``, the name of an FMU, or a vessel's helmsman, such as ``port-control``
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


def fault_problems(faults: Mapping[str, FaultSettings], duration: float | None) -> Iterator[Problem]:
    """Yield problems of faults that would never come in a run of `duration` [s]."""
    for name, fault in faults.items():
        if duration is not None and fault.at >= duration:
            yield Problem(
                f"{name}.at", f"is {fault.at:g} s, allowed: before the run's end, run.duration = {duration:g} s"
            )

"""Exceptions of coupled runs.

`UnresolvedSolidError` reports a solid that is too small for the particles. `CouplingSetupError` is raised before anything moves and lists
every problem at once. `CoSimulationError` is raised during a run and names the participant and the simulated time; its `__cause__` is the
exception that the failure comes from, if there is one.
"""

from __future__ import annotations

from collections.abc import Sequence


class CouplingSetupError(ValueError):
    """Participants and connections do not fit together; `problems` holds one sentence for each problem."""

    def __init__(self, problems: Sequence[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("; ".join(self.problems))


class UnresolvedSolidError(ValueError):
    """A solid is too small for the fluid's particles to resolve."""


class CoSimulationError(RuntimeError):
    """A participant failed: `participant` is its name, `time` [s] the simulated time at which its step began."""

    def __init__(self, participant: str, time: float, message: str) -> None:
        self.participant = participant
        self.time = time
        self.message = message
        super().__init__(f"participant {participant!r} failed at {time:.6g} s: {message}")


def reason(cause: BaseException) -> str:
    """Return an exception's message on one line, or the name of its type if the message is empty."""
    return " ".join(str(cause).split()) or type(cause).__name__

"""What can go wrong in a coupled run, as one exception a kind.

`UnresolvedSolidError` tells of a solid that particles cannot see. `CouplingSetupError` is raised before anything moves and
lists every problem at once. `CoSimulationError` is raised while the run goes on and names the participant and the simulated
time; it is chained from its cause.
"""

from __future__ import annotations

from collections.abc import Sequence


class CouplingSetupError(ValueError):
    """Participants and connections that do not fit together; `problems` holds one sentence each."""

    def __init__(self, problems: Sequence[str]) -> None:
        self.problems = tuple(problems)
        super().__init__("; ".join(self.problems))


class UnresolvedSolidError(ValueError):
    """A solid too small for the fluid's particles to see."""


class CoSimulationError(RuntimeError):
    """A participant failed: `participant` is its name, `time` the simulated time [s] its step began at."""

    def __init__(self, participant: str, time: float, message: str) -> None:
        self.participant = participant
        self.time = time
        self.message = message
        super().__init__(f"participant {participant!r} failed at {time:.6g} s: {message}")


def reason(cause: BaseException) -> str:
    """What an exception says, on one line."""
    return " ".join(str(cause).split()) or type(cause).__name__

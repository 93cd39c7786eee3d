"""In which order participants step and exchange values within one communication step.

Both are explicit (every participant steps once). With u_i the inputs and y_i the outputs of participant i at
communication point k, and c the connections:

    Jacobi        u(k) = c(y(k)) for all, then every participant steps: order does not matter
    Gauss-Seidel  participant i sees y(k+1) of those that stepped before it, y(k) of the others: order matters
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Protocol

from coupling.connection import Connection
from coupling.participant import Participant

StepParticipant = Callable[[Participant], None]


class Algorithm(Protocol):
    """One communication step."""

    def step(
        self, participants: Sequence[Participant], connections: Sequence[Connection], step_participant: StepParticipant
    ) -> None:
        """Transfer along every connection once and call `step_participant` once for every participant."""


class GaussSeidel:
    """Participants step in the given order, each fed with the newest outputs there are."""

    def step(
        self, participants: Sequence[Participant], connections: Sequence[Connection], step_participant: StepParticipant
    ) -> None:
        """See `Algorithm.step`."""
        by_name = {participant.name: participant for participant in participants}
        for participant in participants:
            transfer((c for c in connections if c.target == participant.name), by_name)
            step_participant(participant)


class Jacobi:
    """All inputs are taken at the communication point, then all participants step."""

    def step(
        self, participants: Sequence[Participant], connections: Sequence[Connection], step_participant: StepParticipant
    ) -> None:
        """See `Algorithm.step`."""
        transfer(connections, {participant.name: participant for participant in participants})
        for participant in participants:
            step_participant(participant)


def transfer(connections: Iterable[Connection], participants: Mapping[str, Participant]) -> None:
    """Carry the value of every connection from its output to its input."""
    for connection in connections:
        value = participants[connection.source].get(connection.source_variable)
        participants[connection.target].set(connection.target_variable, value)

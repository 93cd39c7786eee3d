"""Who may watch a run.

Contract:

1. `initialized(run)` once, before the first frame.
2. `step_completed(frame)` at every communication point, the initial one (index 0) included, in order of time; of a run that
   was restored, at every point after the one it goes on from.
3. `event(event)` at any moment between `initialized` and `terminated`.
4. `terminated(reason)` once, last, also after a failure.

An observer cannot change the run: what it is given is read-only for it. If it raises, the run ends in order: every
participant is terminated, the other observers are told, and the observer's exception goes on to the caller.
"""

from __future__ import annotations

from typing import Protocol

from recordings.frame import Event, Frame, RunDescription


class Observer(Protocol):
    """Watches a run; see the module's contract."""

    def initialized(self, run: RunDescription) -> None:
        """The run is about to begin."""

    def step_completed(self, frame: Frame) -> None:
        """A communication point was reached."""

    def event(self, event: Event) -> None:
        """Something worth a line in the log happened."""

    def terminated(self, reason: str) -> None:
        """The run is over; nothing follows."""

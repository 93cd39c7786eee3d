"""The interface of observers, which watch a run.

Contract:

1. `initialized(run)` once, before the first frame.
2. `step_completed(frame)` at every communication point, the initial one (index 0) included, in order of time; in a restored run, at every
   point after the restored one.
3. `event(event)` at any moment between `initialized` and `terminated`.
4. `terminated(reason)` once, last, also after a failure.

An observer cannot change the run: all that it receives is read-only. If it raises, the run ends in order: every participant is terminated,
the other observers are told, and the observer's exception reaches the caller.
"""

from __future__ import annotations

from typing import Protocol

from recordings.model.frame import Event, Frame, RunDescription


class Observer(Protocol):
    """Watches a run; see the module's contract."""

    def initialized(self, run: RunDescription) -> None:
        """Take note that the run `run` begins now."""

    def step_completed(self, frame: Frame) -> None:
        """Take the frame of the communication point that the run has reached."""

    def event(self, event: Event) -> None:
        """Take an event that deserves a line in the log."""

    def terminated(self, reason: str) -> None:
        """Take note that the run has ended, for `reason`; no call follows."""

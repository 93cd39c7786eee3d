"""Observers of a run: each one is told of its beginning, of events and frames, and of its end once.

An observer that raises, or is interrupted, is told nothing more and ends the run; the others are told why. None is told of the end of a
run whose beginning it has not been told.

The interface of observers, which watch a run.

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

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, Protocol

from coupling.master.errors import reason
from recordings.model.frame import Event, Frame, RunDescription


class Observer(Protocol):
    """Watches a run; see the module's contract. A class that derives from it does nothing in the methods that it leaves out."""

    def initialized(self, run: RunDescription) -> None:
        """Take note that the run `run` begins now."""
        return

    def step_completed(self, frame: Frame) -> None:
        """Take the frame of the communication point that the run has reached."""

    def event(self, event: Event) -> None:
        """Take an event that deserves a line in the log."""
        return

    def terminated(self, reason: str) -> None:
        """Take note that the run has ended, for `reason`; no call follows."""
        return


@dataclass(frozen=True)
class CommunicationPoint:
    """A time at which participants exchange values: `time` [s], after `index` whole steps of `step_size` [s] since the start."""

    index: int
    time: float
    step_size: float


FrameSource = Callable[[CommunicationPoint], Frame]


class Watching(NamedTuple):
    """The observers of a run, the source of the frames they are shown, and what they are told at its beginning.

    With observers both others are needed.
    """

    observers: Sequence[Observer] = ()
    frame_source: FrameSource | None = None
    run_description: RunDescription | None = None

    @property
    def problems(self) -> list[str]:
        """List everything that is missing, one sentence each."""
        lacks = self.observers and (self.frame_source is None or self.run_description is None)
        return ["observers watch, but frame_source or run_description is missing"] if lacks else []


NOBODY = Watching()


class Audience:
    """The observers of a run; `end_run` ends it for the given reason."""

    def __init__(self, observers: Sequence[Observer], end_run: Callable[[str], object]) -> None:
        self._observers, self._end_run = tuple(observers), end_run
        self._listening: tuple[Observer, ...] = ()  # those that have been told that the run begins

    @property
    def is_listening(self) -> bool:
        """True if an observer is listening."""
        return bool(self._listening)

    def begin(self, run: RunDescription) -> None:
        """Inform observers of the beginning."""
        for observer in self._observers:
            self._listening += (observer,)
            self._tell([observer], lambda one: one.initialized(run))

    def event(self, event: Event) -> None:
        """Inform observers of an event for the log."""
        self._tell(self._listening, lambda one: one.event(event))

    def frame(self, frame: Frame) -> None:
        """Inform observers of a frame."""
        self._tell(self._listening, lambda one: one.step_completed(frame))

    def end(self, events: Sequence[Event], reason: str) -> list[BaseException]:
        """Inform observers of the end, after `events` that they have not seen; return the exceptions that observers raise."""
        listening, self._listening = self._listening, ()
        calls = [partial(_tell_end, observer, events, reason) for observer in listening]
        return [error for error in tried(calls) if error is not None]

    def _tell(self, those: Iterable[Observer], call: Callable[[Observer], None]) -> None:
        for observer in those:
            try:
                call(observer)
            except BaseException as cause:
                self._listening = tuple(other for other in self._listening if other is not observer)
                self._end_run(f"the observer {type(observer).__name__} failed: {reason(cause)}")
                raise


def tried(calls: Iterable[Callable[[], None]]) -> list[BaseException | None]:
    """Make all calls, even if some of them raise; return the exception of each, or None."""
    raised: list[BaseException | None] = []
    for call in calls:
        try:
            call()
        except BaseException as error:
            raised.append(error)
        else:
            raised.append(None)
    return raised


def _tell_end(observer: Observer, events: Sequence[Event], reason: str) -> None:
    for event in events:
        observer.event(event)
    observer.terminated(reason)

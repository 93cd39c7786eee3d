"""The observers of a run: each is informed of the beginning, of events and frames, and once of the end.

An observer that raises, or is interrupted, is not informed any more and ends the run; the others get the reason. No observer is informed
of the end of a run whose beginning it has not seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

from coupling.errors import reason
from coupling.observer import Observer
from recordings.frame import Event, Frame, RunDescription


class Audience:
    """The observers of a run; `end_run` ends it for the given reason."""

    def __init__(self, observers: Sequence[Observer], end_run: Callable[[str], object]) -> None:
        self._observers, self._end_run = tuple(observers), end_run
        self._listening: tuple[Observer, ...] = ()  # observers that were informed of the beginning

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

"""The instructor of a run that goes on: gives orders, pauses it, lets it go on, and keeps it to the clock."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from recordings.model.frame import INSTRUCTOR
from scenarios.text.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from coupling.master.co_simulation import CoSimulation
    from scenarios.orders.desk import OrderDesk
    from scenarios.orders.protocol import Request
    from scenarios.running.pace import Pace

GLANCE = 0.1  # [s] between looks at whether a paused run is to stop
PAUSED, GOES_ON = "paused", "goes on"  # texts of events


class OrderedRun(Protocol):
    """A run at a communication point."""

    simulation: CoSimulation

    def order(self, settings: Sequence[str], by: str) -> None:
        """Give orders here and now, with `by` as their source; ScenarioError, and nothing given, if they are not allowed."""

    def mark(self, words: str) -> None:
        """Keep this moment under a name; ScenarioError if it cannot be kept."""

    def say(self, text: str) -> None:
        """Put a message between stations into the log."""

    def end(self) -> None:
        """Let the run end here, in order."""

    def take_requests(self) -> bool:
        """Do what POSIX signals ask for; return whether the run is to stop."""


class Instructor:
    """Gives a run the orders that come to its desk, and keeps its pace; each is None where it is not asked for."""

    def __init__(self, desk: OrderDesk | None, pace: Pace | None, *, pauses_at: float | None = None) -> None:
        self._desk, self._pace = desk, pace
        self._pauses_at = None if desk is None else pauses_at  # [s]
        self._is_paused = False
        self._steps = 0  # that a paused run makes before it waits again

    def attend(self, run: OrderedRun) -> None:
        """Answer the requests that wait; while the run is paused, wait for more, until it goes on or is to stop."""
        if self._desk is None:
            return
        if self._pauses_at is not None and run.simulation.communication_point.time >= self._pauses_at - 1e-9:
            self._pauses_at = None
            self._pause(run, True)
        for request in self._desk.requests:
            self._answer(request, run)
        if self._is_paused:
            self._hold(self._desk, run)

    def keep_time(self, run: OrderedRun, *, hears: bool) -> None:
        """Wait for the clock; if `hears`, requests that come meanwhile are answered here, as they come.

        A run that is on its way to the moment at which it is to pause has no clock.
        """
        if self._pace is None or self._pauses_at is not None:
            return

        def rest(seconds: float) -> bool:
            if not hears or self._desk is None:
                time.sleep(seconds)
            elif (request := self._desk.take(seconds)) is not None:
                self._answer(request, run)
            return run.take_requests() or self._is_paused

        told = self._pace.keep(run.simulation.communication_point.time, rest)
        if told:
            run.simulation.emit(told, level="warning", source="oilsim")

    def _hold(self, desk: OrderDesk, run: OrderedRun) -> None:
        """Stay at this communication point, and answer, until the run goes on, makes a step, or is to stop."""
        began = time.perf_counter()
        while self._is_paused and not self._steps and not run.take_requests():
            request = desk.take(GLANCE)
            if request is not None:
                self._answer(request, run)
        self._steps = max(0, self._steps - 1)
        if self._pace is not None:
            self._pace.wait(time.perf_counter() - began)

    def _answer(self, request: Request, run: OrderedRun) -> None:
        """Do what a request asks for, and say so; nothing that it asks for can end the run, but the request to end it."""
        try:
            told = self._done(request, run)
        except ScenarioError as error:
            request.refused([_to_sender(problem) for problem in error.problems])
            return
        request.told(told, run.simulation.communication_point.time)

    def _done(self, request: Request, run: OrderedRun) -> str:
        """Do what a request asks for; return what is to be told. ScenarioError if it cannot be done."""
        words = " ".join(request.settings)
        match request.kind:
            case "order":
                run.order(request.settings, request.by)
                return f"orders {words}"
            case "pause" | "go-on":
                return self._pause(run, request.kind == "pause")
            case "step":
                return self._step(run)
            case "pace":
                return self._change_pace(words)
            case "mark":
                run.mark(words)
                return f"marks {words}"
            case "say":
                run.say(words)
                return f"says {words}"
            case "end":
                run.end()
                return "ends"

    def _pause(self, run: OrderedRun, wanted: bool) -> str:
        """Let the run pause, or go on."""
        told = PAUSED if wanted else GOES_ON
        if not wanted:
            self._steps = 0  # the run makes them as it goes on; the next pause owes none
        if wanted != self._is_paused:
            self._is_paused = wanted
            run.simulation.emit(told, source=INSTRUCTOR)
        return told

    def _step(self, run: OrderedRun) -> str:
        """Let a run make one step, and pause."""
        self._pause(run, True)
        self._steps += 1
        return "makes a step"

    def _change_pace(self, words: str) -> str:
        """Change the simulated seconds a second; ScenarioError for a run that keeps none, and for what is no pace."""
        try:
            if self._pace is None:
                raise ValueError("this run keeps no pace, allowed: in a run that was started with one")
            self._pace.change(float(words))
        except ValueError as error:
            text = str(error) if "pace" in str(error) else f"is {words!r}, allowed: a number above 0, or inf"
            raise ScenarioError([Problem("pace", text)], "oilsim") from None
        return f"keeps the pace {words}"


def _to_sender(problem: Problem) -> Problem:
    """Return a problem of a setting as the sender of an order wrote it, without ``--set``."""
    return Problem(problem.path.removeprefix("--set").strip() or "order", problem.text)

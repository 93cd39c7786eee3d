"""The instructor of a run that goes on: gives orders, pauses it, lets it go on, and keeps it to the clock."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from scenarios.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from coupling.master.co_simulation import CoSimulation
    from scenarios.orders.desk import OrderDesk
    from scenarios.orders.messages import Request
    from scenarios.running.pace import Pace

GLANCE = 0.1  # [s] between looks at whether a paused run is to stop


class OrderedRun(Protocol):
    """A run at a communication point."""

    simulation: CoSimulation

    def order(self, settings: Sequence[str]) -> None:
        """Give orders here and now; ScenarioError, and nothing given, if they are not allowed."""

    def take_requests(self) -> bool:
        """Do what POSIX signals ask for; return whether that is to stop."""


class Instructor:
    """Gives a run the orders that come to its desk, and keeps its pace; each is None where it is not asked for."""

    def __init__(self, desk: OrderDesk | None, pace: Pace | None) -> None:
        self._desk, self._pace = desk, pace
        self._is_paused = False

    def attend(self, run: OrderedRun) -> None:
        """Answer the requests that wait; while the run is paused, wait for more, until it goes on or is to stop."""
        if self._desk is None or self._desk.is_empty:
            return
        for request in self._desk.requests:
            self._answer(request, run)
        if self._is_paused:
            self._hold(self._desk, run)

    def keep_time(self, run: OrderedRun) -> None:
        """Wait for the clock."""
        if self._pace is not None:
            told = self._pace.keep(run.simulation.communication_point.time, run.take_requests)
            if told:
                run.simulation.emit(told, level="warning", source="oilsim")

    def _hold(self, desk: OrderDesk, run: OrderedRun) -> None:
        """Stay at this communication point, and answer, until the run goes on or is to stop."""
        began = time.perf_counter()
        while self._is_paused and not run.take_requests():
            request = desk.take(GLANCE)
            if request is not None:
                self._answer(request, run)
        if self._pace is not None:
            self._pace.wait(time.perf_counter() - began)

    def _answer(self, request: Request, run: OrderedRun) -> None:
        """Do what a request asks for, and say so; nothing that it asks for can end the run."""
        point = run.simulation.communication_point
        if request.kind == "order":
            try:
                run.order(request.settings)
            except ScenarioError as error:
                request.refused([_to_sender(problem) for problem in error.problems])
                return
            request.told(f"orders {' '.join(request.settings)}", point.time)
            return
        wants_pause = request.kind == "pause"
        told = "paused" if wants_pause else "goes on"
        if wants_pause != self._is_paused:
            self._is_paused = wants_pause
            run.simulation.emit(told, source="instructor")
        request.told(told, point.time)


def _to_sender(problem: Problem) -> Problem:
    """Return a problem of a setting as the sender of an order wrote it, without ``--set``."""
    return Problem(problem.path.removeprefix("--set").strip() or "order", problem.text)

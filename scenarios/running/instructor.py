"""The instructor of a run that goes on: gives orders, pauses it, lets it go on, and keeps it to the clock.

The run waits for the clock, so that a simulated second takes a second, or as many as asked for: its pace. With p the pace, a communication
point at t is due at the wall time T_0 + (t - t_0) / p; it lags by the wall time at which the run has reached it less that. A run that is
early waits. One that is late goes on at once and catches up, but only `MOST_BEHIND`: beyond that, the clock is set back, because a run that
has been slow for a minute must not race through the next one. The summary tells by how much it was set back.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from recordings.model.frame import INSTRUCTOR
from scenarios.text.problems import Problem, ScenarioError

if TYPE_CHECKING:
    from coupling.master.co_simulation import CoSimulation
    from scenarios.orders.desk import OrderDesk
    from scenarios.orders.protocol import Request

MOST = 2000  # values; even, so that the next one is due where every second was given up


class EvenSample:
    """Keeps all values of a series or, once they are more than MOST, every second one, every fourth, and so on."""

    def __init__(self) -> None:
        self.values: list[float] = []
        self._stride, self._seen = 1, 0

    def append(self, value: float) -> None:
        """Add the next value, if it is due."""
        if self._seen % self._stride == 0:
            if len(self.values) == MOST:
                del self.values[1::2]
                self._stride *= 2
            self.values.append(value)
        self._seen += 1

    def save_state(self) -> dict[str, Any]:
        """Return the values that are kept, bit for bit."""
        return {"values": np.array(self.values, np.float64), "stride": self._stride, "seen": self._seen}

    @classmethod
    def restored(cls, saved: Mapping[str, Any]) -> EvenSample:
        """Create a sample from the data of `save_state`; ValueError for data that no sample has."""
        values, stride, seen = saved["values"], saved["stride"], saved["seen"]
        if not stride >= 1 or np.shape(values) != (-(-seen // stride),):
            shape = np.shape(values)
            raise ValueError(f"a series of {seen} values, one of {stride} kept, has a sample of shape {shape}")
        sample = cls()
        sample.values, sample._stride, sample._seen = values.tolist(), stride, seen
        return sample


MOST_BEHIND = 1.0  # [s] that a late run catches up
ENOUGH = 0.05  # [s] of lag that 95 % of the steps stay below where the machine keeps the pace
GLANCE = 0.1  # [s] between looks at whether to stop


class Pace:
    """The clock of a run that makes `pace` simulated seconds a second; ValueError unless that is above 0.

    With the pace infinity, the run goes as fast as it can.
    """

    def __init__(self, pace: float) -> None:
        self._lags = EvenSample()
        self._longest = self._set_back = 0.0
        self.change(pace)

    @property
    def pace(self) -> float:
        """Simulated seconds a second, as asked for."""
        return self._pace

    @property
    def lag(self) -> float:
        """Wall time [s] by which the last communication point lagged behind the clock."""
        return self._lag

    @property
    def set_back(self) -> float:
        """Wall time [s] by which the clock was set back so far."""
        return self._set_back

    def change(self, pace: float) -> None:
        """Make `pace` simulated seconds a second from the next communication point on; ValueError unless that is above 0."""
        if not pace > 0.0:
            raise ValueError(f"the pace is {pace}, allowed: above 0")
        self._pace = pace
        self._origin: float | None = None  # wall time [s] at which simulated time 0 would be due
        self._lag = 0.0
        self._is_behind = False

    def keep(self, simulated: float, rest: Callable[[float], bool]) -> str:
        """Wait until a communication point at `simulated` [s] is due; return what is to be told, mostly nothing.

        `rest` waits for up to so many seconds, and returns whether to wait no more. It may change the pace.
        """
        if self._origin is None:
            self._origin = time.perf_counter() - simulated / self._pace
        while (early := self._due(simulated) - time.perf_counter()) > 0.0:
            if rest(min(early, GLANCE)):
                return ""
        return self._note(time.perf_counter() - self._due(simulated))

    def _due(self, simulated: float) -> float:
        """Return the wall time [s] at which a communication point is due; now, if the clock begins with it."""
        now = time.perf_counter()
        return now if self._origin is None else self._origin + simulated / self._pace

    def _note(self, lag: float) -> str:
        """Take the lag [s] of a communication point into the figures, and set the clock back if it is too much; return what to tell."""
        if not np.isfinite(self._pace):
            return ""
        self._lag = max(0.0, lag)
        self._lags.append(self._lag)
        self._longest = max(self._longest, self._lag)
        if lag <= MOST_BEHIND or self._origin is None:
            return ""
        self._origin += lag
        self._set_back += lag
        if self._is_behind:
            return ""
        self._is_behind = True
        return f"cannot keep the pace {self._pace:g}: {lag:.1f} s behind the clock, which is set back; the summary tells by how much"

    def wait(self, seconds: float) -> None:
        """Leave out a pause of that many seconds."""
        if self._origin is not None:
            self._origin += seconds

    def figures(self) -> dict[str, Any]:
        """Return the lag [ms] of the communication points behind the clock, and by how much [s] that was set back."""
        lags = np.array(self._lags.values) if len(self._lags.values) else np.zeros(1)
        p95 = float(np.percentile(lags, 95.0))
        return {
            "pace": self._pace if np.isfinite(self._pace) else None,
            "lag_ms": {"median": 1e3 * float(np.median(lags)), "p95": 1e3 * p95, "max": 1e3 * self._longest},
            "set_back_s": self._set_back,
            "kept": p95 < ENOUGH and self._set_back == 0.0,
        }


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

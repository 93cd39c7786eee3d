"""The progress of a run: a bar on a terminal, a line every few seconds elsewhere."""

from __future__ import annotations

import time as wall_clock
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from coupling.master.observer_dispatch import Observer
from recordings.model.frame import Event, Frame, RunDescription

SECONDS_BETWEEN_LINES = 5.0
MEMORY = 30.0  # [s] of wall time over which the speed is averaged


class ProgressDisplay(Observer):
    """An observer that shows simulated time, real-time factor and the time left."""

    def __init__(self, name: str, duration: float, console: Console) -> None:
        """Prepare the display; `duration` [s] is the simulated time at which the run ends."""
        self._name = name
        self._duration = duration
        self._console = console
        self._marks: list[tuple[float, float]] = []  # wall and simulated time, over the last MEMORY seconds
        self._last_line = wall_clock.monotonic()
        self._bar: Progress | None = None
        if console.is_terminal:
            self._bar = Progress(
                TextColumn("{task.description}", style="bold", markup=False),
                BarColumn(),
                TaskProgressColumn(),
                TextColumn("{task.fields[state]}", markup=False),
                console=console,
            )
            self._task = self._bar.add_task(name, total=duration, state="starting")

    def __enter__(self) -> ProgressDisplay:
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def initialized(self, run: RunDescription) -> None:
        """Start the clock."""
        self._marks = []

    def step_completed(self, frame: Frame) -> None:
        """Move the bar, or write a line if the last one is old enough."""
        now = wall_clock.monotonic()
        self._marks.append((now, frame.time))
        while len(self._marks) > 2 and now - self._marks[0][0] > MEMORY:
            self._marks.pop(0)
        if self._bar is not None:
            self._bar.update(self._task, completed=frame.time, state=self._state(frame.time))
        elif now - self._last_line >= SECONDS_BETWEEN_LINES:
            self._last_line = now
            share = 100.0 * min(1.0, frame.time / self._duration)
            self._console.print(
                f"{self._name}: {share:.0f} %, {self._state(frame.time)}", highlight=False, markup=False
            )

    def event(self, event: Event) -> None:
        """Show the event above the bar."""
        line = f"{event.time:.2f} s  {event.level}: {event.text}"
        self._console.print(line, highlight=False, markup=False, soft_wrap=True)

    def _state(self, time: float) -> str:
        """Write simulated time, real-time factor and time left."""
        (first_wall, first_time), (last_wall, last_time) = self._marks[0], self._marks[-1]
        text = f"{time:.2f} of {self._duration:g} s simulated"
        if last_wall - first_wall < 0.5 or last_time <= first_time:
            return text
        speed = (last_time - first_time) / (last_wall - first_wall)
        left = max(0.0, self._duration - time) / speed
        return f"{text}, {speed:.2g} x real time, {clock(left)} left"


def clock(seconds: float) -> str:
    """Write a time [s] as minutes and seconds, or hours and minutes."""
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60}:{whole % 60:02d}"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"

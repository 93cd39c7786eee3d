"""The progress of a run: a bar on a terminal, a line every few seconds elsewhere."""

from __future__ import annotations

import time as wall_clock
from contextlib import ExitStack
from types import TracebackType

from numba.core.event import Event as NumbaEvent
from numba.core.event import Listener, install_listener
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from coupling.master.observer_dispatch import Observer
from recordings.model.frame import Event, Frame, RunDescription

SECONDS_BETWEEN_LINES = 5.0
MEMORY = 30.0  # [s] of wall time over which the speed is averaged


class Compilation(Listener):
    """Tells once that kernels are compiled, as in the first run of a version, and counts the `seconds` of wall time that it takes."""

    def __init__(self, name: str, console: Console) -> None:
        """Prepare to tell it of the run `name`; entered, it listens."""
        self._name, self._console = name, console
        self._depth = 0  # compilations under way; only one thread at a time compiles
        self._begin = 0.0
        self._stack = ExitStack()
        self.seconds = 0.0

    def __enter__(self) -> Compilation:
        self._stack.enter_context(install_listener("numba:compile", self))
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def on_start(self, event: NumbaEvent) -> None:
        """Begin to count at the first of nested compilations."""
        if self._depth == 0:
            self._begin = wall_clock.monotonic()
            if not self.seconds:
                told = f"{self._name}: compiling kernels, once for each version of their source"
                self._console.print(told, highlight=False, markup=False)
        self._depth += 1

    def on_end(self, event: NumbaEvent) -> None:
        """Count the time after the last of nested compilations."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += wall_clock.monotonic() - self._begin


class ProgressDisplay(Observer):
    """An observer that shows simulated time, real-time factor and the time left."""

    def __init__(self, name: str, duration: float, console: Console, compilation: Compilation | None = None) -> None:
        """Prepare the display; `duration` [s] is the simulated time at which the run ends.

        The time of a `compilation` counts neither as the run's speed nor as time left.
        """
        self._compilation = compilation
        self._name = name
        self._duration = duration
        self._console = console
        self._marks: list[
            tuple[float, float]
        ] = []  # wall, less what compiling took, and simulated time, over the last MEMORY seconds
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
        self._marks.append((now - (self._compilation.seconds if self._compilation else 0.0), frame.time))
        while len(self._marks) > 2 and self._marks[-1][0] - self._marks[0][0] > MEMORY:
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

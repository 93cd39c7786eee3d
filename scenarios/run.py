"""One run from start to end: built, watched, stopped in order whatever happens, and summed up."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from rich.console import Console
from rich.table import Table

from coupling.co_simulation import CoSimulation
from coupling.errors import CoSimulationError
from coupling.observer import Observer
from recordings.errors import RecordingError
from scenarios.build import Assembly, build
from scenarios.problems import Problem, ScenarioError
from scenarios.progress import ProgressDisplay
from scenarios.scenario import Scenario
from scenarios.summary import SummaryObserver, write_summary

DONE, FAILED = 0, 1


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """What a run leaves behind: recording, summary and picture files, each or none; and whether it is shown live.

    overrides: texts that changed the scenario, for the record.
    """

    record: Path | None = None
    summary: Path | None = None
    picture: Path | None = None
    live: bool = False
    overrides: tuple[str, ...] = ()


class StopRequest:
    """Whether somebody asked the run to stop: Ctrl-C or SIGTERM, by its signal number."""

    def __init__(self) -> None:
        self.signal: int | None = None

    @property
    def exit_code(self) -> int:
        """As a shell counts it: 130 after Ctrl-C, 143 after SIGTERM."""
        return DONE if self.signal is None else 128 + self.signal


@contextmanager
def stop_requests() -> Iterator[StopRequest]:
    """Within the block the first signal asks for an orderly stop, a second one ends the program at once.

    Outside the main thread signals cannot be caught; nothing is asked there.
    """
    request = StopRequest()
    if threading.current_thread() is not threading.main_thread():
        yield request
        return
    previous: dict[int, Any] = {}

    def ask(number: int, _: FrameType | None) -> None:
        request.signal = number
        for caught, handler in previous.items():
            signal.signal(caught, handler)

    for number in (int(signal.SIGINT), int(signal.SIGTERM)):
        previous[number] = signal.signal(number, ask)
    try:
        yield request
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def run_scenario(
    scenario: Scenario, *, text: str = "", options: RunOptions | None = None, console: Console | None = None
) -> int:
    """Run a scenario to its end; returns the exit code of the `oilsim` command.

    ScenarioError for what cannot be built, RecordingError for a recording that cannot be begun.
    A failed or stopped run keeps its recording and its summary.
    """
    options = options or RunOptions()
    console = console or Console(stderr=True)
    _require_writable(options)
    recorders = _recorders(scenario, options)
    with stop_requests() as request:
        console.print(f"building {scenario.name}", highlight=False)
        assembly = build(scenario, text=text, overrides=options.overrides)
        summary = SummaryObserver(assembly)
        with ProgressDisplay(scenario.name, scenario.run.duration, console) as progress:
            observers: list[Observer] = [summary, progress, *recorders]
            simulation = assembly.co_simulation(observers)
            error = _advance(simulation, assembly, request)
    result = summary.summary(simulation.communication_point.time, options.overrides)
    if options.summary is not None:
        write_summary(result, options.summary)
    _print_result(console, result, options)
    if error is not None:
        console.print(f"oilsim: {error}", style="red", highlight=False, markup=False)
        return FAILED
    if options.picture is not None and options.record is not None:
        _draw(options.record, options.picture)
    return request.exit_code


def _advance(simulation: CoSimulation, assembly: Assembly, request: StopRequest) -> Exception | None:
    """Step until the end, a stop or a failure; the simulation is terminated in each case."""
    try:
        simulation.initialize()
        run = assembly.scenario.run
        almost = run.duration - 1e-6 * run.communication_step
        while simulation.is_running and request.signal is None and simulation.communication_point.time < almost:
            simulation.step()
            for text in assembly.scoring.take_events() if simulation.is_running else ():
                simulation.emit(text, level="warning", source="boom")
        simulation.terminate("completed" if request.signal is None else f"stopped by signal {request.signal}")
    except (CoSimulationError, RecordingError) as error:
        return error
    return None


def _recorders(scenario: Scenario, options: RunOptions) -> list[Observer]:
    """The recorder, if the run is recorded; a run that is not must not load the recording library."""
    if options.record is None:
        return []
    from recordings.recorder import Recorder

    live = None
    if options.live:
        from recordings.live import LiveView

        live = LiveView()
    return [Recorder(options.record, scenario.recording.frame_rate, live=live)]


def _require_writable(options: RunOptions) -> None:
    """Find out before the run, not after, that a result could not be written."""
    problems = []
    for name in ("record", "summary", "picture"):
        path: Path | None = getattr(options, name)
        if path is not None and not path.absolute().parent.is_dir():
            problems.append(Problem(f"--{name}", f"is {str(path)!r}, allowed: a file in a folder that exists"))
        elif path is not None and path.is_dir():
            problems.append(Problem(f"--{name}", f"is {str(path)!r}, a folder, allowed: a file"))
    if problems:
        raise ScenarioError(problems, "oilsim")


def _draw(recording: Path, picture: Path) -> None:
    from recordings.picture import draw_picture

    draw_picture(recording, picture)


def _print_result(console: Console, result: dict[str, Any], options: RunOptions) -> None:
    """A closing table: what was run, how fast, and where the results are."""
    table = Table(show_header=False)
    table.add_column(style="bold")
    table.add_column()
    table.add_row("ended", result["ended"])
    factor = result["real_time_factor"]
    speed = f" ({factor:.2g} x real time)" if factor else ""
    table.add_row("simulated", f"{result['simulated_s']:g} s in {result['wall_s']:.1f} s{speed}")
    if result["step_ms"]["median"] is not None:
        times = result["step_ms"]
        table.add_row("a step", f"median {times['median']:.1f} ms, 95 % under {times['p95']:.1f} ms")
        table.add_row("density error", f"mean {100 * result['density_error']['mean']:.3f} %")
    table.add_row("particles", ", ".join(f"{name} {count:,}" for name, count in result["particles"].items()))
    if result["left_the_tank"]:
        table.add_row(
            "left the tank", ", ".join(f"{name} {count:,}" for name, count in result["left_the_tank"].items())
        )
    lost = result["oil_m3"]["lost"]
    if result["oil_m3"]["released"]:
        gone = ", ".join(f"{cause} {1e3 * volume:.1f} l" for cause, volume in lost.items() if volume)
        table.add_row(
            "oil", f"released {1e3 * result['oil_m3']['released']:.1f} l" + (f"; lost: {gone}" if gone else "")
        )
    for name in ("record", "summary", "picture"):
        path = getattr(options, name)
        if path is not None:
            table.add_row(name, str(path))
    console.print(table)

"""One run from start to end: built, watched, stopped in order whatever happens, and summed up."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from recordings.errors import RecordingError
from recordings.files import RECORDING_ENDING, held, why_unwritable
from scenarios.exit_codes import FAILED
from scenarios.problems import Problem, ScenarioError
from scenarios.running.assembly import Assembly, build
from scenarios.running.checkpoints import Restart, checkpoint_folder, checkpoint_writer
from scenarios.running.output_paths import require_apart
from scenarios.running.plan import Plan
from scenarios.running.recorder_options import grid, thinning
from scenarios.running.run_loop import RunLoop
from scenarios.running.run_requests import requests_by_posix_signal
from scenarios.running.summary import SummaryObserver, write_summary
from scenarios.scenario import Scenario
from scenarios.text.terminal import terminal
from scenarios.watch.progress import ProgressDisplay

if TYPE_CHECKING:
    from recordings.sink.recorder import Recorder

_PICTURE_ENDINGS = (".png", ".jpg", ".pdf", ".svg")  # of what matplotlib draws, what is of use


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Files that a run leaves behind: recording, summary and picture, each or none; and whether it is shown live.

    checkpoints: folder for them; by default that of the recording, and none without a recording.
    source: the scenario's file, which none of them may be.
    """

    record: Path | None = None
    checkpoints: Path | None = None
    summary: Path | None = None
    picture: Path | None = None
    live: bool = False
    source: Path | None = None

    @property
    def checkpoint_folder(self) -> Path | None:
        """Where checkpoints go, if anywhere."""
        return checkpoint_folder(self.record) if self.checkpoints is None and self.record else self.checkpoints


def run_scenario(
    scenario: Scenario,
    *,
    text: str = "",
    overrides: tuple[str, ...] = (),
    options: RunOptions | None = None,
    console: Console | None = None,
) -> int:
    """Run a scenario to its end; returns the exit code of the `oilsim` command.

    `text` is the scenario file's, `overrides` the changes made to it; both only go into the recording and the summary.
    ScenarioError for what cannot be built, RecordingError for a recording that cannot be begun.
    A failed or stopped run keeps its recording, its checkpoints and its summary.
    """
    plan = Plan(scenario=scenario, text=text, overrides=overrides)
    return _run(plan, None, options or RunOptions(), console or terminal(stderr=True))


def resume(restart: Restart, *, options: RunOptions | None = None, console: Console | None = None) -> int:
    """Go on with a run from a checkpoint to its end, into files of its own; otherwise as `run_scenario`."""
    options, console = options or RunOptions(), console or terminal(stderr=True)
    if restart.warning:
        console.print(f"oilsim: {restart.source} {restart.warning}", style="yellow", highlight=False, markup=False)
    return _run(restart.plan, restart, options, console)


def _run(plan: Plan, restart: Restart | None, options: RunOptions, console: Console) -> int:
    scenario = plan.scenario
    _require_writable(options)
    _require_own_files(plan, restart, options)
    with ExitStack() as stack, requests_by_posix_signal() as requests:
        if options.record is not None:
            stack.enter_context(held(options.record))
        recorder = _recorder(scenario, options)
        console.print(f"building {scenario.name}", highlight=False, markup=False)
        assembly = _with_plan(build(scenario, text=plan.text, overrides=plan.changes), plan)
        summary = SummaryObserver(assembly)
        folder = options.checkpoint_folder
        checkpoints = None if folder is None else stack.enter_context(checkpoint_writer(folder, plan))
        with ProgressDisplay(scenario.name, scenario.run.duration, console) as progress:
            loop = RunLoop(
                plan,
                assembly,
                assembly.co_simulation([summary, progress, *([recorder] if recorder else [])]),
                requests=requests,
                keepers={"summary": summary} | ({"recorder": recorder} if recorder else {}),
                checkpoints=checkpoints,
            )
            error = loop.run(restart)
    summary.state_hash = loop.state_hash
    result = summary.summary(loop.simulation.communication_point.time, plan.changes)
    _print_result(console, result, options)
    failures = [*([] if error is None else [str(error)]), *_leave(result, options, drawn=error is None)]
    for failure in failures:
        console.print(f"oilsim: {failure}", style="red", highlight=False, markup=False)
    return FAILED if failures else requests.exit_code


def _leave(result: dict[str, Any], options: RunOptions, *, drawn: bool) -> Iterator[str]:
    """Write the summary and, if it is to be `drawn`, the picture; tells of each that could not be written, and why."""
    try:
        if options.summary is not None:
            write_summary(result, options.summary)
    except OSError as error:
        yield f"summary {options.summary}: cannot be written: {error.strerror or error}"
    try:
        if drawn and options.picture is not None and options.record is not None:
            _draw(options.record, options.picture)
    except (OSError, RecordingError) as error:
        yield f"picture {options.picture}: cannot be drawn: {error}"


def _with_plan(assembly: Assembly, plan: Plan) -> Assembly:
    """The assembly with a description that says all that is needed to run the plan again."""
    properties = dict(assembly.description.properties) | {"plan": json.dumps(plan.as_data())}
    return replace(assembly, description=replace(assembly.description, properties=properties))


def _recorder(scenario: Scenario, options: RunOptions) -> Recorder | None:
    """The recorder, if the run is recorded; a run that is not must not load the recording library."""
    if options.record is None:
        return None
    from recordings.sink.recorder import Recorder

    live = None
    if options.live:
        from recordings.sink.live import LiveView

        live = LiveView()
    return Recorder(
        options.record,
        scenario.recording.frame_rate,
        precision=grid(scenario),
        every=thinning(scenario),
        live=live,
    )


def _require_writable(options: RunOptions) -> None:
    """Find out before the run, not after, that a result could not be written."""
    problems = []
    endings = {"record": (RECORDING_ENDING,), "picture": _PICTURE_ENDINGS}
    for name in ("record", "summary", "picture"):
        path: Path | None = getattr(options, name)
        if path is None:
            continue
        reason = why_unwritable(path)
        if reason:
            text = f"is {str(path)!r}, which cannot be written: {reason}, allowed: a file in a folder that exists"
            problems.append(Problem(f"--{name}", text))
        elif name in endings and path.suffix not in endings[name]:
            allowed = " or ".join(endings[name])
            problems.append(Problem(f"--{name}", f"is {str(path)!r}, allowed: a name that ends in {allowed}"))
    if problems:
        raise ScenarioError(problems, "oilsim")


def _require_own_files(plan: Plan, restart: Restart | None, options: RunOptions) -> None:
    """Nothing is written over what the run is made of or goes on from, nor over anything else that it leaves."""
    read = plan.files | ({} if restart is None else restart.files)
    if options.source is not None:
        read["the scenario"] = options.source
    written = {f"--{name}": getattr(options, name) for name in ("record", "summary", "picture")}
    require_apart(read, written | {"--checkpoints": options.checkpoint_folder})


def _draw(recording: Path, picture: Path) -> None:
    from recordings.pictures.picture import draw_picture

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

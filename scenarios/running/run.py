"""A run from start to end: it is built, observed, ended properly in all cases, and summarized."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from recordings.files.writing import RECORDING_ENDING, RecordingError, held
from recordings.model.sample import grid_within
from recordings.model.words import cause_in_words, volume_in_words
from scenarios.running.assembly import Assembly, build
from scenarios.running.checkpoints import Restart, checkpoint_writer
from scenarios.running.instructor import Instructor, Pace
from scenarios.running.output_paths import already_there, checkpoint_folder, require_apart, unwritable
from scenarios.running.plan import Plan
from scenarios.running.run_loop import RunLoop
from scenarios.running.run_requests import requests_by_posix_signal
from scenarios.running.summary import SummaryObserver, write_summary
from scenarios.schema.liquid import PhaseSettings
from scenarios.setup.cost import require_memory
from scenarios.spec.resolve import RunSpec, numbered, resolve
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import FAILED, Problem, ScenarioError
from scenarios.text.terminal import terminal
from scenarios.watch.progress import Compilation, ProgressDisplay

if TYPE_CHECKING:
    from coupling.master.observer_dispatch import Observer
    from recordings.sink.live import LiveView
    from recordings.sink.recorder import Recorder
    from scenarios.orders.desk import OrderDesk


_PICTURE_ENDINGS = (".png", ".jpg", ".pdf", ".svg")  # of what matplotlib draws, what is of use
FINE = 32  # fewest grid cells in a particle spacing
THINNED = 2  # frames for one frame with water, in a scenario with oil
# [1/s] frames with the surface of a sea by formulas; chosen; enough for long waves, at 1 % of a second's time, 4 % with a window
SEA_RATE = 2.5
# [1] frames with the surface for one frame, in a tank; chosen
SURFACED = 0.5


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Files that a run leaves behind: recording, summary and picture, each or none; and whether it is shown live, and in which viewer.

    checkpoints: folder for them; by default that of the recording, and none without a recording.
    overwrite: whether they may replace files that are there. source: the scenario's file, which none of them may be.
    takes_orders: whether `oilsim order` reaches the run while it goes on; pace: simulated seconds a second, None as fast as it can, or a
    clock that others watch too. pauses_at: [s] where the run waits for the order to go on, to which it hurries; None: nowhere. watchers:
    whoever else watches the run, each made for it.
    """

    record: Path | None = None
    checkpoints: Path | None = None
    summary: Path | None = None
    picture: Path | None = None
    live: bool | LiveView = False
    overwrite: bool = False
    source: Path | None = None
    takes_orders: bool = False
    pace: float | Pace | None = None
    pauses_at: float | None = None
    watchers: tuple[Callable[[Assembly], Observer], ...] = ()

    @property
    def checkpoint_folder(self) -> Path | None:
        """Folder for checkpoints; None if there are none."""
        return checkpoint_folder(self.record) if self.checkpoints is None and self.record else self.checkpoints


def run_scenario(
    scenario: Scenario,
    *,
    text: str = "",
    overrides: tuple[str, ...] = (),
    orders: Sequence[tuple[float, Sequence[str]]] = (),
    options: RunOptions | None = None,
    console: Console | None = None,
) -> int:
    """Run a scenario to its end; return the exit code of the `oilsim` command.

    `text` is that of the scenario file, `overrides` are the changes made to it; both only go into the recording and the summary. `orders`
    are times [s] and settings, as for `oilsim order`, that are given then. Raises ScenarioError for what cannot be built or ordered, and
    RecordingError for a recording that cannot be started. A run that failed or was stopped keeps its recording, checkpoints and summary.
    """
    plan = Plan(scenario=numbered(scenario), text=text, overrides=overrides)
    for time, settings in orders:
        plan = plan.ordered(settings, round(time / scenario.run.communication_step))
    return _run(plan, None, options or RunOptions(), console or terminal(stderr=True))


def resume(restart: Restart, *, options: RunOptions | None = None, console: Console | None = None) -> int:
    """Continue a run from a checkpoint to its end, into new files; otherwise the same as `run_scenario`."""
    options, console = options or RunOptions(), console or terminal(stderr=True)
    if restart.warning:
        console.print(f"oilsim: {restart.source} {restart.warning}", style="yellow", highlight=False, markup=False)
    return _run(restart.plan, restart, options, console)


def _run(plan: Plan, restart: Restart | None, options: RunOptions, console: Console) -> int:
    scenario = resolve(plan.scenario)
    require_memory(scenario)
    _require_writable(options)
    _require_own_files(plan, restart, options)
    with ExitStack() as stack, requests_by_posix_signal() as requests:
        if options.record is not None:
            stack.enter_context(held(options.record))
        _require_new(options)
        recorder = _recorder(scenario, options)
        console.print(f"building {scenario.name}", highlight=False, markup=False)
        compilation = stack.enter_context(Compilation(scenario.name, console))
        branch = _branch(restart, options)
        assembly = _described(build(plan.scenario, text=plan.text, overrides=plan.changes), plan, branch)
        summary, watchers = SummaryObserver(assembly), [watcher(assembly) for watcher in options.watchers]
        folder = options.checkpoint_folder
        checkpoints = None if folder is None else stack.enter_context(checkpoint_writer(folder, plan))
        pace = Pace(options.pace) if isinstance(options.pace, int | float) else options.pace
        desk = _desk(scenario.name, options, stack, console) if options.takes_orders else None
        with ProgressDisplay(scenario.name, scenario.run.duration, console, compilation) as progress:
            loop = RunLoop(
                plan,
                assembly,
                assembly.co_simulation([summary, progress, *([recorder] if recorder else []), *watchers]),
                requests=requests,
                keepers={"summary": summary} | ({"recorder": recorder} if recorder else {}),
                checkpoints=checkpoints,
                instructor=_instructor(desk, pace, options),
            )
            error = loop.run(restart)
    summary.state_hash = loop.state_hash
    if error is not None and not summary.reason.startswith("failed"):
        summary.reason = f"failed: {error}"  # it was told of the end before what failed there
    result = summary.summary(loop.simulation.communication_point.time, loop.plan.changes)
    result["pace"] = None if pace is None else pace.figures()
    _print_result(console, result, options)
    failures = [*([] if error is None else [str(error)]), *_leave(result, options, drawn=error is None)]
    for failure in failures:
        console.print(f"oilsim: {failure}", style="red", highlight=False, markup=False)
    return FAILED if failures else requests.exit_code


def _instructor(desk: OrderDesk | None, pace: Pace | None, options: RunOptions) -> Instructor | None:
    """Create the instructor of a run that takes orders or keeps a pace; None for another."""
    return None if desk is None and pace is None else Instructor(desk, pace, pauses_at=options.pauses_at)


def _desk(name: str, options: RunOptions, stack: ExitStack, console: Console) -> OrderDesk | None:
    """Open the desk for orders until the stack is closed; None, which is told, where there is no place for it."""
    from scenarios.orders.desk import open_desk

    try:
        return stack.enter_context(open_desk(name, options.record))
    except OSError as error:
        told = f"oilsim: no orders can be given while this run goes on: {error}"
        console.print(told, style="yellow", highlight=False, markup=False)
        return None


def _leave(result: dict[str, Any], options: RunOptions, *, drawn: bool) -> Iterator[str]:
    """Write the summary and, if `drawn`, the picture; yield a message for each that could not be written."""
    try:
        if options.summary is not None:
            write_summary(result, options.summary)
    except OSError as error:
        yield f"the summary {options.summary} cannot be written: {error.strerror or error}"
    try:
        if drawn and options.picture is not None and options.record is not None:
            _draw(options.record, options.picture)
    except (OSError, RecordingError) as error:
        yield f"the picture {options.picture} cannot be drawn: {error}"


def _described(assembly: Assembly, plan: Plan, branch: Mapping[str, str]) -> Assembly:
    """Add to the assembly's description all that is needed to run the plan again, and from which recording it goes on."""
    properties = dict(assembly.description.properties) | {"plan": json.dumps(plan.as_data()), **branch}
    return replace(assembly, description=replace(assembly.description, properties=properties))


def _branch(restart: Restart | None, options: RunOptions) -> dict[str, str]:
    """Return the property that names the recording from which a run goes on; empty if it goes on from none."""
    source = None if restart is None else restart.recording
    if restart is None or source is None or options.record is None:
        return {}
    from recordings.replay.joined import CONTINUES, Branch

    relative = os.path.relpath(source.absolute(), options.record.absolute().parent)
    return {CONTINUES: Branch(recording=relative, index=restart.index, time=restart.time).as_json()}


def _recorder(scenario: RunSpec, options: RunOptions) -> Recorder | None:
    """Create the recorder, if the run is recorded; a run without a recording must not import the recording library."""
    if options.record is None:
        return None
    from recordings.sink.recorder import Recorder

    live = None
    if options.live:
        from recordings.sink.live import LiveView

        live = options.live if isinstance(options.live, LiveView) else LiveView()
    return Recorder(
        options.record,
        scenario.recording.frame_rate,
        precision=recording_grid(scenario.recording.precision, scenario.fluid.particle_spacing),
        every=thinning(scenario.phases),
        surface_rate=surface_rate(scenario.recording.frame_rate, in_tank=scenario.tank is not None),
        live=live,
    )


def _require_writable(options: RunOptions) -> None:
    """Raise ScenarioError before the run, not after it, if an output could not be written."""
    written = {f"--{name}": getattr(options, name) for name in ("record", "summary", "picture")}
    problems = unwritable(written, {})
    faulty = {problem.path for problem in problems}
    for name, endings in (("--record", (RECORDING_ENDING,)), ("--picture", _PICTURE_ENDINGS)):
        path: Path | None = written[name]
        if path is not None and name not in faulty and path.suffix not in endings:
            problems.append(Problem(name, f"is {str(path)!r}, allowed: a name that ends with {' or '.join(endings)}"))
    if problems:
        raise ScenarioError(problems, "oilsim")


def _require_own_files(plan: Plan, restart: Restart | None, options: RunOptions) -> None:
    """Check that no output overwrites an input of the run or another output."""
    read = plan.files | ({} if restart is None else restart.files)
    if options.source is not None:
        read["the scenario"] = options.source
    written = {f"--{name}": getattr(options, name) for name in ("record", "summary", "picture")}
    require_apart(read, written | {"--checkpoints": options.checkpoint_folder})


def _require_new(options: RunOptions) -> None:
    """Check that the run replaces no file of an earlier one, unless it is allowed to."""
    if options.overwrite:
        return
    problems = already_there({f"--{name}": getattr(options, name) for name in ("record", "summary", "picture")})
    folder = options.checkpoint_folder
    if folder is not None and any(folder.glob("step-*.npz")):
        text = f"is {str(folder)!r}, which holds checkpoints of an earlier run; allowed: another folder, or --overwrite to replace them"
        problems.append(Problem("--checkpoints", text))
    if problems:
        raise ScenarioError(problems, "oilsim")


def _draw(recording: Path, picture: Path) -> None:
    from recordings.pictures.picture import draw_picture

    draw_picture(recording, picture)


def _modelled(volume: float) -> str:
    """Say how much of a loss [m3] closures carried out; empty if none."""
    return f" ({volume_in_words(volume)} of it modelled)" if volume else ""


def _print_result(console: Console, result: dict[str, Any], options: RunOptions) -> None:
    """Print the closing table: the results, the speed, and the output files."""
    table = Table(show_header=False)
    table.add_column(style="bold")
    table.add_column()
    table.add_row("ended", result["ended"])
    factor = result["real_time_factor"]
    speed = f" ({factor:.2g} x real time)" if factor else ""
    table.add_row("simulated", f"{result['simulated_s']:g} s in {result['wall_s']:.1f} s{speed}")
    if result["step_ms"]["median"] is not None:
        times = result["step_ms"]
        table.add_row("time per step", f"median {times['median']:.1f} ms, 95 % below {times['p95']:.1f} ms")
        table.add_row("density error", f"mean {100 * result['density_error']['mean']:.3f} %")
    pace = result["pace"]
    if pace is not None and pace["pace"] is not None:
        lag = f"95 % of the steps less than {pace['lag_ms']['p95']:.0f} ms behind the clock"
        late = f"; the clock was set back by {pace['set_back_s']:.1f} s in all" if pace["set_back_s"] else ""
        table.add_row("pace", f"{pace['pace']:g} {'kept' if pace['kept'] else 'not kept'}: {lag}{late}")
    table.add_row("particles", ", ".join(f"{name} {count:,}" for name, count in result["particles"].items()))
    if result["left_the_tank"]:
        table.add_row(
            "left the tank", ", ".join(f"{name} {count:,}" for name, count in result["left_the_tank"].items())
        )
    oil = result["oil_m3"]
    if oil["spilled"]:
        table.add_row("oil", f"{volume_in_words(oil['spilled'])} spilled")
        for fate in ("contained", "recovered", "stranded", "left_the_domain"):
            if oil[fate]:
                table.add_row("", f"{volume_in_words(oil[fate])} {cause_in_words(fate)}")
        for cause, volume in oil["lost"].items():
            told = f"{volume_in_words(volume)} {cause_in_words(cause)}{_modelled(oil['lost_modelled'][cause])}"
            table.add_row("", told)
    for name in ("record", "summary", "picture"):
        path = getattr(options, name)
        if path is not None:
            table.add_row(name, str(path))
    console.print(table)


def recording_grid(precision: float | None, spacing: float) -> float | None:
    """Return the grid [m], a power of two, on which positions are recorded; None keeps every bit; spacing [m] of the particles."""
    wanted = spacing / FINE if precision is None else precision
    return grid_within(wanted) if wanted > 0.0 else None


def thinning(phases: Mapping[str, PhaseSettings]) -> dict[str, int]:
    """Return, by phase, the number of frames for one with its particles; phases in every frame are left out."""
    oily = any(phase.is_oil for phase in phases.values())
    return {name: THINNED for name, phase in phases.items() if oily and not phase.is_oil}


def surface_rate(frame_rate: float, *, in_tank: bool) -> float:
    """Return the frames with the surface of the water and the film of oil on it, a simulated second [1/s], at most."""
    return SURFACED * frame_rate if in_tank else SEA_RATE

"""A sweep runs a scenario once for every combination of some entries' values, and compares the results.

Several runs at once have a process each, on the cores of this machine, or as tasks of a Dask cluster, whose workers may be lost.
"""

from __future__ import annotations

import json
import signal
import subprocess
import threading
import time as wall_clock
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from recordings.files.writing import RecordingError, write_whole
from scenarios.running.run import RunOptions, run_scenario
from scenarios.sweeps.remote_run import run_elsewhere
from scenarios.sweeps.results import Outcome, differing, read_summary, table, write_parquet, write_table
from scenarios.sweeps.variants import Variant
from scenarios.text.problems import DONE, FAILED, INTERRUPTED, Problem, ScenarioError
from scenarios.text.terminal import terminal
from scenarios.watch.progress import clock

if TYPE_CHECKING:
    from distributed import Client


class Results:
    """Takes the results of runs that were made elsewhere: writes their summaries, and tells how each ended and how long the rest takes."""

    def __init__(self, folder: Path, count: int, console: Console) -> None:
        self._folder, self._count, self._console = folder, count, console
        self._begun, self._done = wall_clock.perf_counter(), 0
        self._taken: set[str] = set()  # names of runs

    def take(
        self, variant: Variant, failure: Callable[[], BaseException | None], result: Callable[[], dict[str, Any]]
    ) -> int:
        """Take what became of a run, as a future tells it: its failure, or what `run_elsewhere` returned. Return `DONE` or `FAILED`."""
        error = failure()
        told = f"failed: {type(error).__name__}: {error}" if error is not None else self._keep(variant, result())
        self._taken.add(variant.name)
        self._done += 1
        left = self._count - self._done
        spent = wall_clock.perf_counter() - self._begun
        rest = f", about {clock(spent / self._done * left)} left" if left else ""
        self._console.print(f"{self._done} of {self._count}: {variant.title}: {told}{rest}", highlight=False)
        return DONE if told.startswith("completed") else FAILED

    def take_completed(self, ended: Mapping[Future[dict[str, Any]], Variant]) -> None:
        """Take the runs that have come to their end and were not taken yet; the others begin anew in a later sweep."""
        for one, variant in ended.items():
            if variant.name in self._taken or one.cancelled() or one.exception() is not None:
                continue
            summary = one.result()["summary"]
            if summary is not None and summary["ended"] == "completed":
                self.take(variant, one.exception, one.result)
        self._console.print("stopped; the same command goes on with the runs that are not complete", highlight=False)

    def _keep(self, variant: Variant, result: dict[str, Any]) -> str:
        """Write a run's summary, and say how it ended."""
        if result["summary"] is None:
            last = (result["said"].strip().splitlines() or ["no word"])[-1]
            return f"failed with exit code {result['code']}: {last}"
        write_whole(
            self._folder / f"{variant.name}.json", json.dumps(result["summary"], indent=1, allow_nan=False) + "\n"
        )
        return str(result["summary"]["ended"])


def run_at_once(
    waiting: Sequence[Variant], folder: Path, workers: int, console: Console, *, recorded: bool = False
) -> int:
    """Run these variants, `workers` at a time, and write each summary, and recording if `recorded`, into `folder`.

    A scenario that does not state its threads gets one: runs beside each other need no more. A run that fails or crashes does not stop the
    rest. Ctrl-C ends those that go on in order, and drops the others; a run that was complete by then
    counts. Returns `DONE`, `FAILED` if a run failed, or `INTERRUPTED`.
    """
    running: list[subprocess.Popen[str]] = []
    stopping = threading.Event()

    def watch(process: subprocess.Popen[str]) -> None:
        running.append(process)
        if stopping.is_set():
            process.send_signal(signal.SIGINT)

    def one_run(variant: Variant) -> dict[str, Any]:
        return run_elsewhere(_on_one_thread(variant), str(folder / f"{variant.name}.rrd") if recorded else None, watch)

    results = Results(folder, len(waiting), console)
    pool, futures = ThreadPoolExecutor(workers), dict[Future[dict[str, Any]], Variant]()
    try:
        futures = {pool.submit(one_run, variant): variant for variant in waiting}
        return max(results.take(futures[one], one.exception, one.result) for one in as_completed(futures))
    except KeyboardInterrupt:
        stopping.set()
        pool.shutdown(wait=False, cancel_futures=True)
        for process in running:
            process.send_signal(signal.SIGINT)  # to none that has ended
        pool.shutdown()
        results.take_completed(futures)
        return INTERRUPTED
    finally:
        pool.shutdown()


def _on_one_thread(variant: Variant) -> dict[str, Any]:
    """Return the plan of a run as data, with one thread where the scenario states none."""
    plan = variant.plan
    return (plan if plan.scenario.run.threads else plan.changed(["run.threads=1"], 0)).as_data()


TIMEOUT = 20  # [s] to reach a scheduler; technical


def run_on_cluster(waiting: Sequence[Variant], folder: Path, address: str, console: Console) -> int:
    """Run these variants on the cluster whose scheduler is at `address`, and write each summary into `folder` as it comes.

    A task whose worker is lost is given to another one, as often as the scheduler allows. Returns `DONE`, or `FAILED` if a run failed.
    Raises ScenarioError if the scheduler cannot be reached.
    """
    from distributed import as_completed  # few need it

    results = Results(folder, len(waiting), console)
    with _client(address) as client:
        futures = {
            client.submit(run_elsewhere, variant.plan.as_data(), key=f"oilsim-{variant.name}", pure=False): variant
            for variant in waiting
        }
        codes = [results.take(futures[future], future.exception, future.result) for future in as_completed(futures)]
    return max(codes, default=DONE)


def _client(address: str) -> Client:
    from distributed import Client

    try:
        return Client(address, timeout=TIMEOUT)
    except (OSError, ValueError, TimeoutError) as error:
        text = f"is {address!r}, which does not answer: {error}; allowed: the address of a Dask scheduler, as tcp://host:8786"
        raise ScenarioError([Problem("--scheduler", text)], "oilsim") from error


MOST_SHOWN = 6  # [1] runs of a table in a terminal; layout; more columns have no room for their numbers


def run_sweep(
    chosen: Sequence[Variant],
    folder: Path,
    *,
    recorded: bool = False,
    workers: int = 1,
    scheduler: str | None = None,
    console: Console | None = None,
) -> int:
    """Run the variants that are not complete yet, with a summary and, if `recorded`, a recording each.

    `workers`: runs at a time on this machine, each in a process of its own on one thread; 1: one after the other, here. `scheduler`:
    address of a Dask cluster that makes the runs instead. Writes sweep.csv, sweep.parquet and pictures into the folder. Returns the exit
    code of the `oilsim` command: that of the first failed run, or of the signal that stopped the sweep. A later call with the same folder
    continues: it does not repeat complete runs of the same scenario.
    Raises ScenarioError if the folder cannot be created.
    """
    console = console or terminal(stderr=True)
    _make(folder)
    waiting = [variant for variant in chosen if not _is_complete(variant, folder, recorded)]
    if len(waiting) < len(chosen):
        console.print(f"{len(chosen) - len(waiting)} of {len(chosen)} already complete", highlight=False)
    if not waiting:
        code = DONE
    elif scheduler is not None:
        code = run_on_cluster(waiting, folder, scheduler, console)
    elif workers > 1:
        code = run_at_once(waiting, folder, workers, console, recorded=recorded)
    else:
        code = _run_in_turn(waiting, folder, recorded, console)
    whole = code in (DONE, FAILED)
    ended = [variant for variant in chosen if whole or _is_complete(variant, folder, recorded)]
    _leave(_outcomes(ended, folder), folder, console)
    return code


def _run_in_turn(waiting: Sequence[Variant], folder: Path, recorded: bool, console: Console) -> int:
    """Run variants one after the other, on all cores and with their messages; stop where a run is stopped by a signal."""
    code, begun = DONE, wall_clock.perf_counter()
    for done, variant in enumerate(waiting):
        spent = wall_clock.perf_counter() - begun
        left = f", about {clock(spent / done * (len(waiting) - done))} left" if done else ""
        console.print(f"{done + 1} of {len(waiting)}: {variant.title}{left}", style="bold", highlight=False)
        ended = _run(variant, folder, recorded, console)
        code = code or ended
        if ended not in (DONE, FAILED):
            return ended
    return code


def _outcomes(chosen: Sequence[Variant], folder: Path) -> list[Outcome]:
    """Read the summaries that are there."""
    found = ((variant, read_summary(folder / f"{variant.name}.json")) for variant in chosen)
    return [Outcome(variant, summary) for variant, summary in found if summary is not None]


def _run(variant: Variant, folder: Path, recorded: bool, console: Console) -> int:
    """Run a variant, with its messages; one that cannot be built or recorded counts as a failed run."""
    plan = variant.plan
    options = RunOptions(
        record=folder / f"{variant.name}.rrd" if recorded else None,
        summary=folder / f"{variant.name}.json",
        overwrite=True,  # what an earlier sweep has not run to its end
        source=variant.source,
    )
    try:
        return run_scenario(plan.scenario, text=plan.text, overrides=plan.overrides, options=options, console=console)
    except (ScenarioError, RecordingError) as error:
        console.print(f"failed: {error}", highlight=False, markup=False)
        return FAILED


def _leave(outcomes: Sequence[Outcome], folder: Path, console: Console) -> None:
    """Print and write the results of the runs."""
    if not outcomes:
        return
    write_table(outcomes, folder / "sweep.csv")
    write_parquet(outcomes, folder / "sweep.parquet")
    told = f"table of all figures: {folder / 'sweep.csv'}, and as Parquet"
    if differing([outcome.figures() for outcome in outcomes]):
        from scenarios.sweeps.charts import draw_loss_map, draw_sweep

        if len(outcomes) <= MOST_SHOWN:
            console.print(table(outcomes))
        if draw_sweep(outcomes, folder / "sweep.png"):
            told += f", picture: {folder / 'sweep.png'}"
        if draw_loss_map(outcomes, folder / "loss-map.png"):
            told += f", loss map: {folder / 'loss-map.png'}"
    console.print(told, highlight=False)


def _is_complete(variant: Variant, folder: Path, recorded: bool) -> bool:
    """Tell whether the variant has been run to its end, and recorded if that is asked for."""
    content = read_summary(folder / f"{variant.name}.json")
    if content is None:
        return False
    is_whole = content["ended"] == "completed" and content["simulated_s"] >= variant.plan.scenario.run.duration - 1e-9
    return is_whole and (not recorded or (folder / f"{variant.name}.rrd").is_file())


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        text = f"is {str(folder)!r}, which cannot be created: {error.strerror or error}; allowed: a new folder, or that of an earlier sweep"
        raise ScenarioError([Problem("--to", text)], "oilsim") from error

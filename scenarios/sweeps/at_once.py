"""Several runs of a sweep at once, on the cores of this machine: each in a process of its own, on one thread."""

from __future__ import annotations

import json
import signal
import subprocess
import threading
import time as wall_clock
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from rich.console import Console

from recordings.files.writing import write_whole
from scenarios.sweeps.remote_run import run_elsewhere
from scenarios.sweeps.variants import Variant
from scenarios.text.problems import DONE, FAILED, INTERRUPTED
from scenarios.watch.progress import clock


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

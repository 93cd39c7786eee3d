"""The runs of a sweep on a Dask cluster: each a task, so that a bad run or a lost worker does not stop the rest."""

from __future__ import annotations

import json
import time as wall_clock
from collections.abc import Sequence
from pathlib import Path

from distributed import Client, Future, as_completed
from rich.console import Console

from recordings.files import write_whole
from scenarios.exit_codes import DONE, FAILED
from scenarios.problems import Problem, ScenarioError
from scenarios.sweeps.remote_run import run_elsewhere
from scenarios.sweeps.variants import Variant
from scenarios.watch.progress import clock

TIMEOUT = 20  # [s] to reach a scheduler; technical


def run_on_cluster(waiting: Sequence[Variant], folder: Path, address: str, console: Console) -> int:
    """Run these variants on the cluster whose scheduler is at `address`, and write each summary into `folder` as it comes.

    A task whose worker is lost is given to another one, as often as the scheduler allows. Returns `DONE`, or `FAILED` if a run failed.
    Raises ScenarioError if the scheduler cannot be reached.
    """
    with _client(address) as client:
        started, code = wall_clock.perf_counter(), DONE
        futures = {
            client.submit(run_elsewhere, variant.plan.as_data(), key=f"oilsim-{variant.name}", pure=False): variant
            for variant in waiting
        }
        for done, future in enumerate(as_completed(futures), 1):
            variant = futures[future]
            told = _take(future, variant, folder)
            code = code if told.startswith("completed") else FAILED
            spent = wall_clock.perf_counter() - started
            left = f", about {clock(spent / done * (len(waiting) - done))} left" if done < len(waiting) else ""
            console.print(f"{done} of {len(waiting)}: {variant.title}: {told}{left}", highlight=False)
    return code


def _client(address: str) -> Client:
    try:
        return Client(address, timeout=TIMEOUT)
    except (OSError, ValueError, TimeoutError) as error:
        text = f"is {address!r}, which does not answer: {error}; allowed: the address of a Dask scheduler, as tcp://host:8786"
        raise ScenarioError([Problem("--scheduler", text)], "oilsim") from error


def _take(future: Future, variant: Variant, folder: Path) -> str:
    """Write a run's summary, and say how it ended."""
    error = future.exception()
    if error is not None:
        return f"failed: {type(error).__name__}: {error}"
    result = future.result()
    if result["summary"] is None:
        last = (result["said"].strip().splitlines() or ["no word"])[-1]
        return f"failed with exit code {result['code']}: {last}"
    write_whole(folder / f"{variant.name}.json", json.dumps(result["summary"], indent=1, allow_nan=False) + "\n")
    return str(result["summary"]["ended"])

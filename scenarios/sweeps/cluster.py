"""The runs of a sweep on a Dask cluster: each a task, so that a bad run or a lost worker does not stop the rest."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from distributed import Client, as_completed
from rich.console import Console

from scenarios.sweeps.at_once import Results
from scenarios.sweeps.remote_run import run_elsewhere
from scenarios.sweeps.variants import Variant
from scenarios.text.problems import DONE, Problem, ScenarioError

TIMEOUT = 20  # [s] to reach a scheduler; technical


def run_on_cluster(waiting: Sequence[Variant], folder: Path, address: str, console: Console) -> int:
    """Run these variants on the cluster whose scheduler is at `address`, and write each summary into `folder` as it comes.

    A task whose worker is lost is given to another one, as often as the scheduler allows. Returns `DONE`, or `FAILED` if a run failed.
    Raises ScenarioError if the scheduler cannot be reached.
    """
    results = Results(folder, len(waiting), console)
    with _client(address) as client:
        futures = {
            client.submit(run_elsewhere, variant.plan.as_data(), key=f"oilsim-{variant.name}", pure=False): variant
            for variant in waiting
        }
        codes = [results.take(futures[future], future.exception, future.result) for future in as_completed(futures)]
    return max(codes, default=DONE)


def _client(address: str) -> Client:
    try:
        return Client(address, timeout=TIMEOUT)
    except (OSError, ValueError, TimeoutError) as error:
        text = f"is {address!r}, which does not answer: {error}; allowed: the address of a Dask scheduler, as tcp://host:8786"
        raise ScenarioError([Problem("--scheduler", text)], "oilsim") from error

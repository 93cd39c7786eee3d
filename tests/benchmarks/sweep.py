"""How sweeps scale over workers, and the overhead of a run: `python -m tests.benchmarks.sweep [--runs 6] [--seconds 5] [--most N]`.

The runs are of `small-sweep.toml`, two boats that tow a boom, without particles, on one thread each. A run's own time is the wall time in
its summary; the rest of its worker's time is overhead: starting Python, reading the scenario, building the run, and writing the summary.
The Dask clusters are of processes on this machine.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from distributed import LocalCluster
from rich.console import Console
from rich.table import Table

from scenarios.sweeps.sweep import run_sweep
from scenarios.sweeps.variants import Variant, Variation, variants

SCENE = Path(__file__).with_name("small-sweep.toml")
SPEEDS = (0.4, 1.2)  # [kn] of the first and last run


def runs(count: int, seconds: float) -> list[Variant]:
    """Return so many runs of the scene, at different speeds, each so long [s]."""
    step = (SPEEDS[1] - SPEEDS[0]) / max(1, count - 1)
    speeds = tuple(f"{SPEEDS[0] + number * step:.3f}" for number in range(count))
    return variants(SCENE, [Variation(key="tow.speed_kn", values=speeds)], overrides=(f"run.duration={seconds}",))


def measured(sweep: Callable[[Path], int]) -> tuple[float, float]:
    """Run a sweep into a new folder; return its wall time [s], and the sum of its runs' own [s]."""
    with tempfile.TemporaryDirectory(prefix="oilsim-") as folder:
        begin = time.perf_counter()
        if sweep(Path(folder)) != 0:
            raise SystemExit("a run failed")
        wall = time.perf_counter() - begin
        summaries = [json.loads(path.read_text(encoding="utf-8")) for path in Path(folder).glob("*.json")]
    return wall, sum(summary["wall_s"] for summary in summaries)


def on_cluster(chosen: list[Variant], workers: int, console: Console) -> tuple[float, float]:
    """Measure the sweep on a local cluster, whose start does not count."""
    with LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        address = cluster.scheduler_address
        return measured(lambda folder: run_sweep(chosen, folder, scheduler=address, console=console))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=6, help="runs of a sweep (default: 6)")
    parser.add_argument("--seconds", type=float, default=5.0, help="simulated seconds of a run (default: 5)")
    parser.add_argument("--most", type=int, default=len(os.sched_getaffinity(0)), help="workers (default: a core each)")
    options = parser.parse_args()
    chosen, quiet = runs(options.runs, options.seconds), Console(quiet=True)
    table = Table(title=f"{options.runs} runs of {options.seconds:g} s simulated")
    for column in ("made by", "workers", "wall s", "speed-up", "own s a run", "overhead s a run"):
        table.add_column(column, justify="left" if column == "made by" else "right")
    measured(lambda folder: run_sweep(chosen[:1], folder, console=quiet))  # compiles
    found = {("this process", 1): measured(lambda folder: run_sweep(chosen, folder, console=quiet))}
    for workers in range(1, options.most + 1):
        if workers > 1:
            found["processes", workers] = measured(
                lambda folder, workers=workers: run_sweep(chosen, folder, workers=workers, console=quiet)
            )
        found["Dask", workers] = on_cluster(chosen, workers, quiet)
    alone = found["this process", 1][0]
    for (made, workers), (wall, own) in found.items():
        overhead = (workers * wall - own) / options.runs
        table.add_row(
            made, f"{workers}", f"{wall:.1f}", f"{alone / wall:.2f}", f"{own / options.runs:.2f}", f"{overhead:.2f}"
        )
    Console(width=110).print(table)


if __name__ == "__main__":
    main()

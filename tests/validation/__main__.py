"""Run the validation cases whose code has changed, keep their records, and write the pages of numbers from them.

    python -m tests.validation [CASE[,CASE...]] [--levels 1-4] [--budget 2h] [--threads N] [--scheduler tcp://host:8786] [--again]

A run that is begun again goes on where it was ended. The exit status is 1 when a case cannot run, and when a gate is missed that is not
among `cases.KNOWN_MISSES`; 2 for a case that does not exist. A known miss that is met is told.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import time
from collections.abc import Iterable

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from tests.validation.case import Bench
from tests.validation.cases import CASES, KNOWN_MISSES, select
from tests.validation.jobs import Job, Record, by_worth, jobs, keep, run
from tests.validation.pages import made, report
from tests.validation.scenes import fill, oil_and_water, open_tank

UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="validate", description="Validate the fluid against theory and experiment.")
    parser.add_argument(
        "cases", nargs="?", default="", help=f"comma-separated: {', '.join(case.name for case in CASES)}"
    )
    parser.add_argument(
        "--levels", type=int, choices=(1, 2, 3, 4), help="how many spacings, coarse first; a named case takes all"
    )
    parser.add_argument(
        "--budget", type=seconds, default=math.inf, help="as 90min or 2h: the most valuable jobs that fit into it"
    )
    parser.add_argument("--threads", type=int, default=None, help="threads of a fluid; default all cores")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster that runs the jobs")
    parser.add_argument("--again", action="store_true", help="also what is not stale")
    return parser.parse_args(arguments)


def seconds(text: str) -> float:
    """Read a duration as 90s, 20min or 2h."""
    for unit, length in UNITS.items():
        if text.endswith(unit) and text.removesuffix(unit).replace(".", "", 1).isdigit():
            return float(text.removesuffix(unit)) * length
    raise argparse.ArgumentTypeError(f"{text!r} is no duration, allowed: a number with {', '.join(UNITS)}, as 2h")


def warm_up(threads: int | None) -> None:
    """Compile the kernels, so that no case's wall time contains it."""
    bench = Bench(threads=threads)
    fluid, _ = open_tank(bench, 0.4, 0.4, 0.1, oil_and_water(1e-2))
    fill(fluid, (0, 0), (0.4, 0.2))
    fill(fluid, (0, 0.2), (0.4, 0.4), "oil")
    bench.advance(fluid, 0.01)
    fluid.close()


def main(arguments: list[str] | None = None) -> int:
    """Run what the command line asks for; returns the exit status."""
    options = parse(arguments)
    try:
        cases = select(options.cases)
    except ValueError as problem:
        print(problem, file=sys.stderr)
        return 2
    asked = jobs(cases, options.levels or (4 if options.cases else None))
    waiting = by_worth(job for job in asked if options.again or job.is_stale)
    console = Console()
    console.print(f"{len(waiting)} of {len(asked)} jobs to run", highlight=False)
    if waiting and options.scheduler:
        take(console, run_on_cluster(waiting, options.scheduler))
    elif waiting:
        run_here(waiting, options.budget, options.threads, console)
    console.print(f"page: {report.PAGE}", highlight=False)
    return status_of([report.result_of(case) for case in cases], console)


def run_here(waiting: list[Job], budget: float, threads: int | None, console: Console) -> None:
    """Run jobs one after the other; those that are likely to take longer than what is left of the budget [s] are left out, and told."""
    warm_up(threads)
    begin, left_out, cores = time.monotonic(), 0, threads or os.cpu_count() or 1
    with Progress(TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), console=console) as progress:
        whole = progress.add_task("all", total=len(waiting))
        for job in waiting:
            left = budget - (time.monotonic() - begin)
            if left <= 0.0 or job.cost / cores > left:
                left_out += 1
                continue
            task = progress.add_task(str(job), total=1.0)
            bench = Bench(
                threads=threads, step_share=job.step_share,
                progress=lambda share, task=task: progress.update(task, completed=share),
            )  # fmt: skip
            take(console, [(job, run(job, bench))])
            progress.remove_task(task)
            progress.advance(whole)
    if left_out:
        console.print(f"{left_out} jobs are left for another time: they do not fit into the budget", highlight=False)


def take(console: Console, ended: Iterable[tuple[Job, Record]]) -> None:
    """Keep each record as it comes, write the pages anew and say what the run cost."""
    for job, record in ended:
        keep(job.case, record)
        made.write()
        told = record["failure"] or f"{record['cpu_s']:.1f} s of processor time"
        console.print(f"{job}: {told}", highlight=False, markup=False)


def run_on_cluster(waiting: list[Job], address: str) -> Iterable[tuple[Job, Record]]:
    """Run jobs on the Dask cluster whose scheduler is at `address`; yields each with its record as it ends."""
    from distributed import Client, as_completed  # of few users

    with Client(address) as client:
        futures = {client.submit(run_named, job.case.name, job.resolution, job.step_share): job for job in waiting}
        for future in as_completed(futures):
            yield futures[future], future.result()


def run_named(name: str, resolution: int, step_share: float) -> Record:
    """Run a job by the name of its case, on one thread, as a worker of a cluster does."""
    (case,) = select(name)
    return run(Job(case, resolution, step_share), Bench(threads=1, step_share=step_share))


def status_of(results: list[report.CaseResult], console: Console) -> int:
    """Say which gates are missed or met against expectation; return the exit status."""
    missed, met = report.unexpected(results, KNOWN_MISSES)
    for gate in missed:
        console.print(f"MISSED, and no known miss: {gate}", highlight=False, markup=False, soft_wrap=True)
    for gate in met:
        console.print(f"met, though a known miss: {gate}", highlight=False, markup=False, soft_wrap=True)
    return 1 if missed or any(result.failed for result in results) else 0


if __name__ == "__main__":
    sys.exit(main())

"""Speed of the fluid core on `calm-spread`: by phase and stage, by size, by threads, by scheme, and from a cold start.

    python -m tests.benchmarks.calm_spread [--quick]

Each figure is the median over the communication steps (0.01 s) it speaks of. Machines differ and are noisy: compare the rows of
one table with each other.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable

import numpy as np
from rich.console import Console
from rich.table import Table

from oilsim.solver import AdvanceReport, Fluid
from scenarios.build_fluid import build_fluid, fill_positions
from scenarios.load import load_scenario

STEP = 0.01
PHASES = (("fall", 0.0, 0.25), ("splash", 0.25, 3.0), ("calm", 8.0, 10.0))
SIZES = ((10_000, 0.0615), (40_000, 0.0388), (87_000, 0.03), (300_000, 0.0199))
WHOLE_RUN_UP_TO = 100_000  # particles; a larger run is measured in the fall and the first splash
STAGES = ("search", "density", "gradients", "viscosity", "divergence", "contact")

FIRST_STEP = """
import time
from scenarios.build_fluid import build_fluid, fill_positions
from scenarios.load import load_scenario
scenario = load_scenario("calm-spread").scenario
fluid, _ = build_fluid(scenario, fill_positions(scenario))
begin = time.perf_counter()
fluid.advance(0.01)
print(time.perf_counter() - begin)
"""


def calm_spread(overrides: Iterable[str] = (), threads: int | None = None) -> Fluid:
    """The scenario's fluid, ready to advance."""
    settings = [*overrides] + ([f"run.threads={threads}"] if threads else [])
    scenario = load_scenario("calm-spread", overrides=settings).scenario
    return build_fluid(scenario, fill_positions(scenario))[0]


def timed_step(fluid: Fluid) -> tuple[float, AdvanceReport]:
    """Wall time of one communication step [ms] and its report."""
    begin = time.perf_counter()
    report = fluid.advance(STEP)
    return 1e3 * (time.perf_counter() - begin), report


def phases_table(console: Console, overrides: tuple[str, ...], until: float) -> None:
    """One run, split into its phases and stages."""
    fluid = calm_spread(overrides)
    fluid.advance(1e-4)  # compile before anything is timed
    table = Table(
        title=f"calm-spread {' '.join(overrides)}: {fluid.particle_count} fluid, {fluid.boundary_count} wall particles"
    )
    for column in ("phase", "ms a step", "sub-steps", "ms a sub-step", "wall s per simulated s", *STAGES, "iterations d/v",
                   "density error"):  # fmt: skip
        table.add_column(column, justify="right")
    rows: defaultdict[str, list[tuple[float, AdvanceReport]]] = defaultdict(list)
    while fluid.time < until - 1e-9:
        now = fluid.time
        measured = timed_step(fluid)
        rows["whole run"].append(measured)
        for name, begin, end in PHASES:
            if begin <= now < end:
                rows[name].append(measured)
    for name, steps in rows.items():
        milliseconds = np.array([ms for ms, _ in steps])
        sub_steps = np.array([report.sub_steps for _, report in steps])
        stages = [
            np.median([1e3 * report.stage_seconds.get(stage, 0.0) / report.sub_steps for _, report in steps])
            for stage in STAGES
        ]
        iterations = [np.mean([report.iterations[kind] for _, report in steps]) for kind in ("density", "divergence")]
        error = np.mean([report.density_error for _, report in steps])
        table.add_row(
            name, f"{np.median(milliseconds):.0f}", f"{sub_steps.mean():.1f}", f"{np.median(milliseconds / sub_steps):.0f}",
            f"{milliseconds.mean() / 10:.1f}", *[f"{value:.1f}" for value in stages], f"{iterations[0]:.1f} / {iterations[1]:.1f}",
            f"{100 * error:.3f} %",
        )  # fmt: skip
    console.print(table)


def sizes_table(console: Console, steps: int) -> None:
    """Cost per particle from small to large, at the start of the fall."""
    table = Table(title="calm-spread by size, first steps of the fall")
    for column in ("particles", "spacing [m]", "ms a sub-step", "ns a particle and sub-step"):
        table.add_column(column, justify="right")
    for _, spacing in SIZES:
        fluid = calm_spread([f"fluid.particle_spacing={spacing}"])
        fluid.advance(STEP)
        cost = [ms / report.sub_steps for ms, report in (timed_step(fluid) for _ in range(steps))]
        per_particle = 1e6 * np.median(cost) / fluid.particle_count
        table.add_row(f"{fluid.particle_count}", f"{spacing}", f"{np.median(cost):.1f}", f"{per_particle:.0f}")
    console.print(table)


def threads_table(console: Console, steps: int) -> None:
    """The same steps on one thread and on all, in turn."""
    available = len(os.sched_getaffinity(0))
    fluids = {threads: calm_spread(threads=threads) for threads in sorted({1, available})}
    cost: dict[int, list[float]] = {threads: [] for threads in fluids}
    for fluid in fluids.values():
        fluid.advance(STEP)
    for _ in range(steps):
        for threads, fluid in fluids.items():
            cost[threads].append(timed_step(fluid)[0])
    table = Table(title="calm-spread by threads, steps in turn")
    for column in ("threads", "ms a step", "speed-up"):
        table.add_column(column, justify="right")
    for threads, values in cost.items():
        table.add_row(f"{threads}", f"{np.median(values):.0f}", f"{np.median(cost[1]) / np.median(values):.2f}")
    console.print(table)


def first_step_table(console: Console) -> None:
    """Seconds of the first step in a new process: nothing compiled yet, then from the disk cache."""
    table = Table(title="first step in a new process [s]")
    table.add_column("cold cache", justify="right")
    table.add_column("warm cache", justify="right")
    with tempfile.TemporaryDirectory() as cache:
        environment = os.environ | {"NUMBA_CACHE_DIR": cache}
        runs = [
            subprocess.run(
                [sys.executable, "-c", FIRST_STEP], env=environment, capture_output=True, text=True, check=True
            )
            for _ in range(2)
        ]
    table.add_row(*[f"{float(run.stdout):.1f}" for run in runs])
    console.print(table)


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a tenth of the steps, coarse: to see that it runs")
    quick = parser.parse_args().quick
    console = Console(width=190)
    first_step_table(console)
    for particles, spacing in SIZES[:1] if quick else SIZES:
        whole = 10.0 if particles <= WHOLE_RUN_UP_TO else 0.5
        phases_table(console, (f"fluid.particle_spacing={spacing}",), until=1.0 if quick else whole)
    coarse = ("fluid.particle_spacing=0.06",) if quick else ()
    phases_table(console, (*coarse, "fluid.scheme=paper"), until=0.5 if quick else 3.0)
    sizes_table(console, steps=2 if quick else 10)
    threads_table(console, steps=2 if quick else 10)


if __name__ == "__main__":
    main()

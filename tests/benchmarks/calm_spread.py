"""Speed of the fluid core on `calm-spread`: by phase and stage, by size, by threads, by scheme, by what is skipped, from a cold start.

    python -m tests.benchmarks.calm_spread [--quick]

Figures are medians over the communication steps (1/30 s) they speak of in which a sub-step ended, except wall seconds per simulated
second, which are means over all.
Machines differ and are noisy: compare the rows of one table with each other.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from types import ModuleType

import numpy as np
from rich.console import Console
from rich.table import Table

from oilsim import AdvanceReport, Fluid
from oilsim.stages import viscosity
from scenarios.setup.fluid import build_fluid
from scenarios.setup.layout import lay_out
from scenarios.spec.load import load_scenario
from scenarios.spec.resolve import resolve

STEP = 1.0 / 30.0
PHASES = (("fall", 0.0, 0.25), ("splash", 0.25, 3.0), ("calm", 8.0, 10.0))
SIZES = ((10_000, 0.0615), (40_000, 0.0388), (87_000, 0.03), (300_000, 0.0199), (1_000_000, 0.01327))
WHOLE_RUN_UP_TO = 100_000  # particles; larger runs are measured in the first steps of the fall
STAGES = ("search", "density", "gradients", "viscosity", "divergence", "contact")

FIRST_STEP = """
import time
from scenarios.spec.load import load_scenario
from scenarios.setup.fluid import build_fluid
from scenarios.setup.layout import lay_out
from scenarios.spec.resolve import resolve
scenario = resolve(load_scenario("calm-spread").scenario)
layout = lay_out(scenario)
fluid, _ = build_fluid(scenario, layout.positions, layout.sea)
begin = time.perf_counter()
fluid.advance(0.04)
print(time.perf_counter() - begin)
"""


def calm_spread(overrides: Iterable[str] = (), threads: int | None = None) -> Fluid:
    """The scenario's fluid, ready to advance."""
    settings = [*overrides] + ([f"run.threads={threads}"] if threads else [])
    scenario = resolve(load_scenario("calm-spread", overrides=settings).scenario)
    layout = lay_out(scenario)
    return build_fluid(scenario, layout.positions, layout.sea)[0]


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
    for column in ("phase", "sub-steps a second", "ms a sub-step", "wall s per simulated s", *STAGES, "iterations d/v",
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
        wall = 1e-3 * np.mean([ms for ms, _ in steps]) / STEP
        rate = np.mean([report.sub_steps for _, report in steps]) / STEP
        steps = [(ms, report) for ms, report in steps if report.sub_steps]
        each = [ms / report.sub_steps for ms, report in steps]
        stages = [
            np.median([1e3 * report.stage_seconds.get(stage, 0.0) / report.sub_steps for _, report in steps])
            for stage in STAGES
        ]
        iterations = [np.mean([report.iterations[kind] for _, report in steps]) for kind in ("density", "divergence")]
        error = np.mean([report.density_error for _, report in steps])
        table.add_row(
            name, f"{rate:.0f}", f"{np.median(each):.0f}", f"{wall:.1f}", *[f"{value:.1f}" for value in stages],
            f"{iterations[0]:.1f} / {iterations[1]:.1f}", f"{100 * error:.3f} %",
        )  # fmt: skip
    console.print(table)


def cost_of_the_fall(spacing: float, frames: int) -> tuple[int, float, float, float]:
    """Particles, ms and products a sub-step in the first frames of the fall but one, and the process's memory at its peak [GB]."""
    fluid = calm_spread([f"fluid.particle_spacing={spacing}"])
    fluid.advance(STEP)
    measured = [timed_step(fluid) for _ in range(frames)]
    steps = sum(report.sub_steps for _, report in measured)
    products = sum(report.iterations["divergence"] * report.sub_steps for _, report in measured)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    fluid.close()
    return fluid.particle_count, sum(ms for ms, _ in measured) / steps, products / steps, memory


def sizes_table(console: Console, frames: int, rounds: int) -> None:
    """Cost per particle from small to large in the same part of the fall; medians of runs in turn."""
    table = Table(title="calm-spread by size, the first quarter of a second")
    for column in ("particles", "spacing [m]", "ms a sub-step", "products", "us a particle and sub-step", "of the mean",
                   "memory of the process [GB]"):  # fmt: skip
        table.add_column(column, justify="right")
    runs = [[cost_of_the_fall(spacing, frames) for _, spacing in SIZES] for _ in range(rounds)]
    middle = np.median(np.array(runs), axis=0)
    each = 1e3 * middle[:, 1] / middle[:, 0]
    for (_, spacing), (count, cost, products, memory), particle in zip(SIZES, middle, each, strict=True):
        table.add_row(
            f"{count:.0f}", f"{spacing}", f"{cost:.1f}", f"{products:.1f}", f"{particle:.2f}",
            f"{100.0 * particle / each.mean():.0f} %", f"{memory:.1f}",
        )  # fmt: skip
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


@contextmanager
def without(module: ModuleType, name: str, value: object) -> Iterator[None]:
    """A constant of a module replaced for a while."""
    kept = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, kept)


def still_water(overrides: Iterable[str] = ()) -> Fluid:
    """The sea of `calm-spread` without its oil, a lattice that fits the tank: at rest."""
    settings = ["fluid.particle_spacing=0.0625", "fill.ocean.inset=0", "fill.ocean.upper=[4, 2, 0.3125]", *overrides]
    scenario = resolve(load_scenario("calm-spread", overrides=settings).scenario)
    layout = lay_out(scenario)
    fills = {name: points[:0] if name == "oil" else points for name, points in layout.positions.items()}
    return build_fluid(scenario, fills, layout.sea)[0]


def skips_table(console: Console, steps: int) -> None:
    """Print the cost of work that scenes skip, on and off in turn, with the largest difference of the two states at the end."""
    table = Table(title="the sea of calm-spread without oil at 0.0625 m: skipped and not, steps in turn")
    for column in ("skipped", "ms a step, skipped", "not skipped", "ratio", "apart at the end, m and m/s"):
        table.add_column(column, justify="right")
    cases = (("viscosity below nu t / d^2 = 0.001", viscosity, "NEGLIGIBLE", 0.0),)
    for label, module, name, value in cases:
        fluids = still_water(), still_water()
        cost: tuple[list[float], list[float]] = ([], [])
        for step in range(steps + 5):
            milliseconds = timed_step(fluids[0])[0]
            with without(module, name, value):
                other = timed_step(fluids[1])[0]
            if step >= 5:  # compiled and settled
                cost[0].append(milliseconds)
                cost[1].append(other)
        apart = [
            float(np.abs(getattr(fluids[0], what)("ocean") - getattr(fluids[1], what)("ocean")).max())
            for what in ("phase_positions", "phase_velocities")
        ]
        on, off = float(np.median(cost[0])), float(np.median(cost[1]))
        table.add_row(label, f"{on:.1f}", f"{off:.1f}", f"{on / off:.2f}", f"{apart[0]:.1e}, {apart[1]:.1e}")
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
        if particles <= WHOLE_RUN_UP_TO:
            phases_table(console, (f"fluid.particle_spacing={spacing}",), until=1.0 if quick else 10.0)
    coarse = ("fluid.particle_spacing=0.06",) if quick else ()
    phases_table(console, (*coarse, "fluid.scheme=paper"), until=0.5 if quick else 1.0)
    sizes_table(console, frames=2 if quick else 8, rounds=1 if quick else 3)
    threads_table(console, steps=2 if quick else 10)
    skips_table(console, steps=5 if quick else 40)


if __name__ == "__main__":
    main()

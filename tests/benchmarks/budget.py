"""What the accounts of energy and momentum cost: nothing when they are not asked for, and how much when they are.

    python -m tests.benchmarks.budget [--steps N] [--spacing D]

Four equal fluids of `calm-spread` advance in turn, so that the machine's noise meets all alike: two whose stages only take the time,
of which the second tells how much is noise, one that could keep accounts and does not, and one that does. Their states stay equal bit
for bit.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import MethodType
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from oilsim import Fluid
from oilsim.step.context import StepClock
from tests.benchmarks.calm_spread import STEP, calm_spread

WARM_UP = 3  # steps, in which kernels compile


@contextmanager
def bare_stage(clock: StepClock, name: str) -> Iterator[None]:
    """A stage that knows of no accounts."""
    begin = time.perf_counter()
    yield
    clock.seconds[name] += time.perf_counter() - begin


def counted(run: Callable[..., None], calls: list[str]) -> Callable[..., None]:
    """`run` that writes down which kernels it runs."""

    def counting(kernel: Any, *arguments: Any) -> None:
        calls.append(kernel.__name__)
        run(kernel, *arguments)

    return counting


def fluids(spacing: float) -> dict[str, Fluid]:
    """All of them, ready to advance."""
    names = ("bare", "bare again", "off", "on")
    equal = {name: calm_spread([f"fluid.particle_spacing={spacing}"], threads=1) for name in names}
    for name in names[:2]:
        clock: Any = equal[name].clock
        clock.stage = MethodType(bare_stage, clock)
    equal["on"].watch()
    return equal


def main() -> None:
    """Print medians of the wall time of a step and of its ratio to the bare fluid's."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--spacing", type=float, default=0.0615)
    options = parser.parse_args()
    equal = fluids(options.spacing)
    calls: dict[str, list[str]] = {name: [] for name in equal}
    for name, fluid in equal.items():
        team: Any = fluid.context.team
        team.run = counted(team.run, calls[name])
    seconds: dict[str, list[float]] = {name: [] for name in equal}
    for step in range(WARM_UP + options.steps):
        names = list(equal)
        for name in names[step % 4 :] + names[: step % 4]:
            begin = time.perf_counter()
            equal[name].advance(STEP)
            seconds[name].append(time.perf_counter() - begin)
    table = Table(
        "stages", "step [ms]", "ratio to bare", "kernels a step", title=f"{equal['off'].particle_count} particles"
    )
    bare = np.array(seconds["bare"][WARM_UP:])
    for name, fluid in equal.items():
        own = np.array(seconds[name][WARM_UP:])
        assert np.array_equal(fluid.particles.position, equal["bare"].state.position)
        kernels = len(calls[name]) / (WARM_UP + options.steps)
        table.add_row(name, f"{1e3 * np.median(own):.2f}", f"{np.median(own / bare):.4f}", f"{kernels:.1f}")
    Console().print(table)


if __name__ == "__main__":
    main()

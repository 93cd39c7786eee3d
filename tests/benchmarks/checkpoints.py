"""What checkpoints cost: time and megabytes of one, and the share of a run's time when there is one every simulated second.

Run with ``python -m tests.benchmarks.checkpoints``.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from scenarios.running.assembly import build
from scenarios.running.checkpoints import CheckpointWriter, run_state
from scenarios.running.plan import Plan
from scenarios.spec.load import load_scenario

STEPS, WRITES = 10, 3
CASES = ("calm-spread", "u-sweep")


def main() -> None:
    """Print the table."""
    table = Table("scenario", "particles", "bodies", "a step", "a checkpoint", "size", "share at one a second")
    for name in CASES:
        scenario = load_scenario(name).scenario
        assembly = build(scenario)
        simulation = assembly.co_simulation()
        simulation.initialize()
        simulation.step()
        begun = time.perf_counter()
        for _ in range(STEPS):
            simulation.step()
        step = (time.perf_counter() - begun) / STEPS
        with tempfile.TemporaryDirectory() as folder:
            writer = CheckpointWriter(Path(folder), Plan(scenario=scenario))
            begun = time.perf_counter()
            for index in range(WRITES):
                path = writer.write(index, run_state(simulation, assembly), asked=False)
            write = (time.perf_counter() - begun) / WRITES
            size = path.stat().st_size
        second = step / scenario.run.communication_step
        counts = f"{assembly.fluid.particle_count:,}", str(len(assembly.coupled))
        costs = (
            f"{1e3 * step:.0f} ms",
            f"{1e3 * write:.0f} ms",
            f"{1e-6 * size:.1f} MB",
            f"{100.0 * write / (second + write):.2f} %",
        )
        table.add_row(name, *counts, *costs)
        simulation.terminate()
    Console(width=110).print(table)


if __name__ == "__main__":
    main()

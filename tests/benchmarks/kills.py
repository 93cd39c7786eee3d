"""What killed runs keep: twenty runs of `oilsim`, killed at random moments, replayed and gone on with.

Run with ``python -m tests.benchmarks.kills``. Kills are seeded; the clock is the killed program's own.
"""

from __future__ import annotations

import random
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tests.scenarios.kills import killed_run

KILLS = 20
CASES = {"two-layer": ("fluid.particle_spacing=0.1", "run.communication_step=0.005", "recording.frame_rate=200")}
CASES |= {
    "u-sweep": (
        "fluid.particle_spacing=0.14",
        "run.communication_step=0.02",
        "fluid.maximum_time_step=0.02",
        "recording.frame_rate=50",
    )
}


def main() -> None:
    """Print the table."""
    table = Table(
        "scenario", "killed after", "reached 1 s before", "replayed to", "frames", "lost", "cut", "goes on from"
    )
    dice = random.Random(5)
    worst = 0.0
    for number in range(KILLS):
        scenario = "two-layer" if number % 2 else "u-sweep"
        with tempfile.TemporaryDirectory() as folder:
            settings = (*CASES[scenario], "run.duration=1000", "recording.checkpoint_interval=0.2")
            kill = killed_run(Path(folder), dice.uniform(0.2, 5.0), scenario, settings)
        worst = max(worst, kill.lost)
        times = (
            f"{kill.after:.2f} s",
            f"{kill.said:.3f} s",
            f"{kill.kept:.3f} s",
            str(kill.frames),
            f"{kill.lost:.3f} s",
        )
        table.add_row(scenario, *times, "repaired" if kill.repaired else "", f"{kill.checkpoint:.2f} s")
    console = Console(width=120)
    console.print(table)
    console.print(f"simulated time older than a second that was lost, at worst: {worst:.3f} s")


if __name__ == "__main__":
    main()

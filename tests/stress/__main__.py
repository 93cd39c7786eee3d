"""Run random scenes and tell which of them fail.

    python -m tests.stress [--scenes N] [--first SEED] [--output FOLDER]

Every scene that fails is left in the folder as a scenario file, to be looked at with `oilsim run`. The exit status is 1 if one did.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from tests.stress.random_scenes import random_scene
from tests.stress.trials import Trial, as_toml, run_trial


def trial_of(seed: int) -> Trial:
    """Run the scene of a seed."""
    return run_trial(seed, random_scene(seed))


def leave(trial: Trial, folder: Path) -> Path:
    """Write the scene that failed as a scenario file."""
    folder.mkdir(exist_ok=True)
    path = folder / f"stress-{trial.seed}.toml"
    remarks = "".join(f"# {name}: {fault}\n" for name, fault in trial.faults.items())
    path.write_text(remarks + as_toml(random_scene(trial.seed)), encoding="utf-8")
    return path


def print_figures(console: Console, trials: list[Trial]) -> None:
    """How far the scenes went, figure by figure."""
    table = Table(title=f"{len(trials)} random scenes, {sum(trial.particles for trial in trials)} particles")
    for column in ("largest of a scene", "median", "95 %", "most"):
        table.add_column(column, justify="left" if column.startswith("largest") else "right")
    for name in dict.fromkeys(name for trial in trials for name in trial.figures):
        values = [trial.figures[name] for trial in trials if name in trial.figures]
        table.add_row(name, *(f"{np.quantile(values, share):.3g}" for share in (0.5, 0.95, 1.0)))
    console.print(table)


def main(arguments: list[str] | None = None) -> int:
    """Run what the command line asks for; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="stress", description="Run random scenes and hold them to what physics allows."
    )
    parser.add_argument("--scenes", type=int, default=500, help="how many")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--output", type=Path, default=Path("stress-report"), help="folder for scenes that fail")
    options = parser.parse_args(arguments)
    console = Console()
    seeds = range(options.first, options.first + options.scenes)
    with ProcessPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        trials = []
        for trial in track(pool.map(trial_of, seeds), "running", total=len(seeds), console=console):
            trials.append(trial)
            for name, fault in trial.faults.items():
                console.print(f"seed {trial.seed}: {name}: {fault}", highlight=False, markup=False)
            if trial.faults:
                console.print(f"  left as {leave(trial, options.output)}", highlight=False, markup=False)
    print_figures(console, [trial for trial in trials if not trial.refused])
    refused = sum(bool(trial.refused) for trial in trials)
    faults = Counter(name for trial in trials for name in trial.faults)
    told = ", ".join(f"{name} {count}" for name, count in faults.items()) or "none"
    console.print(f"refused as unsound: {refused}; faults: {told}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

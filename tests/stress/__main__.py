"""Run random scenes, the same ones with other exchanges, and random pybullet worlds, and tell which of them fail.

    python -m tests.stress [--scenes N] [--exchanges N] [--worlds N] [--first SEED] [--output FOLDER]

Every scene that fails is left in the folder as a scenario file, to be looked at with `oilsim run`; an exchange or a world that fails is
had again by its seed. The exit status is 1 if one did.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from tests.stress.random_exchanges import run_exchange_trial
from tests.stress.random_scenes import random_scene
from tests.stress.trials import Trial, as_toml, run_trial
from tests.stress.world_trials import run_world_trial


def trial_of(seed: int) -> Trial:
    """Run the scene of a seed."""
    return run_trial(seed, random_scene(seed))


def leave(trial: Trial, folder: Path) -> str:
    """Write the scene that failed as a scenario file; returns how to have it again."""
    folder.mkdir(exist_ok=True)
    path = folder / f"stress-{trial.seed}.toml"
    remarks = "".join(f"# {name}: {fault}\n" for name, fault in trial.faults.items())
    path.write_text(remarks + as_toml(random_scene(trial.seed)), encoding="utf-8")
    return f"left as {path}"


def print_figures(console: Console, title: str, trials: list[Trial]) -> None:
    """How far they went, figure by figure."""
    table = Table(title=f"{len(trials)} random {title}, {sum(trial.particles for trial in trials)} particles")
    for column in ("largest of each", "of how many", "median", "95 %", "most"):
        table.add_column(column, justify="left" if column.startswith("largest") else "right")
    for name in dict.fromkeys(name for trial in trials for name in trial.figures):
        values = [trial.figures[name] for trial in trials if name in trial.figures]
        table.add_row(name, str(len(values)), *(f"{np.quantile(values, share):.3g}" for share in (0.5, 0.95, 1.0)))
    console.print(table)


def run_all(
    console: Console, title: str, run: Callable[[int], Trial], seeds: Iterable[int], left: Callable[[Trial], str]
) -> bool:
    """Run the trials of one kind and tell what came of them; whether all were good. `left` tells how to have one again that failed."""
    numbers = list(seeds)
    if not numbers:
        return True
    trials = []
    with ProcessPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        for trial in track(pool.map(run, numbers), f"running {title}", total=len(numbers), console=console):
            trials.append(trial)
            for name, fault in trial.faults.items():
                console.print(f"seed {trial.seed}: {name}: {fault}", highlight=False, markup=False)
            if trial.faults:
                console.print(f"  {left(trial)}", highlight=False, markup=False)
    print_figures(console, title, [trial for trial in trials if not trial.refused])
    refused = sum(bool(trial.refused) for trial in trials)
    faults = Counter(name for trial in trials for name in trial.faults)
    told = ", ".join(f"{name} {count}" for name, count in faults.items()) or "none"
    console.print(f"refused as unsound: {refused}; faults: {told}")
    return not faults


def main(arguments: list[str] | None = None) -> int:
    """Run what the command line asks for; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="stress",
        description="Run random scenes, exchanges and pybullet worlds, and hold them to what physics allows.",
    )
    parser.add_argument("--scenes", type=int, default=500, help="how many scenarios")
    parser.add_argument("--exchanges", type=int, default=200, help="how many scenarios with other exchanges")
    parser.add_argument("--worlds", type=int, default=100, help="how many pybullet worlds with the plugin")
    parser.add_argument("--first", type=int, default=0, help="seed of the first of either")
    parser.add_argument("--output", type=Path, default=Path("stress-report"), help="folder for scenes that fail")
    options = parser.parse_args(arguments)
    console, first = Console(), options.first
    scenes, exchanges, worlds = (range(first, first + n) for n in (options.scenes, options.exchanges, options.worlds))
    sound = run_all(console, "scenes", trial_of, scenes, lambda trial: leave(trial, options.output))
    again = "python -m tests.stress --scenes 0 --exchanges {} --worlds {} --first {}"
    sound &= run_all(console, "exchanges", run_exchange_trial, exchanges, lambda trial: again.format(1, 0, trial.seed))
    sound &= run_all(console, "worlds", run_world_trial, worlds, lambda trial: again.format(0, 1, trial.seed))
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())

"""Give oilsim random, damaged and hostile input of every kind, and tell what it does not refuse in words.

    python -m tests.fuzz [--scenarios N] [--meshes N] [--fmus N] [--recordings N] [--checkpoints N] [--orders N] [--signals N]
                         [--criteria N] [--winds N] [--resumes N] [--exports N] [--sweeps N] [--first SEED] [--workers N]

Each trial is a fork of a process that has checked every scenario of the library before, so that a trial computes only what its own input
changes. A trial is had again by its seed: `--scenarios 1 --first SEED`, and 0 of the other kinds. The exit status is 1 if one failed.
"""

from __future__ import annotations

import argparse
import io
import multiprocessing
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Collection
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path

from scenarios.cli import main as oilsim
from tests.fuzz.damaged_files import (
    checkpoint_trial,
    fmu_trial,
    make_meshes,
    make_samples,
    make_winds,
    mesh_trial,
    recording_trial,
    wind_trial,
)
from tests.fuzz.exercises import export_trial, make_exercises, resume_trial, sweep_trial
from tests.fuzz.hostile_numbers import criteria_trial, make_exercise, order_trial, signal_trial
from tests.fuzz.scenario_files import LIBRARY, check_of, scenario_trial
from tests.fuzz.trials import Outcome, tried

COUNTS = {
    "scenarios": 10_000, "meshes": 1000, "fmus": 1000, "recordings": 1000, "checkpoints": 1000, "orders": 1000, "signals": 1000,
    "criteria": 1000, "winds": 1000, "resumes": 1000, "exports": 1000, "sweeps": 1000,
}  # fmt: skip


def trials(folder: Path, kinds: Collection[str]) -> dict[str, Callable[[int], int]]:
    """Make what the trials of some kinds share, and return these by kind; a trial takes a seed."""
    found: dict[str, Callable[[int], int]] = {"criteria": criteria_trial}
    if "scenarios" in kinds:
        check_library()
        found["scenarios"] = scenario_trial
    if not {"orders", "signals"}.isdisjoint(kinds):
        exercise = make_exercise()
        found |= {
            "orders": partial(order_trial, scenario=exercise[0]),
            "signals": partial(signal_trial, exercise=exercise),
        }
    if "meshes" in kinds:
        found["meshes"] = partial(mesh_trial, meshes=make_meshes(folder))
    if "winds" in kinds:
        found["winds"] = partial(wind_trial, winds=make_winds(folder))
    of_exercises = {"resumes": resume_trial, "exports": export_trial, "sweeps": sweep_trial}
    if not of_exercises.keys().isdisjoint(kinds):
        exercises = make_exercises(folder)
        found |= {kind: partial(trial, exercises=exercises) for kind, trial in of_exercises.items()}
    of_runs = {"fmus": fmu_trial, "recordings": recording_trial, "checkpoints": checkpoint_trial}
    if not of_runs.keys().isdisjoint(kinds):
        samples = make_samples(folder)
        found |= {kind: partial(trial, samples=samples) for kind, trial in of_runs.items()}
    return found


def check_library() -> None:
    """Check every scenario of the library, which loads modules, meshes and kernels once for all trials."""
    for file in sorted(LIBRARY.glob("*.toml")):
        with redirect_stdout(io.StringIO()):
            code = oilsim(["check", file.stem])
        assert code == 0, f"check {file.stem} gave {code}"


_trial: Callable[[int], int]  # of a worker


def _take(trial: Callable[[int], int]) -> None:
    global _trial
    _trial = trial


def _run(seed: int) -> Outcome:
    return tried(partial(_trial, seed))


def run_kind(kind: str, trial: Callable[[int], int], seeds: range, workers: int) -> bool:
    """Run the trials of one kind and print what came of them; returns whether all were good."""
    begun, ends, faults = time.monotonic(), Counter[str](), 0

    slowest = 0.0
    context = multiprocessing.get_context("fork")  # workers have what the trials share, which cannot be sent to them
    with ProcessPoolExecutor(workers, context, initializer=_take, initargs=(trial,)) as pool:
        for seed, outcome in zip(seeds, pool.map(_run, seeds), strict=True):
            slowest = max(slowest, outcome.seconds)
            ends["accepted" if outcome.code == 0 else "refused"] += 1
            if outcome.fault:
                faults += 1
                how = f" ({' '.join(check_of(seed))})" if kind == "scenarios" else ""
                print(f"{kind} seed {seed}{how}: {outcome.fault}", flush=True)
    told = ", ".join(f"{count} {end}" for end, count in sorted(ends.items()))
    print(f"{kind}: {told}, {faults} faults, slowest {slowest:.1f} s, {time.monotonic() - begun:.0f} s", flush=True)
    return faults == 0


def main(arguments: list[str] | None = None) -> int:
    """Run what the command line asks for; returns the exit status."""
    parser = argparse.ArgumentParser(prog="fuzz", description="Give oilsim random, damaged and hostile input.")
    for kind, count in COUNTS.items():
        parser.add_argument(f"--{kind}", type=int, default=count, metavar="N", help=f"how many (default: {count})")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="seed of the first of each kind")
    cores = len(os.sched_getaffinity(0))
    parser.add_argument("--workers", type=int, default=cores, metavar="N", help="trials at once (default: one a core)")
    options = parser.parse_args(arguments)
    first = options.first
    with tempfile.TemporaryDirectory(prefix="oilsim-fuzz-") as folder:
        kinds = [kind for kind in COUNTS if getattr(options, kind)]
        found = trials(Path(folder), kinds)
        good = [
            run_kind(kind, found[kind], range(first, first + getattr(options, kind)), options.workers) for kind in kinds
        ]
    return 0 if all(good) else 1


if __name__ == "__main__":
    sys.exit(main())

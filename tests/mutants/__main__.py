"""Put seeded faults into a copy of the code, one at a time, and say which of them no test notices.

    python -m tests.mutants [--count 200] [--seed 0] [--only oilsim,coupling] [--seconds 120] [--recorded-runs]

A fault is noticed if a quick test fails. Tests that import the faulty file run first, then those that import it through others, until one
fails or `--seconds` of processor time are over; `--recorded-runs` puts the recorded runs of `tests.regression` behind them. Each result is
printed and written to mutants-report/results.jsonl at once, and a run that is begun again goes on where it was ended; with more `--seconds`
it tries what was not noticed again. A test that fails
without a fault as well does not count: these are looked for at the end, and their faults are tried again by the next run.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tests.mutants.mutations import Mutant, mutants_of
from tests.mutants.nearness import PACKAGES, ImportMap
from tests.mutants.trial import fault_in_place, preload, run_tests

ROOT = Path(__file__).parent.parent.parent
REPORT = ROOT / "mutants-report"
LEFT_OUT = (".*", "*.rrd", "site", "__pycache__", "*-report", "build", "dist")


class Results:
    """What came of the faults tried so far, in a file of one line each; what is known of a text that has changed is forgotten."""

    def __init__(self, file: Path) -> None:
        lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
        self._file, self.known = file, {entry["fault"]: entry for entry in map(json.loads, lines)}

    def add(self, fault: Mutant, **what: Any) -> None:
        """Write the result of a fault."""
        self.known[key(fault)] = entry = {"fault": key(fault), **what}
        with self._file.open("a", encoding="utf-8") as file:
            file.write(json.dumps(entry, ensure_ascii=False) + "\n")

    def settled(self, fault: Mutant, seconds: float) -> bool:
        """Tell whether a fault was noticed, or tests of so many seconds did not notice it."""
        entry = self.known.get(key(fault))
        return entry is not None and bool(entry["by"] or entry["limit"] >= seconds)

    def forget(self, faults: Iterable[str]) -> None:
        """Take results back."""
        for fault in faults:
            del self.known[fault]
        text = "".join(json.dumps(entry, ensure_ascii=False) + "\n" for entry in self.known.values())
        self._file.write_text(text, encoding="utf-8")

    def durations(self) -> dict[str, float]:
        """Return the longest time [s] of each file of tests that ran whole."""
        longest: dict[str, float] = {}
        for entry in self.known.values():
            for test, seconds in entry["durations"].items():
                longest[test] = max(seconds, longest.get(test, 0.0))
        return longest


def key(fault: Mutant) -> str:
    """Name a fault by its file and its line with the fault in it, which holds until that line changes."""
    return f"{fault} #{fault.start}"


def main() -> int:
    """Run the trials and print what came of them; return 1 where a fault went unnoticed."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.mutants", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200, help="faults to draw")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--only", default="", help="draw from files whose path begins so; several with commas")
    parser.add_argument("--seconds", type=float, default=120.0, help="processor time of a fault's tests")
    parser.add_argument("--recorded-runs", action="store_true", help="compare recorded runs, too; minutes each")
    chosen = parser.parse_args()
    copy, cache = REPORT / "code", REPORT / "cache"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(*LEFT_OUT))
    cache.mkdir(exist_ok=True)
    os.chdir(copy)
    os.environ["NUMBA_CACHE_DIR"] = str(cache)
    preload()
    drawn, results = draw(chosen.count, chosen.seed, chosen.only), Results(REPORT / "results.jsonl")
    imports = ImportMap()
    for number, fault in enumerate(drawn, 1):
        if not results.settled(fault, chosen.seconds):
            what = tried(fault, imports, results.durations(), cache, chosen.seconds, chosen.recorded_runs)
            results.add(fault, **what)
            print(f"{number}/{len(drawn)} {told(results.known[key(fault)])}", flush=True)
    forget_unsound(results, cache)
    return summary([results.known[key(fault)] for fault in drawn if key(fault) in results.known])


def draw(count: int, seed: int, only: str) -> list[Mutant]:
    """Draw faults evenly over all that the files of the present folder can have."""
    starts = tuple(only.split(","))
    files = [file for package in PACKAGES for file in Path(package).rglob("*.py") if str(file).startswith(starts)]
    every = [one for file in sorted(files) for one in mutants_of(file)]
    return random.Random(seed).sample(every, min(count, len(every)))


def tried(
    fault: Mutant, imports: ImportMap, durations: dict[str, float], cache: Path, seconds: float, runs: bool
) -> dict[str, Any]:
    """Run what should notice a fault, with the fault in place, and return the result's entries."""
    tests = imports.tests_of(fault.file, durations)
    with fault_in_place(fault, imports.stale(fault), cache) as trial_cache:
        outcome = run_tests(tests, trial_cache, seconds) if tests else None
        by = outcome.failed if outcome else ""
        if not by and runs and not recorded_runs_agree(trial_cache):
            by = "tests.regression"
    spent, lasted = (outcome.seconds, outcome.durations) if outcome else (0.0, {})
    whole = dict(list(lasted.items())[:-1]) if by else lasted  # the last file ended at a failure
    rounded = {test: round(time, 2) for test, time in whole.items()}
    return {"by": by, "limit": seconds, "seconds": round(spent, 1), "durations": rounded}


def recorded_runs_agree(cache: Path) -> bool:
    """Tell whether `tests.regression` finds the recorded runs unchanged."""
    surroundings = os.environ | {"PYTHONPATH": str(Path.cwd()), "NUMBA_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, "-m", "tests.regression"], env=surroundings, capture_output=True, check=False
    )
    return done.returncode == 0


def forget_unsound(results: Results, cache: Path) -> None:
    """Run the tests that noticed faults without any, and take back what those that fail again have said."""
    noticing = {entry["by"] for entry in results.known.values() if "::" in entry["by"]}
    unsound: set[str] = set()
    while left := sorted(noticing - unsound):
        outcome = run_tests(left, cache, seconds=3600.0)
        if not outcome.failed:
            break
        unsound.add(outcome.failed)
    for test in sorted(unsound):
        print(f"fails without a fault as well: {test}")
    results.forget([fault for fault, entry in results.known.items() if entry["by"] in unsound])


def told(entry: dict[str, Any]) -> str:
    """Write a result in a line."""
    return f"{'noticed' if entry['by'] else 'NOT NOTICED'} in {entry['seconds']:.0f} s: {entry['fault']} {entry['by']}"


def summary(entries: list[dict[str, Any]]) -> int:
    """Print the counts by package and what went unnoticed; return 1 if anything did."""
    survivors = [entry for entry in entries if not entry["by"]]
    for package in PACKAGES:
        own = [entry for entry in entries if entry["fault"].startswith(package)]
        if own:
            print(f"{package}: {len(own)} faults, {sum(bool(entry['by']) for entry in own)} noticed")
    print(f"{len(entries)} faults, {len(entries) - len(survivors)} noticed")
    for entry in survivors:
        print(" ", told(entry))
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())

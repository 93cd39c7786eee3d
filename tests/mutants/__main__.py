"""Put seeded faults into a copy of the code, one at a time, and say which of them no test notices.

    python -m tests.mutants [--files 40] [--each 5] [--seed 0] [--only oilsim,coupling] [--seconds 30] [--nearest 12]
                            [--recorded-runs]

Files are drawn with chances as the number of faults they can have, and `--each` faults in each. A fault is noticed if a quick test fails
within `--seconds` of processor time: the `--nearest` files of tests by imports and names are asked. Faults of one file's plain
functions are put into the live functions of one session of pytest (`session`), and meet the tests that call these. Faults in kernels
and constants are put into the file, and a fork imports, and compiles, what depends on it. `--recorded-runs` puts the recorded runs of
`tests.regression` behind the tests.

Each result is printed and written to mutants-report/results.jsonl at once. A run that is begun again goes on where it was ended; with more
`--seconds` it tries again what was not noticed.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.mutants.mutations import Mutant, mutants_of
from tests.mutants.nearness import NEAREST, PACKAGES, ImportMap, is_plain
from tests.mutants.session import run_session
from tests.mutants.trial import Outcome, fault_in_place, preload, run_tests

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


def key(fault: Mutant) -> str:
    """Name a fault by its file and its line with the fault in it, which holds until that line changes."""
    return f"{fault} #{fault.start}"


def main() -> int:
    """Run the trials and print what came of them; return 1 where a fault went unnoticed."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.mutants", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--files", type=int, default=40, help="files to draw")
    parser.add_argument("--each", type=int, default=5, help="faults to draw in each")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--only", default="", help="draw from files whose path begins so; several with commas")
    parser.add_argument("--seconds", type=float, default=30.0, help="processor time of a fault's tests")
    parser.add_argument("--nearest", type=int, default=NEAREST, help="files of tests that a fault meets")
    parser.add_argument("--recorded-runs", action="store_true", help="compare recorded runs, too; minutes each")
    chosen = parser.parse_args()
    copy, cache = REPORT / "code", REPORT / "cache"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(*LEFT_OUT))
    cache.mkdir(exist_ok=True)
    os.chdir(copy)
    os.environ["NUMBA_CACHE_DIR"] = str(cache)
    preload()
    drawn, results = draw(chosen.files, chosen.each, chosen.seed, chosen.only), Results(REPORT / "results.jsonl")
    imports, total = ImportMap(), sum(map(len, drawn))
    done = sum(results.settled(fault, chosen.seconds) for faults in drawn for fault in faults)
    for faults in drawn:
        left = [fault for fault in faults if not results.settled(fault, chosen.seconds)]
        for fault, outcome in tried(
            left, imports.tests_of(faults[0].file, chosen.nearest), imports, cache, chosen.seconds
        ):
            by = outcome.failed
            if not by and chosen.recorded_runs:
                with fault_in_place(fault, imports.stale(fault), cache) as trial_cache:
                    by = "" if recorded_runs_agree(trial_cache) else "tests.regression"
            what = {"by": by, "limit": chosen.seconds, "tests": outcome.tests, "seconds": round(outcome.seconds, 1)}
            results.add(fault, **what)
            done += 1
            print(f"{done}/{total} {told(results.known[key(fault)])}", flush=True)
    return summary([results.known[key(fault)] for faults in drawn for fault in faults])


def draw(files: int, each: int, seed: int, only: str) -> list[list[Mutant]]:
    """Draw files of the present folder, with chances as the number of faults that they can have, and faults in each."""
    starts, chance = tuple(only.split(",")), random.Random(seed)
    paths = sorted(file for package in PACKAGES for file in Path(package).rglob("*.py") if str(file).startswith(starts))
    every = {file: faults for file in paths if (faults := list(mutants_of(file)))}
    drawn: dict[Path, list[Mutant]] = {}
    while len(drawn) < min(files, len(every)):
        (file,) = chance.choices(list(every), [len(faults) for faults in every.values()])
        if file not in drawn:
            drawn[file] = chance.sample(every[file], min(each, len(every[file])))
    return list(drawn.values())


def tried(
    faults: list[Mutant], tests: list[str], imports: ImportMap, cache: Path, seconds: float
) -> Iterator[tuple[Mutant, Outcome]]:
    """Yield each fault of a file with what came of it: those of plain functions in one session, the others alone."""
    plain, alone = ([fault for fault in faults if is_plain(fault) == wanted] for wanted in (True, False))
    if plain:
        for fault, outcome in run_session(plain, tests, cache, seconds):
            if outcome is None:
                alone.append(fault)
            else:
                yield fault, outcome
    sound: dict[str, bool] = {}
    for fault in alone:
        asked, outcome = [*tests], Outcome("", 0, 0.0)
        while asked:
            with fault_in_place(fault, imports.stale(fault), cache) as trial_cache:
                outcome = run_tests(asked, trial_cache, seconds)
            name = outcome.failed
            if "::" in name and name not in sound:
                sound[name] = not run_tests([name], cache, seconds=1e3).failed
            if sound.get(name, True):
                break
            asked = [one for one in asked if one != name.partition("::")[0]]  # it fails without a fault as well
        yield fault, outcome


def recorded_runs_agree(cache: Path) -> bool:
    """Tell whether `tests.regression` finds the recorded runs unchanged."""
    surroundings = os.environ | {"PYTHONPATH": str(Path.cwd()), "NUMBA_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, "-m", "tests.regression"], env=surroundings, capture_output=True, check=False
    )
    return done.returncode == 0


def told(entry: dict[str, Any]) -> str:
    """Write a result in a line."""
    verdict = "noticed" if entry["by"] else "NOT NOTICED" if entry["tests"] else "NO TEST REACHES IT IN TIME"
    return f"{verdict} in {entry['seconds']:.0f} s: {entry['fault']} {entry['by']}"


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

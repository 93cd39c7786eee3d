"""Put seeded faults into a copy of the code, one at a time, and say which of them no test notices.

    python -m tests.mutants [--count 200] [--seed 0] [--only oilsim/sea] [--tests-only]

A fault is noticed if a test of the file's room, or one that imports its module, fails, or if one of the recorded runs of `tests.regression`
comes out otherwise. Tests stop at the first failure. numba does not see that a kernel inlined from another file has changed, so the copy's
cache forgets the kernels of every file that imports the changed one.
"""

from __future__ import annotations

import argparse
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.progress import track

from tests.mutants.mutations import Mutant, mutants_of

ROOT = Path(__file__).parent.parent.parent
PACKAGES = ("oilsim", "coupling", "booms", "vessels", "scenarios")
LIMIT = 900.0  # [s] a trial that takes longer has noticed: faults that never end are noticed
IMPORT = re.compile(r"^\s*from ([\w.]+) import|^\s*import ([\w.]+)", re.MULTILINE)


def main() -> int:
    """Run the trials and print a table; return 1 where a fault went unnoticed."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.mutants", description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200, help="faults to draw")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--only", default="", help="draw from files whose path begins so")
    parser.add_argument(
        "--tests-only", action="store_true", help="leave out the recorded runs, which take most of the time"
    )
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="oilsim-mutants-") as folder:
        copy = Path(folder) / "code"
        shutil.copytree(
            ROOT, copy, ignore=shutil.ignore_patterns(".git", ".venv", ".numba_cache", "*.rrd", "site", "__pycache__")
        )
        os.chdir(copy)
        drawn = draw(chosen.count, chosen.seed, chosen.only)
        survivors = [
            one for one in track(drawn, "faults", console=Console(stderr=True)) if not noticed(one, chosen.tests_only)
        ]
    print(f"{len(drawn)} faults, {len(drawn) - len(survivors)} noticed")
    for one in survivors:
        print("  not noticed:", one)
    return 1 if survivors else 0


def draw(count: int, seed: int, only: str) -> list[Mutant]:
    """Draw faults evenly over all that the files of the present folder can have."""
    files = sorted(file for package in PACKAGES for file in Path(package).rglob("*.py") if str(file).startswith(only))
    every = [one for file in files for one in mutants_of(file)]
    return random.Random(seed).sample(every, min(count, len(every)))


def noticed(mutant: Mutant, tests_only: bool) -> bool:
    """Run what should notice a fault, with the fault in place, the recorded runs last; leave the file as it was."""
    before = mutant.file.read_text()
    try:
        mutant.file.write_text(mutant.apply())
        forget_kernels(mutant.file)
        runs = [] if tests_only else ["tests.regression"]
        return not all(passes(command) for command in (tests_of(mutant.file), runs) if command)
    finally:
        mutant.file.write_text(before)
        forget_kernels(mutant.file)


def passes(arguments: list[str]) -> bool:
    """Tell whether `python -m` with these arguments ends in time and without a failure."""
    surroundings = os.environ | {"PYTHONPATH": str(Path.cwd()), "NUMBA_CACHE_DIR": str(Path.cwd() / ".numba_cache")}
    try:
        done = subprocess.run(
            [sys.executable, "-m", *arguments], env=surroundings, capture_output=True, timeout=LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode in (0, 5)  # 5: no test was collected


def tests_of(file: Path) -> list[str]:
    """Return the arguments of the tests of a file: its room's, and those that import its module."""
    module = ".".join(file.with_suffix("").parts)
    room = Path("tests", *file.parent.parts)
    while not room.is_dir():
        room = room.parent
    near = room.rglob("test_*.py") if room != Path("tests", file.parts[0]) else room.glob("test_*.py")
    tests = {str(one) for one in near} | {
        str(one) for one in Path("tests").rglob("test_*.py") if module in imports_of(one)
    }
    return ["pytest", "-q", "-x", "-p", "no:cacheprovider", *sorted(tests)] if tests else []


def imports_of(file: Path) -> set[str]:
    """Return the modules that a file imports, by the text of its import statements."""
    return {first or second for first, second in IMPORT.findall(file.read_text())}


def forget_kernels(changed: Path) -> None:
    """Remove compiled kernels of a file and of all that import it, directly or not, from the copy's cache."""
    cache = Path(".numba_cache")
    stale, files = {changed}, {file: imports_of(file) for package in PACKAGES for file in Path(package).rglob("*.py")}
    while True:
        modules = {".".join(one.with_suffix("").parts) for one in stale}
        more = {file for file, imported in files.items() if imported & modules} - stale
        if not more:
            break
        stale |= more
    for file in stale:
        for kept in cache.rglob(f"{file.stem}.*.nb?"):
            kept.unlink()


if __name__ == "__main__":
    sys.exit(main())

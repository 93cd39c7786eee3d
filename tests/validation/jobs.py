"""Jobs of the validation: a case at one spacing and step. Its run is kept as a record in `docs/validation/`, one file a case.

A record is stale when the code that the case imports has changed since, comments and docstrings apart. Only stale jobs are run; the oldest
knowledge counts most, so jobs without a record come first, the cheap ones before the dear ones.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import json
import math
import os
import platform
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from recordings.files.writing import write_whole
from tests.mutants.nearness import ImportMap
from tests.validation.case import Bench, Case, Map, Outcome
from tests.validation.cases import CASES

ROOT = Path(__file__).parent.parent.parent
RECORDS = ROOT / "docs" / "validation"
POINTS = 200  # of a curve that are kept
FINER = 8.0  # cost of a job over that of half its resolution, where it was not run yet

Record = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """A case at one resolution; `step_share` multiplies the longest time step and the CFL number of its fluids."""

    case: Case
    resolution: int
    step_share: float = 1.0

    def __str__(self) -> str:
        half = "" if self.step_share == 1.0 else f", {self.step_share:g} of the step"
        return f"{self.case.number} {self.case.name}, {self.case.length_symbol}/{self.resolution}{half}"

    @property
    def record(self) -> Record | None:
        """What is on record of it."""
        return record_of(self.case, self.resolution, self.step_share)

    @property
    def is_stale(self) -> bool:
        """Whether it has no record of the present code, or only a failure."""
        return self.record is None or bool(self.record["failure"]) or self.record["sources"] != sources(self.case.name)

    @property
    def cost(self) -> float:
        """Processor time [s] that it is likely to take; NaN where nothing is known of the case."""
        known = [one for one in records(self.case) if not one["failure"]]
        if not known:
            return math.nan
        near = min(known, key=lambda one: abs(math.log(one["resolution"] / self.resolution)))
        finer = self.resolution / near["resolution"]
        return float(near["cpu_s"]) * finer ** math.log2(FINER) * near["step"] / self.step_share


def jobs(cases: Sequence[Case], levels: int | None = None) -> list[Job]:
    """Return the jobs of cases, coarse to fine, then half the step at the coarsest.

    levels: how many spacings; by default as many as a case's `spacings` says.
    """
    found = [Job(case, one) for case in cases for one in case.resolutions[: levels or case.spacings]]
    return found + [Job(case, case.resolutions[0], 0.5) for case in cases if not case.own_step]


def by_worth(stale: Iterable[Job]) -> list[Job]:
    """Sort jobs: what has no record before what has an old one; the default step before half of it; cheap before dear."""

    def order(job: Job) -> tuple[bool, bool, str, float]:
        record = job.record
        cost = job.cost
        return (
            record is not None,
            job.step_share != 1.0,
            record["date"] if record else "",
            0.0 if math.isnan(cost) else cost,
        )

    return sorted(stale, key=order)


def run(job: Job, bench: Bench) -> Record:
    """Run a job and return its record; what ends it early is its failure.

    Numbers keep six digits, curves four and `POINTS` points, maps up to three.
    """
    begin = spent()
    try:
        outcome, failure = job.case.run(job.resolution, bench), ""
    except Exception as problem:  # the other jobs go on; page and exit status tell
        outcome, failure = Outcome(values={}), f"{type(problem).__name__}: {problem}"
    return {
        "resolution": job.resolution,
        "step": job.step_share,
        "date": date.today().isoformat(),
        "revision": revision(),
        "sources": sources(job.case.name),
        "machine": machine(),
        "threads": bench.threads or os.cpu_count(),
        "cpu_s": digits(spent() - begin, 3),
        "particles": bench.particles,
        "particle_steps": bench.particle_steps,
        "failure": failure,
        "values": {name: digits(value, 6) for name, value in outcome.values.items()},
        "curves": [
            {
                "panel": one.panel, "label": one.label, "reference": one.reference, "markers": one.markers,
                "x": [digits(x, 4) for x in thinned(one.x)], "y": [digits(y, 4) for y in thinned(one.y)],
            }
            for one in outcome.traces
        ],
        **({"maps": [[_kept(one) for one in row] for row in outcome.maps]} if outcome.maps else {}),
    }  # fmt: skip


def _kept(one: Map) -> Record:
    """Return what a record keeps of a map: its values to a hundredth of the largest and better."""
    places = 3 - math.ceil(math.log10(one.values.max() or 1.0))
    values = np.round(one.values, places).tolist()
    return {
        "title": one.title, "extent": list(one.extent),
        "values": [[int(value) if value.is_integer() else value for value in row] for row in values],
        "outline": [[digits(each, 3) for each in point] for point in one.outline.tolist()],
    }  # fmt: skip


def spent() -> float:
    """Processor time [s] of this process and of those that it has ended, which does not depend on what else the machine does."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def keep(case: Case, record: Record) -> None:
    """Put a record into its case's file in `RECORDS`, in place of the one of the same spacing and step; maps of the finest only."""
    kept = [one for one in records(case) if (one["resolution"], one["step"]) != (record["resolution"], record["step"])]
    kept = sorted([*kept, record], key=lambda one: (-one["step"], one["resolution"]))
    finest = max((one["resolution"] for one in kept if "maps" in one), default=0)
    for one in kept:
        if one["resolution"] < finest:
            one.pop("maps", None)  # pictures show those of the finest
    lines = ",\n".join(json.dumps(one, allow_nan=False, ensure_ascii=False) for one in kept)
    RECORDS.mkdir(parents=True, exist_ok=True)
    write_whole(record_file(case), f"[\n{lines}\n]\n")


def record_file(case: Case) -> Path:
    """Name the file of a case's records."""
    return RECORDS / f"{case.name}.json"


def records(case: Case) -> list[Record]:
    """Return what is on record of a case, the default step first, coarse to fine."""
    file = record_file(case)
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else []


def record_of(case: Case, resolution: int, step_share: float = 1.0) -> Record | None:
    """Return the record of one spacing and step, None where there is none."""
    key = (resolution, step_share)
    return next((one for one in records(case) if (one["resolution"], one["step"]) == key), None)


@functools.cache
def sources(name: str) -> str:
    """Name the code that a case runs by a hash: of each file that it imports, directly or not, without comments and docstrings."""
    case, imports = next(case for case in CASES if case.name == name), _imports()
    run = case.run.func if isinstance(case.run, functools.partial) else case.run
    reached = edge = {Path(inspect.getfile(inspect.unwrap(run))).resolve().relative_to(ROOT)}
    while edge:
        edge = {one for file in edge for one in imports.imports[file]} - reached
        reached = reached | edge
    text = "".join(f"{file}\n{code(file)}\n" for file in sorted(reached))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@functools.cache
def _imports() -> ImportMap:
    return ImportMap(ROOT)


@functools.cache
def code(file: Path) -> str:
    """Write out the syntax tree of a file without docstrings."""
    tree = ast.parse((ROOT / file).read_bytes())
    for node in ast.walk(tree):
        if (
            isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
            and ast.get_docstring(node, clean=False) is not None
        ):
            node.body = node.body[1:]
    return ast.dump(tree)


def digits(value: float, count: int) -> float | None:
    """Round to so many significant digits; None for what is not finite, which JSON has no word for."""
    return float(f"{value:.{count}g}") if math.isfinite(value) else None


def thinned(values: Any) -> list[float]:
    """Keep at most `POINTS` of a curve's numbers, the first and the last among them."""
    count = len(values)
    chosen = range(count) if count <= POINTS else [round(k * (count - 1) / (POINTS - 1)) for k in range(POINTS)]
    return [float(values[k]) for k in chosen]


def machine() -> str:
    """Processor, cores, and the versions that matter for speed."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if "model name" in line]
    model = names[0] if names else platform.processor() or platform.machine()
    return f"{model}, {os.cpu_count()} cores; Python {platform.python_version()}, numba {version('numba')}, numpy {version('numpy')}"


def revision() -> str:
    """The revision of the checkout, or "unknown"."""
    try:
        command = ["git", "describe", "--always", "--dirty"]
        return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"

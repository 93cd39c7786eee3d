"""Benchmarks as a history: `python -m tests.benchmarks.history [NAME ...]` measures, and writes one JSON a commit into docs/benchmarks.

Figures that are not asked for are those of the record before. Exercises run on a console with their recording and one page, as a class
sees them, but as fast as they can, so that a step's time is its work. `machine` is work that does not change: what it takes longer than
on another day is the machine's. Pages take the latest record (`made: speed`), and a picture shows all.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.progress import track

from recordings.files.writing import write_whole
from scenarios.spec.load import library_paths
from tests.benchmarks.calm_spread import PHASES, STEP, calm_spread, timed_step
from tests.scenarios.conduct.consoles import console
from tests.validation.jobs import ROOT, digits, machine, revision

RECORDS = ROOT / "docs" / "benchmarks"
PICTURE = ROOT / "docs" / "pictures" / "validation" / "benchmarks.svg"
SECONDS = 120.0  # of an exercise
WITH_WINDOWS = ("sweep-200m", "j-sweep-skimmer", "v-sweep", "anchored-containment", "tow-speed-trial")
MEDIAN, LATE = "median of a step", "95 % of steps below"

Figures = Iterator[tuple[str, float]]


def core() -> Figures:
    """Yield wall seconds a simulated second of `calm-spread` in its phases, on all threads."""
    fluid, steps = calm_spread(), list[tuple[float, float]]()
    fluid.advance(1e-4)  # compiles
    while fluid.time < PHASES[-1][2] - 1e-9:
        steps.append((fluid.time, 1e-3 * timed_step(fluid)[0] / STEP))
    fluid.close()
    for name, begin, end in PHASES:
        yield f"{name}, {begin:g} to {end:g} s", float(np.mean([wall for now, wall in steps if begin <= now < end]))
    yield "whole", float(np.mean([wall for _, wall in steps]))


def machine_speed() -> Figures:
    """Yield the time [ms] of a copy of 80 MB and of a product of two matrices, medians of 21."""
    numbers = np.random.default_rng(1).random((10_000, 1_000))
    for words, work in (
        ("copy of 80 MB", numbers.copy),
        ("product of matrices", lambda: numbers[:1000] @ numbers[1000:2000]),
    ):
        times = []
        for _ in range(21):
            begin = time.perf_counter()
            work()
            times.append(1e3 * (time.perf_counter() - begin))
        yield words, float(np.median(times))


def exercise(name: str, fidelity: str) -> Figures:
    """Yield the median and the 95 % of an exercise's steps, over real time."""
    text = library_paths()[name].read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        for file in library_paths()[name].parent.glob(f"{name}.*"):  # its chart, too
            shutil.copy(file, folder)
        options = ("--fidelity", fidelity, "--set", f"run.duration={SECONDS:g}")
        with console(Path(folder), text, *options) as served, served.page("instructor") as page:
            page.give("pace", value=None)
            page.give("go-on")
            page.hear(lambda page: page.told["session"]["phase"] == "ended", 10.0 * SECONDS)
        summary = json.loads((Path(folder) / "whole.json").read_text(encoding="utf-8"))
    step = 1e3 * summary["simulated_s"] / summary["steps"]
    for words, value in ((MEDIAN, summary["step_ms"]["median"]), (LATE, summary["step_ms"]["p95"])):
        yield words, value / step


BENCHES: dict[str, tuple[str, Callable[[], Figures]]] = {
    "machine": ("ms", machine_speed),
    "calm-spread": ("wall s a simulated s", core),
    **{f"{name}, live": ("of real time", partial(exercise, name, "live")) for name in WITH_WINDOWS},
    **{
        f"{name}, no particles": ("of real time", partial(exercise, name, "none"))
        for name in ("sweep-200m", "harbour-1km")
    },
}


def records() -> list[dict[str, Any]]:
    """Return all records, the oldest first."""
    return sorted(
        (json.loads(file.read_text(encoding="utf-8")) for file in RECORDS.glob("*.json")), key=lambda one: one["time"]
    )


def measure(names: list[str]) -> Path:
    """Measure the named benches, and write the record of this commit; return its file."""
    known = records()
    figures: dict[str, Any] = known[-1]["figures"] if known else {}
    for name in track(names, "benchmarks"):
        unit, bench = BENCHES[name]
        figures[name] = {
            "unit": unit,
            "values": {words: digits(value, 3) for words, value in bench()},
            "revision": revision(),
        }
    record = {
        "time": time.time(),
        "date": date.today().isoformat(),
        "revision": revision(),
        "machine": machine(),
        "figures": figures,
    }
    RECORDS.mkdir(parents=True, exist_ok=True)
    file = RECORDS / f"{record['date']}-{record['revision'].removesuffix('-dirty')}.json"
    write_whole(file, json.dumps(record, indent=1, ensure_ascii=False) + "\n")
    return file


def rows() -> Iterator[str]:
    """Yield a row of a page for each figure of the latest record: bench, figure, value, and that of the first record."""
    known = records()
    for name, bench in known[-1]["figures"].items() if known else ():
        first = next(one["figures"][name]["values"] for one in known if name in one["figures"])
        for words, value in bench["values"].items():
            yield f"{name} | {words} | {value:g} {bench['unit']} | {first.get(words, value):g} | {bench['revision']}"


def draw() -> None:
    """Draw the history of each bench's last figure but one: the calm and the median are what a user waits for."""
    known = records()
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    axes = figure.subplots()
    for name in known[-1]["figures"].keys() - {"machine"} if known else ():
        own = [one for one in known if name in one["figures"]]
        values = [list(one["figures"][name]["values"].values())[-2] for one in own]
        axes.plot([one["date"] for one in own], values, "o-", label=name, markersize=4, linewidth=1.2)
    axes.set_ylabel("wall s a simulated s")
    axes.set_yscale("log")
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(PICTURE)


def main() -> None:
    """Measure what the command line names, by default all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {'; '.join(BENCHES)}")
    names = parser.parse_args().names or list(BENCHES)
    unknown = [name for name in names if name not in BENCHES]
    if unknown:
        parser.error(f"{unknown[0]!r} is no benchmark, allowed: {'; '.join(BENCHES)}")
    print(measure(names))


if __name__ == "__main__":
    main()

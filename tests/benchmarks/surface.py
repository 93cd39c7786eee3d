"""Cost of the recorded sea: processor time of its surface and film, and the bytes they take, in a simulated second of sweep-200m.

`python -m tests.benchmarks.surface` prints a table. Processor time does not depend on what else the machine does.
"""

from __future__ import annotations

import itertools
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from coupling.master.observer_dispatch import CommunicationPoint
from recordings.frame import Frame, RunDescription
from recordings.sample import Sample
from recordings.sink.recorder import FILM_RATE
from recordings.sink.rerun_sink import RerunFile
from scenarios.load import load_scenario
from scenarios.running.assembly import build

REPEATS = 50


def cpu_time(act: Callable[[], object]) -> float:
    """Return the processor time [s] of a call, the mean of `REPEATS`."""
    act()
    began = time.process_time()
    for _ in range(REPEATS):
        act()
    return (time.process_time() - began) / REPEATS


def main() -> None:
    """Print the table."""
    scenario = load_scenario("sweep-200m").scenario
    assembly = build(scenario)
    step = scenario.run.communication_step

    def frame(index: int) -> Frame:
        return assembly.frame_source(CommunicationPoint(index, index * step, step))

    first = frame(0)
    assert first.surface is not None and first.film is not None
    bare = cpu_time(lambda: frame(0))
    surface = cpu_time(lambda: frame(0).surface) - bare
    film = cpu_time(lambda: (frame(0).surface, frame(0).film)) - surface - bare
    plain = Sample(index=0, time=0.0, phases={}, bodies={}, tensions={}, lost=None, scalars=dict(first.scalars))
    sea, oily = replace(plain, surface=first.surface), replace(plain, surface=first.surface, film=first.film)
    with tempfile.TemporaryDirectory() as folder:
        cost = {
            name: written(assembly.description, one, Path(folder))
            for name, one in zip("psf", (plain, sea, oily), strict=True)
        }
    surface += cost["s"][0] - cost["p"][0]
    film += cost["f"][0] - cost["s"][0]
    rate = scenario.recording.surface_rate
    print("| part | processor time [ms] | bytes | times a second | of a second in real time |")
    print("|---|---:|---:|---:|---:|")
    for name, seconds, size, often in (
        (f"surface of {first.surface.height.size} points", surface, cost["s"][1] - cost["p"][1], rate),
        ("film", film, cost["f"][1] - cost["s"][1], FILM_RATE),
    ):
        print(f"| {name} | {1e3 * seconds:.1f} | {size:.0f} | {often:g} | {often * seconds:.1%} |")


def written(run: RunDescription, sample: Sample, folder: Path) -> tuple[float, float]:
    """Return the processor time [s] and the bytes of writing a sample as a block of its own."""
    path = folder / "sample.rrd"
    file = RerunFile(path, run, {})
    index = itertools.count()

    def write() -> None:
        number = next(index)
        file.add(replace(sample, index=number, time=0.1 * number))
        file.write()

    write()
    before = path.stat().st_size
    seconds = cpu_time(write)
    size = (path.stat().st_size - before) / (REPEATS + 1)
    file.close()
    return seconds, size


if __name__ == "__main__":
    main()

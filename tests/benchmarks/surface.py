"""Cost of the recorded surface: its processor time, its bytes, and its part of the run.

`python -m tests.benchmarks.surface [RUN ...]` prints a table. Processor time does not depend on what else the machine does. The runs are
`sea` (sweep-200m, by formulas: a simulated second may take a second), `tank` (u-sweep) and `window` (sweep-200m with a window), whose
simulated second takes the processor time of its own steps.
"""

from __future__ import annotations

import itertools
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from recordings.model.frame import Frame, RunDescription
from recordings.model.sample import Sample
from recordings.sink.recorder import FILM_RATE
from recordings.sink.rerun_sink import RerunFile
from scenarios.running.assembly import Assembly, build
from scenarios.running.run import surface_rate
from scenarios.spec.load import load_scenario

REPEATS = 20
STEPS = 20  # [1] of a run with particles, after one that compiles
RUNS = {"sea": ("sweep-200m", ()), "tank": ("u-sweep", ()), "window": ("sweep-200m", ("fidelity=live",))}


def cpu_time(act: Callable[[], object], repeats: int = REPEATS) -> float:
    """Return the processor time [s] of a call, the mean of some after the first."""
    act()
    began = time.process_time()
    for _ in range(repeats):
        act()
    return (time.process_time() - began) / repeats


def rows_of(name: str) -> list[str]:
    """Return the rows of a run: its surface, and the film on it if there is one."""
    scenario, overrides = RUNS[name]
    assembly = build(load_scenario(scenario, overrides=overrides).scenario)
    simulation = assembly.co_simulation()
    simulation.initialize()
    step, second = assembly.scenario.run.communication_step, 1.0
    if name != "sea":
        second = cpu_time(simulation.step, STEPS) / step
    found = _costs(assembly, lambda: assembly.frame_source(simulation.communication_point))
    simulation.terminate()
    rates = {"surface": surface_rate(assembly.scenario), "film": FILM_RATE}
    return [
        f"| {name} | {part} of {points} points | {1e3 * seconds:.1f} | {size:.0f} | {rates[part]:g} | {second:.1f} "
        f"| {rates[part] * seconds / second:.1%} |"
        for part, (points, seconds, size) in found.items()
    ]


def _costs(assembly: Assembly, frame: Callable[[], Frame]) -> dict[str, tuple[int, float, float]]:
    """Return points, processor time [s] and bytes of a run's surface and film, those of making and of writing together."""
    first = frame()
    assert first.surface is not None
    plain = Sample(
        index=0, time=0.0, phases={}, bodies={}, tensions={}, held_speeds={}, lost=None, scalars=dict(first.scalars)
    )
    samples = {"plain": plain, "surface": replace(plain, surface=first.surface)}
    seconds = {"plain": cpu_time(frame), "surface": cpu_time(lambda: frame().surface)}
    points = {"surface": first.surface.height.size}
    if first.film is not None:
        samples["film"] = replace(samples["surface"], film=first.film)
        seconds["film"] = cpu_time(lambda: frame().film)
        points["film"] = first.film.thickness.size
    with tempfile.TemporaryDirectory() as folder:
        written = {name: _written(assembly.description, one, Path(folder)) for name, one in samples.items()}
    names = list(samples)
    return {
        name: (
            points[name],
            seconds[name] - seconds[before] + written[name][0] - written[before][0],
            written[name][1] - written[before][1],
        )
        for before, name in itertools.pairwise(names)
    }


def _written(run: RunDescription, sample: Sample, folder: Path) -> tuple[float, float]:
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


def main() -> None:
    """Print the table."""
    print("| run | part | processor time [ms] | bytes | times a second | processor time of a second [s] | part of it |")
    print("|---|---|---:|---:|---:|---:|---:|")
    for name in sys.argv[1:] or RUNS:
        print("\n".join(rows_of(name)), flush=True)


if __name__ == "__main__":
    main()

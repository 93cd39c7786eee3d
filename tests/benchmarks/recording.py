"""What recording costs: milliseconds and megabytes a frame for the particles of `calm-spread`, and the share of its run time.

Run with ``python -m tests.benchmarks.recording``. Made-up frames have random positions, the worst case for compression; the frames of
the run itself are those of its first third of a second.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from recordings.model.frame import BodyFrame, Event, Frame, PhaseDescription, PhaseFrame, RunDescription
from recordings.sink.recorder import Recorder
from scenarios.running.assembly import build
from scenarios.running.run import recording_grid, thinning
from scenarios.spec.load import load_scenario
from scenarios.spec.scenario import Scenario

FRAMES = 60
FRAME_RATE = 30.0
OCEAN, OIL = 78_408, 8_192
SPACING = 0.03
BODIES = 62
RUN_FRAMES, EVERY_STEP = 10, 3
EVERY_FRAME = 1e6  # [1/s] is given, so that all are recorded
Terms = tuple[float | None, dict[str, int]]
FULL: Terms = (None, {})
MADE_UP: dict[str, tuple[int, Terms]] = {
    "made up, full precision": (0, FULL),
    f"made up, full precision, boom of {BODIES}, a quarter of the oil lost": (BODIES, FULL),
    "made up, grid 1/2048 m": (0, (1 / 2048, {})),
    "made up, grid 1/1024 m, ocean every 2nd": (0, (1 / 1024, {"ocean": 2})),
}


def _frame(index: int, bodies: int) -> Frame:
    """Particles everywhere in the sea and the slick of `calm-spread`."""
    random = np.random.default_rng(index)
    ocean = random.uniform([0.0, 0.0, 0.0], [4.0, 2.0, 0.3], (OCEAN, 3)).astype(np.float32)
    oil = random.uniform([0.0, 0.0, 0.3], [4.0, 2.0, 0.33], (OIL, 3)).astype(np.float32)
    ids = np.arange(OCEAN + OIL, dtype=np.uint32)
    fate = (np.arange(OIL) < (OIL // 4 if bodies else 0)).astype(np.uint8)
    phases = {"ocean": PhaseFrame(ocean, ids[:OCEAN]), "oil": PhaseFrame(oil, ids[OCEAN:], fate=fate)}
    upright = np.array([0.0, 0.0, 0.0, 1.0])
    segments = {
        f"boom/segment-{i:02d}": BodyFrame(position=random.normal(size=3), orientation=upright, tension=random.normal())
        for i in range(bodies)
    }
    scalars = {f"series-{i}": float(random.normal()) for i in range(20)}
    return Frame(
        index=index,
        time=index / FRAME_RATE,
        bodies=segments,
        scalars=scalars,
        read_phases=lambda: phases,
    )


class _Keeper:
    """An observer that keeps every third frame, particles included."""

    def __init__(self, kept: list[Frame]) -> None:
        self._kept = kept

    def initialized(self, run: RunDescription) -> None:
        """The run begins."""

    def step_completed(self, frame: Frame) -> None:
        """Keep it, read while it is there."""
        if frame.index % EVERY_STEP == 0:
            frame.read_particles()
            self._kept.append(frame)

    def event(self, event: Event) -> None:
        """The log is not kept."""

    def terminated(self, reason: str) -> None:
        """Nothing is left to do."""


def measure(frames: Sequence[Frame], terms: Terms) -> tuple[float, float, float]:
    """Mean wall and processor time [ms] and file size [MB] of one frame, opening and closing the file included."""
    precision, every = terms
    phases = (
        PhaseDescription(name="ocean", rest_density=1027.0),
        PhaseDescription(name="oil", rest_density=840.0, is_oil=True),
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "benchmark.rrd"
        recorder = Recorder(path, EVERY_FRAME, precision=precision, every=every)
        begun, worked = time.perf_counter(), time.process_time()
        recorder.initialized(
            RunDescription(
                name="benchmark", particle_spacing=SPACING, phases=phases, fates=("contained", "lost_drainage")
            )
        )
        for frame in frames:
            recorder.step_completed(frame)
        recorder.terminated("completed")
        wall, processor = time.perf_counter() - begun, time.process_time() - worked
        return wall / len(frames) * 1e3, processor / len(frames) * 1e3, path.stat().st_size / len(frames) / 1e6


def frames_of(scenario: Scenario) -> tuple[list[Frame], float]:
    """The first frames of a run, thirty a second or a little more, and the wall time [s] of a simulated second."""
    kept: list[Frame] = []
    simulation = build(scenario).co_simulation([_Keeper(kept)])
    simulation.initialize()
    simulation.step()
    begun, since = time.perf_counter(), simulation.communication_point.time
    while len(kept) < RUN_FRAMES:
        simulation.step()
    wall, simulated = time.perf_counter() - begun, simulation.communication_point.time - since
    simulation.terminate("measured")
    return kept, wall / simulated


def main() -> None:
    """Print the table."""
    scenario = load_scenario("calm-spread").scenario
    own: Terms = (
        recording_grid(scenario.recording.precision, scenario.fluid.particle_spacing),
        thinning(scenario.phases),
    )
    run, second = frames_of(scenario)
    cases = {
        name: ([_frame(index, bodies) for index in range(FRAMES)], terms) for name, (bodies, terms) in MADE_UP.items()
    }
    by_default = f"grid 1/{1.0 / (own[0] or 1.0):g} m, ocean every 2nd (default)"
    cases |= {f"made up, {by_default}": (cases["made up, full precision"][0], own)}
    cases |= {"calm-spread, full precision": (run, FULL), f"calm-spread, {by_default}": (run, own)}
    title = f"recording {OCEAN + OIL:,} particles, {FRAME_RATE:g} frames a simulated second, which takes {second:.0f} s"
    table = Table(title=title)
    for heading in ("what", "wall ms", "processor ms", "share of run time", "MB a frame"):
        table.add_column(heading, justify="left" if heading == "what" else "right")
    measure(run[:1], FULL)  # loads the library
    for name, (frames, terms) in cases.items():
        wall, processor, megabytes = measure(frames, terms)
        share = 100.0 * FRAME_RATE * 1e-3 * wall / second
        table.add_row(name, f"{wall:.2f}", f"{processor:.2f}", f"{share:.2f} %", f"{megabytes:.3f}")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()

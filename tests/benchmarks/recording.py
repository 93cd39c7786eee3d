"""What recording costs: milliseconds and megabytes a frame for the particles of `calm-spread`.

Run with ``python -m tests.benchmarks.recording``. Positions are random, the worst case for compression.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from recordings.frame import BodyFrame, Frame, PhaseDescription, PhaseFrame, RunDescription
from recordings.recorder import Recorder

FRAMES = 60
FRAME_RATE = 30.0
OCEAN, OIL = 78_408, 8_192
SPACING = 0.03
BODIES = 62
CASES: dict[str, tuple[int, float | None, dict[str, int]]] = {
    "full precision": (0, None, {}),
    f"full precision, boom of {BODIES}, a quarter of the oil lost": (BODIES, None, {}),
    "grid 1/4096 m": (0, 1 / 4096, {}),
    "grid 1/1024 m": (0, 1 / 1024, {}),
    "grid 1/256 m": (0, 1 / 256, {}),
    "grid 1/1024 m, ocean every 2nd": (0, 1 / 1024, {"ocean": 2}),
    "grid 1/1024 m, ocean every 4th": (0, 1 / 1024, {"ocean": 4}),
}


def _frame(index: int, bodies: int) -> Frame:
    """Particles everywhere in the sea and the slick of `calm-spread`."""
    random = np.random.default_rng(index)
    ocean = random.uniform([0.0, 0.0, 0.0], [4.0, 2.0, 0.3], (OCEAN, 3)).astype(np.float32)
    oil = random.uniform([0.0, 0.0, 0.3], [4.0, 2.0, 0.33], (OIL, 3)).astype(np.float32)
    ids = np.arange(OCEAN + OIL, dtype=np.uint32)
    phases = {"ocean": PhaseFrame(ocean, ids[:OCEAN]), "oil": PhaseFrame(oil, ids[OCEAN:])}
    upright = np.array([0.0, 0.0, 0.0, 1.0])
    segments = {
        f"boom/segment-{i:02d}": BodyFrame(position=random.normal(size=3), orientation=upright, tension=random.normal())
        for i in range(bodies)
    }
    lost = {"drainage": ids[OCEAN : OCEAN + OIL // 4]} if bodies else {}
    scalars = {f"series-{i}": float(random.normal()) for i in range(20)}
    return Frame(
        index=index,
        time=index / FRAME_RATE,
        bodies=segments,
        scalars=scalars,
        read_phases=lambda: phases,
        read_lost=lambda: lost,
    )


def measure(bodies: int, precision: float | None, every: dict[str, int]) -> tuple[float, float, float]:
    """Mean wall and processor time [ms] and file size [MB] of one frame, opening and closing the file included."""
    frames = [_frame(index, bodies) for index in range(FRAMES)]
    phases = (PhaseDescription(name="ocean", rest_density=1027.0), PhaseDescription(name="oil", rest_density=840.0))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "benchmark.rrd"
        recorder = Recorder(path, FRAME_RATE, precision=precision, every=every)
        begun, worked = time.perf_counter(), time.process_time()
        recorder.initialized(RunDescription(name="benchmark", particle_spacing=SPACING, phases=phases))
        for frame in frames:
            recorder.step_completed(frame)
        recorder.terminated("completed")
        wall, processor = time.perf_counter() - begun, time.process_time() - worked
        return wall / FRAMES * 1e3, processor / FRAMES * 1e3, path.stat().st_size / FRAMES / 1e6


def main() -> None:
    """Print the table."""
    table = Table(title=f"recording {OCEAN + OIL:,} particles, {FRAME_RATE:g} frames a simulated second")
    for heading in ("what", "wall ms", "processor ms", "MB a frame"):
        table.add_column(heading, justify="left" if heading == "what" else "right")
    measure(0, None, {})  # loads the library
    for name, case in CASES.items():
        wall, processor, megabytes = measure(*case)
        table.add_row(name, f"{wall:.2f}", f"{processor:.2f}", f"{megabytes:.3f}")
    Console().print(table)


if __name__ == "__main__":
    main()

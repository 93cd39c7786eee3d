"""The wall time of single steps in the scene of Fig. 2 at its full size, as in Fig. 6."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from tests.paper.scenes import OURS, PAPER, Scene, Setting

STEP = 0.01  # [s] the paper's, held by its scheme
SIZE = "fluid.particle_spacing=0.03"  # the paper's


@dataclass(frozen=True, kw_only=True)
class Timing:
    """Wall times [ms] (N,) of steps; simulated: the time [s] that they cover; particles of the liquids."""

    name: str
    viscosity: float
    milliseconds: tuple[float, ...]
    simulated: float
    particles: int

    @property
    def a_second(self) -> float:
        """Wall seconds a simulated second."""
        return 1e-3 * sum(self.milliseconds) / self.simulated


def schemes() -> dict[str, Setting]:
    """Return the settings of Fig. 6 by name: the paper's two, and ours."""
    held = (f"fluid.minimum_time_step={STEP}", f"fluid.maximum_time_step={STEP}")
    return {
        "DFPBF (ω = 0)": Setting(name=PAPER.name, entries=(*PAPER.entries, *held, "fluid.relaxation=0")),
        "rDFPBF (ω = 0.1)": Setting(name=PAPER.name, entries=(*PAPER.entries, *held, "fluid.relaxation=0.1")),
        "split scheme, SI": OURS,
    }


def timed(name: str, setting: Setting, viscosity: float, until: float, threads: int) -> Timing:
    """Run the scene from its start to a time [s], and take the time of every step."""
    scene = Scene(
        scenario="calm-spread", setting=setting, viscosity=viscosity, duration=until, moments=(), entries=(SIZE,)
    )
    fluid = scene.build(threads).fluid
    fluid.advance(1e-4)  # compiles
    begun, spent, taken = fluid.time, 0.0, []
    while fluid.time < until - 1e-9 or not taken:
        begin = time.perf_counter()
        report = fluid.advance(STEP)
        spent += 1e3 * (time.perf_counter() - begin)
        if report.sub_steps:  # ours may end none within 10 ms
            taken += [spent / report.sub_steps] * report.sub_steps
            spent = 0.0
    fluid.close()
    return Timing(
        name=name,
        viscosity=viscosity,
        milliseconds=tuple(np.round(taken, 3)),
        simulated=until - begun,
        particles=fluid.particle_count,
    )

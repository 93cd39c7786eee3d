"""Time a step of a slick: `python -m tests.benchmarks.slick [PARCELS]`.

Prints the median over 200 steps of 0.1 s, as wall time and as time of this thread on a processor; on a busy machine only the latter means
something. 20 m3 of oil of 300 s age, in a current of 0.4 m/s with a diffusivity of 0.1 m2/s, ahead of a boom of 67 segments; first all are
afloat, then the boom holds most and loses some.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import Boom
from oilsim.slick.loss_rate import Pools
from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick, SlickSettings
from tests.oilsim.slick.flows import UniformFlow

STEP = 0.1
FLOW = UniformFlow((0.4, 0.0))


def slick_before_boom(parcels: int, distance: float, radius: float, boom: bool = True) -> Slick:
    """A slick of some radius [m], and a boom whose apex is `distance` [m] down the flow."""
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 68)
    line = np.stack([distance - 60.0 + 60.0 * np.cos(turn), 60.0 * np.sin(turn)], axis=1)
    barriers = [Boom(name="boom", nodes=line, draft=0.6)] if boom else []
    slick = Slick(SlickSettings(loss_volume=0.002, diffusivity=0.1), barriers)
    oil = Oil(density=875.0, dynamic_viscosity=0.02, interfacial_tension=0.02)
    slick.release(oil, 20.0, count=parcels, center=(0.0, 0.0), radius=radius, age=300.0)
    return slick


def loss_rate(pools: Pools) -> Mapping[LossCause, NDArray[np.float64]]:
    """A share of each pool (P,) [m3/s]."""
    return {LossCause.ENTRAINMENT: 1e-4 * pools.volume}


def median_times(slick: Slick, steps: int) -> tuple[float, float]:
    """Median wall time and processor time [ms] of a step."""
    wall, processor = [], []
    for step in range(steps):
        begin = time.perf_counter(), time.thread_time()
        slick.step(FLOW, step * STEP, STEP, loss_rate)
        wall.append(time.perf_counter() - begin[0])
        processor.append(time.thread_time() - begin[1])
    return 1e3 * float(np.median(wall)), 1e3 * float(np.median(processor))


def main(parcels: int) -> None:
    """Print one line for each state of the slick."""
    median_times(slick_before_boom(parcels, 200.0, 40.0), 5)  # compiles
    held = slick_before_boom(parcels, 60.0, 30.0)
    for step in range(800):
        held.step(FLOW, 0.5 * step, 0.5, loss_rate)
    cases = {
        "afloat, no boom": slick_before_boom(parcels, 0.0, 40.0, boom=False),
        "afloat, boom": slick_before_boom(parcels, 200.0, 40.0),
        f"{100.0 * held.oil.contained / 20.0:.0f} % held": held,
    }
    for name, slick in cases.items():
        wall, processor = median_times(slick, 200)
        print(
            f"{name:20} {len(slick.parcels):6d} parcels: {processor:.2f} ms of a processor, {wall:.2f} ms on the clock"
        )
    print("load", " ".join(f"{load:.1f}" for load in os.getloadavg()), "on", os.cpu_count(), "processors")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)

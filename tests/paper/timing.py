"""The wall time of single steps in the scene of Fig. 2, as in Fig. 6."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tests.paper.scenes import OURS, PAPER, Scene, Setting

STEP = 0.01  # [s] the paper's, held by its scheme
SIZE = "fluid.particle_spacing=0.065"  # the paper has 0.03, and eleven times as many particles


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


def timed_in_turn(settings: Mapping[str, Setting], viscosity: float, until: float, threads: int) -> list[Timing]:
    """Run the scene in each setting from its start to a time [s], `STEP` by `STEP` in turn, and take the time of every step.

    So work of others on the machine slows all settings alike.
    """
    clocks = [_Clock(name, setting, viscosity, until, threads) for name, setting in settings.items()]
    going = clocks
    while going:
        going = [clock for clock in going if clock.tick()]
    return [clock.stop() for clock in clocks]


class _Clock:
    """One run and the wall times [ms] of its steps so far."""

    def __init__(self, name: str, setting: Setting, viscosity: float, until: float, threads: int) -> None:
        scene = Scene(
            scenario="calm-spread", setting=setting, viscosity=viscosity, duration=until, moments=(), entries=(SIZE,)
        )
        self._name, self._viscosity, self._until = name, viscosity, until
        self._fluid = scene.build(threads).fluid
        self._fluid.advance(1e-4)  # compiles
        self._begun, self._spent = self._fluid.time, 0.0
        self._taken: list[float] = []

    def tick(self) -> bool:
        """Go on by `STEP`; return whether there is more to do."""
        if self._fluid.time >= self._until - 1e-9:
            return False
        begin = time.perf_counter()
        report = self._fluid.advance(STEP)
        self._spent += 1e3 * (time.perf_counter() - begin)
        if report.sub_steps:  # ours may end none within 10 ms
            self._taken += [self._spent / report.sub_steps] * report.sub_steps
            self._spent = 0.0
        return True

    def stop(self) -> Timing:
        """Close the run and return its times."""
        count, covered = self._fluid.particle_count, self._fluid.time - self._begun
        self._fluid.close()
        taken = tuple(np.round(self._taken, 3))
        return Timing(
            name=self._name, viscosity=self._viscosity, milliseconds=taken, simulated=covered, particles=count
        )

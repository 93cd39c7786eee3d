"""The runs behind the figures of Qiu et al. (2021): the shipped scenes of the paper, each in the paper's setting and in ours."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from scenarios.running.assembly import Assembly, build
from scenarios.spec.load import load_scenario
from tests.validation.case import Bench, Quantity

SAMPLE = 0.05  # [s] between measurements
OILS = (2.6e-3, 9.0e-3, 1.0e-1)  # [Pa s] the paper's three
CORRECTION = 1.0e4  # γ of the paper's Eq. 29
TANK = 4.0  # [m] length of the paper's box

Seen = TypeVar("Seen")


@dataclass(frozen=True)
class Setting:
    """A way to compute: its name in pictures and tables, and entries of the scenario."""

    name: str
    entries: tuple[str, ...]


PAPER = Setting(
    "paper's scheme", ("fluid.scheme=paper", f"fluid.viscosity_correction={CORRECTION}", "fluid.maximum_time_step=0.01")
)
OURS = Setting("split scheme", ("fluid.scheme=split", "fluid.viscosity_correction=1"))
THICK = Setting("split scheme, thick oil", OURS.entries)  # as thick as γ makes it, in water


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One run: scenario, setting, the oil's viscosity [Pa s], particle spacing and duration [m, s], and other entries."""

    scenario: str
    setting: Setting
    viscosity: float
    spacing: float
    duration: float
    entries: tuple[str, ...] = ()

    def build(self, threads: int | None) -> Assembly:
        """Build the run on so many threads, None for all cores."""
        changes = [f"phases.oil.dynamic_viscosity={self.viscosity}", f"fluid.particle_spacing={self.spacing}"]
        changes += [] if threads is None else [f"run.threads={threads}"]
        return build(load_scenario(self.scenario, overrides=[*self.setting.entries, *changes, *self.entries]).scenario)


def follow(scenes: Sequence[Scene], bench: Bench, look: Callable[[Assembly], Seen]) -> dict[Scene, list[Seen]]:
    """Run scenes one after the other, and look at each at its begin and after every `SAMPLE` [s]."""
    bench.plan(sum(scene.duration for scene in scenes))
    found = {}
    for scene in scenes:
        assembly = scene.build(bench.threads)
        seen = found[scene] = [look(assembly)]
        for _ in range(round(scene.duration / SAMPLE)):
            bench.advance(assembly.fluid, SAMPLE)
            seen.append(look(assembly))
        assembly.fluid.close()
    return found


def over(part: float, whole: float) -> float:
    """Return a ratio; infinite, which is below no bound, where the divisor is not positive."""
    return part / whole if whole > 0.0 else math.inf


def figure(name: str, below: float | None = None, unit: str = "1") -> Quantity:
    """Describe a positive figure that is to be below a bound, or without one is only reported."""
    return Quantity(name=name, unit=unit, reference=math.nan if below is None else 0.0, scale=1.0, gate=below)

"""What a validation case is: the quantities it measures, their references and gates, and what one run of it gives."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim import AdvanceReport, Fluid, FluidConfig
from oilsim.fluid.time_step import equal_steps

Double = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One measured figure and what it should be.

    reference  the value of theory or experiment, in `unit`
    gate       largest error that passes; None for a figure that is only reported
    scale      what the error |value - reference| is divided by; None takes |reference|
    change     largest relative change from the middle to the finest run that passes; None asks for none
    """

    name: str
    unit: str
    reference: float
    gate: float | None = None
    scale: float | None = None
    change: float | None = None

    def error(self, value: float) -> float:
        """|value - reference| / scale."""
        return abs(value - self.reference) / (abs(self.reference) if self.scale is None else self.scale)

    def passes(self, values: list[float]) -> bool | None:
        """Whether the last of `values` (coarse to fine) keeps the gates; None where there is none."""
        if self.gate is None and self.change is None:
            return None
        good = math.isfinite(values[-1]) and (self.gate is None or self.error(values[-1]) <= self.gate)
        if self.change is not None:
            good = good and len(values) > 1 and abs(values[-2] - values[-1]) <= self.change * abs(values[-1])
        return good


@dataclass(frozen=True)
class Trace:
    """A curve of a panel: abscissa and ordinate (n,), in the panel's units; `reference` marks theory and experiment."""

    panel: str
    x: Double
    y: Double
    label: str = ""
    reference: bool = False
    markers: bool = False


def trace(
    panel: str, x: ArrayLike, y: ArrayLike, label: str = "", reference: bool = False, markers: bool = False
) -> Trace:
    """A `Trace` from anything that becomes an array."""
    return Trace(panel, np.asarray(x, np.float64), np.asarray(y, np.float64), label, reference, markers)


@dataclass(frozen=True)
class Map:
    """A picture: the range of both axes (x0, x1, y0, y1) [m], values (rows, columns) from below, and the outline (n, 2) [m] of a body."""

    title: str
    extent: tuple[float, float, float, float]
    values: Double
    outline: Double = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What one run measured: a value per quantity's name (NaN where it could not be had), the curves to draw, and rows of maps."""

    values: dict[str, float]
    traces: tuple[Trace, ...] = ()
    maps: tuple[tuple[Map, ...], ...] = ()


@dataclass(frozen=True)
class Panel:
    """One set of axes of a case's picture: labels with units, whether they are logarithmic, and the ordinate's range if it is cut.

    band: from, to and name of a range of the abscissa that is shaded.
    """

    name: str
    x_label: str
    y_label: str
    log_x: bool = False
    log_y: bool = False
    y_range: tuple[float, float] | None = None
    band: tuple[float, float, str] | None = None


@dataclass
class Bench:
    """Where a case runs: makes its fluids, advances them and keeps count of the work.

    threads   threads of each fluid; None takes every core
    progress  called with the share of the run that is done, 0 to 1
    step_share  what the fluids' time steps are multiplied by
    """

    threads: int | None = None
    progress: Callable[[float], None] = lambda share: None
    step_share: float = 1.0
    particles: int = 0  # at most, of one fluid
    particle_steps: int = 0
    _planned: float = field(default=1.0, init=False)
    _done: float = field(default=0.0, init=False)

    def plan(self, duration: float) -> None:
        """Announce how much time [s] the fluids of this run will simulate altogether."""
        self._planned, self._done = duration, 0.0

    def fluid(self, config: FluidConfig) -> Fluid:
        """A fluid on this bench."""
        return Fluid(config, threads=self.threads) if self.step_share == 1.0 else _InShorterSteps(self, config)

    def advance(self, fluid: Fluid, duration: float) -> AdvanceReport:
        """Advance `fluid` by `duration` [s] and count it."""
        report = fluid.advance(duration)
        self.count(duration, report.sub_steps, fluid.particle_count)
        return report

    def count(self, duration: float, steps: int, particles: int) -> None:
        """Count the work of something that went on by `duration` [s] in so many steps."""
        self.particles = max(self.particles, particles)
        self.particle_steps += steps * particles
        self._done += duration
        self.progress(min(1.0, self._done / self._planned))


class _InShorterSteps(Fluid):
    """A fluid on a bench, whose steps are the bench's share of those that it would take, whatever would limit them."""

    def __init__(self, bench: Bench, config: FluidConfig) -> None:
        super().__init__(config, threads=bench.threads)
        self._share, self._asked = bench.step_share, 0.0

    def advance(self, duration: float) -> AdvanceReport:
        self._asked = duration
        return super().advance(duration)

    def _time_step(self) -> float:
        step = super()._time_step()
        return self._share * (equal_steps(self._asked, step) if self._keeps_step() else step)


@dataclass(frozen=True, kw_only=True)
class Case:
    """A validation case.

    number       its number in the list of cases
    name         what `CASE=` takes
    source       formula or publication behind the reference
    setup        one sentence on geometry, liquids and duration
    length       reference length [m] and its symbol; a run of resolution n has the spacing length / n
    resolutions  coarse to fine, the last one is the reference
    run          run(resolution, bench) -> Outcome
    spacings     how many of them, coarse first, a run of all cases takes; asked for by name a case runs them all
    own_step     whether its fluids have the step of a scenario: half of it is not asked for
    map_label    what its maps show, with the unit
    note         limits of the measurement, for the report
    """

    number: int
    name: str
    title: str
    source: str
    setup: str
    length: float
    length_symbol: str
    resolutions: tuple[int, ...]
    quantities: tuple[Quantity, ...]
    panels: tuple[Panel, ...]
    run: Callable[[int, Bench], Outcome]
    spacings: int = 3
    own_step: bool = False
    map_label: str = ""
    note: str = ""

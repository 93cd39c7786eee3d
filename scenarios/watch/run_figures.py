"""Figures on the run itself: time step, iterations, errors, energy, and simulated time over wall time."""

from __future__ import annotations

import time as wall_clock
from collections.abc import Callable

from oilsim import AdvanceReport
from oilsim.fluid.views import JointReadings


class RunFigures:
    """Reads the figures of a run from its fluid, and keeps its pace: simulated time over wall time in the last step."""

    def __init__(self, fluid: JointReadings, report: Callable[[], AdvanceReport | None]) -> None:
        """`report` gives the fluid's report on its last advance; None before the first."""
        self._fluid = fluid
        self._report = report
        self._last: tuple[float, float] | None = None  # simulated and wall time [s]
        self._pace: float | None = None

    def advance(self, time: float) -> None:
        """Note that the run has come to simulated `time` [s] now."""
        now = wall_clock.perf_counter()
        if self._last is not None and now > self._last[1]:
            self._pace = (time - self._last[0]) / (now - self._last[1])
        self._last = (time, now)

    def series(self) -> dict[str, float]:
        """Return the figures at the last communication point, named ``metrics/<name>``."""
        figures = {"metrics/kinetic_energy": float(self._fluid.energy().kinetic)}
        if self._pace is not None:
            figures["metrics/real_time_factor"] = self._pace
        report = self._report()
        if report is not None:
            figures["metrics/time_step"] = report.time_step
            figures["metrics/residual_density"] = report.density_error
            figures["metrics/residual_divergence"] = report.divergence_error
            figures |= {f"metrics/iterations_{kind}": count for kind, count in report.iterations.items()}
            if self._fluid.may_sleep:
                figures["metrics/particles_asleep"] = float(report.asleep)
        return figures

"""The accounts of a run, which advance once at every communication point, whether or not anybody watches."""

from __future__ import annotations

import time as wall_clock
from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass
from typing import Any

from coupling.master.co_simulation import CommunicationPoint
from oilsim import AdvanceReport, Fluid
from oilsim.accounts.ledger import Ledger, ledger_from
from scenarios.watch.boom_scoring import Scoring
from scenarios.watch.coupling_series import CouplingAccount

_PLAIN = ("steps", "stage_seconds", "iteration_sums", "error_sum", "largest_error")


class RunFigures:
    """Figures of the fluid's solves, their sums over all steps, and the run's pace; only `advance` changes them.

    steps            communication steps made
    stage_seconds    wall time [s] by stage of the fluid's step
    iteration_sums   mean iterations of each communication step, summed, by solve
    error_sum        mean compression of each communication step, summed; largest_error: of any particle
    budget           energy and momentum of the liquid, cause by cause; None unless the run keeps it
    """

    def __init__(self, fluid: Fluid, report: Callable[[], AdvanceReport | None]) -> None:
        """`report` gives the fluid's report on its last advance; None before the first."""
        self._fluid, self._report = fluid, report
        self._last: tuple[float, float] | None = None  # simulated and wall time [s]
        self._pace: float | None = None
        self.steps, self.error_sum, self.largest_error = 0, 0.0, 0.0
        self.stage_seconds = dict[str, float]()
        self.iteration_sums = dict.fromkeys(("density", "divergence", "viscosity"), 0.0)
        self.budget: Ledger | None = None

    def advance(self, point: CommunicationPoint) -> None:
        """Note that the run has come to a communication point now, and add the step to it."""
        now = wall_clock.perf_counter()
        if self._last is not None and now > self._last[1]:
            self._pace = (point.time - self._last[0]) / (now - self._last[1])
        self._last = (point.time, now)
        report = self._report()
        if point.index == 0 or report is None:
            return
        self.steps += 1
        self.error_sum += report.density_error
        self.largest_error = max(self.largest_error, report.density_error_max)
        for kind in self.iteration_sums:
            self.iteration_sums[kind] += report.iterations[kind]
        if report.budget is not None:
            self.budget = report.budget if self.budget is None else self.budget + report.budget
        for stage, seconds in report.stage_seconds.items():
            self.stage_seconds[stage] = self.stage_seconds.get(stage, 0.0) + seconds

    @property
    def mean_error(self) -> float | None:
        """Mean over the steps of the mean compression; None before the first step."""
        return self.error_sum / self.steps if self.steps else None

    @property
    def mean_iterations(self) -> dict[str, float | None]:
        """Mean iterations over the steps, by solve; None before the first step."""
        return {kind: total / self.steps if self.steps else None for kind, total in self.iteration_sums.items()}

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
            if self._fluid.config.sleep_speed > 0.0:
                figures["metrics/particles_asleep"] = float(report.asleep)
        return figures

    def save_state(self) -> dict[str, Any]:
        """Return the sums as plain data; the pace belongs to the machine alone."""
        plain = {name: deepcopy(getattr(self, name)) for name in _PLAIN}
        return plain | {"budget": None if self.budget is None else asdict(self.budget)}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned; ValueError for a stage whose time is none, and for times without steps."""
        if saved["stage_seconds"] and not saved["steps"] > 0:
            raise ValueError(f"figures/steps is {saved['steps']}, allowed with times of stages: above 0")
        for stage, seconds in saved["stage_seconds"].items():
            if not isinstance(seconds, float):
                raise ValueError(f"figures/stage_seconds/{stage} is a {type(seconds).__name__}, allowed: a number")
        for name in _PLAIN:
            setattr(self, name, deepcopy(saved[name]))
        self.budget = None if saved["budget"] is None else ledger_from(saved["budget"])


@dataclass(frozen=True, kw_only=True, eq=False)
class RunAccounts:
    """All accounts of a run: the scores and the oil ledger, the sums of the coupling, and the figures of the fluid.

    The master calls `advance` once at every communication point. Everything else reads: frames and summaries may be made at
    any time, any number of times, or never.
    """

    scoring: Scoring
    coupling: CouplingAccount
    figures: RunFigures

    def advance(self, point: CommunicationPoint) -> None:
        """Take the state of the run at a communication point into all accounts."""
        self.figures.advance(point)
        self.scoring.advance(point.time)
        self.coupling.advance(point.time)

    def save_state(self) -> dict[str, Any]:
        """Return scores, ledger and sums of the coupling, by name, as plain data; figures hold wall times, and are saved by themselves."""
        return {"scores": self.scoring.save_state(), "exchange": self.coupling.save_state()}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        self.scoring.restore_state(saved["scores"])
        self.coupling.restore_state(saved["exchange"])

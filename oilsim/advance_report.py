"""What happened during an advance."""

from __future__ import annotations

from collections import Counter
from dataclasses import astuple, dataclass, field
from typing import Any

import numpy as np

from oilsim.accounts.ledger import Ledger
from oilsim.step.step_result import StepResult


@dataclass(frozen=True, kw_only=True)
class AdvanceReport:
    """What happened during an advance.

    sub_steps: the steps that ended in it. As means over these, or if there were none of the last one before: time_step [s], iterations,
    and the mean compression that the solves leave, of positions (density_error; density_error_max of any particle) and that to which
    velocities lead in a step (divergence_error). asleep: number of particles that sleep at the end; budget: energy and momentum by cause
    if the fluid is watched, else None.
    """

    sub_steps: int
    time_step: float
    iterations: dict[str, float]
    density_error: float
    divergence_error: float
    density_error_max: float
    stage_seconds: dict[str, float]
    asleep: int = 0
    removed: dict[str, int] = field(default_factory=dict)
    emitted: dict[str, int] = field(default_factory=dict)
    budget: Ledger | None = None


class Unreported:
    """What has happened since the last report: steps that ended, particles of each phase that came and went."""

    def __init__(self) -> None:
        self.figures: dict[str, Any] = {}  # of the last steps, as in `AdvanceReport`
        self.clear()

    def clear(self) -> None:
        """Nothing has happened."""
        self.results: list[StepResult] = []
        self.removed: Counter[str] = Counter()
        self.emitted: Counter[str] = Counter()

    def save(self) -> dict[str, Any]:
        """All of it, as plain data."""
        results = [astuple(result) for result in self.results]
        return {
            "figures": dict(self.figures), "results": results, "removed": dict(self.removed), "emitted": dict(self.emitted),
        }  # fmt: skip

    def restore(self, saved: dict[str, Any]) -> None:
        """Back to what `save` returned."""
        self.figures, self.results = dict(saved["figures"]), [StepResult(*result) for result in saved["results"]]
        self.removed, self.emitted = Counter(saved["removed"]), Counter(saved["emitted"])

    def report(self, density_error_max: float, **others: Any) -> AdvanceReport:
        """The report of all this, and what else it tells of now; what comes then is in the next one."""
        results = self.results

        def mean(name: str) -> float:
            return float(np.mean([getattr(result, name) for result in results]))

        if results:
            self.figures = {
                "time_step": mean("time_step"),
                "iterations": {kind: mean(f"{kind}_iterations") for kind in ("density", "divergence", "viscosity")},
                "density_error": mean("density_error"),
                "divergence_error": mean("divergence_error"),
                "density_error_max": density_error_max,
            }
        report = AdvanceReport(
            sub_steps=len(results), removed=dict(self.removed), emitted=dict(self.emitted), **self.figures, **others
        )
        self.clear()
        return report

"""Sums over all steps of a run: steps, iterations, errors, particles that came and went, and the ledger of the liquid."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass, field
from typing import Any

from oilsim import AdvanceReport
from oilsim.accounts.ledger import Ledger, ledger_from

_PLAIN = ("steps", "stage_seconds", "removed", "emitted", "iteration_sums", "error_sum", "largest_error")


def _zero_iterations() -> dict[str, float]:
    return dict.fromkeys(("density", "divergence", "viscosity"), 0.0)


@dataclass(kw_only=True)
class RunTotals:
    """Adds up the fluid's reports; only `advance` changes the sums.

    steps            communication steps made
    stage_seconds    wall time [s] by stage of the fluid's step
    removed, emitted particles that left and that flowed in, by phase
    iteration_sums   mean iterations of each communication step, summed, by solve
    error_sum        mean compression of each communication step, summed; largest_error: of any particle
    budget           energy and momentum of the liquid, cause by cause; None unless the run keeps it
    """

    steps: int = 0
    stage_seconds: dict[str, float] = field(default_factory=dict)
    removed: dict[str, int] = field(default_factory=dict)
    emitted: dict[str, int] = field(default_factory=dict)
    iteration_sums: dict[str, float] = field(default_factory=_zero_iterations)
    error_sum: float = 0.0
    largest_error: float = 0.0
    budget: Ledger | None = None

    def advance(self, report: AdvanceReport) -> None:
        """Add the communication step that the fluid reports on."""
        self.steps += 1
        self.error_sum += report.density_error
        self.largest_error = max(self.largest_error, report.density_error_max)
        for kind in self.iteration_sums:
            self.iteration_sums[kind] += report.iterations[kind]
        if report.budget is not None:
            self.budget = report.budget if self.budget is None else self.budget + report.budget
        for stage, seconds in report.stage_seconds.items():
            self.stage_seconds[stage] = self.stage_seconds.get(stage, 0.0) + seconds
        for total, counts in ((self.removed, report.removed), (self.emitted, report.emitted)):
            for phase, count in counts.items():
                total[phase] = total.get(phase, 0) + count

    @property
    def mean_error(self) -> float | None:
        """Mean over the steps of the mean compression; None before the first step."""
        return self.error_sum / self.steps if self.steps else None

    @property
    def mean_iterations(self) -> dict[str, float | None]:
        """Mean iterations over the steps, by solve; None before the first step."""
        return {kind: total / self.steps if self.steps else None for kind, total in self.iteration_sums.items()}

    def save_state(self) -> dict[str, Any]:
        """Return the sums as plain data."""
        plain = {name: deepcopy(getattr(self, name)) for name in _PLAIN}
        return plain | {"budget": None if self.budget is None else asdict(self.budget)}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        for name in _PLAIN:
            setattr(self, name, deepcopy(saved[name]))
        self.budget = None if saved["budget"] is None else ledger_from(saved["budget"])

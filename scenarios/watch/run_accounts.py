"""The accounts of a run, which advance once at every communication point, whether or not anybody watches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from coupling.master.co_simulation import CommunicationPoint
from scenarios.watch.boom_scoring import Scoring
from scenarios.watch.coupling_series import CouplingAccount
from scenarios.watch.run_figures import RunFigures
from scenarios.watch.run_totals import RunTotals


@dataclass(frozen=True, kw_only=True, eq=False)
class RunAccounts:
    """All accounts of a run: the scores of its booms, the sums of the coupling and of the fluid's reports, and the run's pace.

    The master calls `advance` once at every communication point. Everything else reads: frames and summaries may be made at
    any time, any number of times, or never.
    """

    scoring: Scoring
    coupling: CouplingAccount
    totals: RunTotals
    figures: RunFigures

    def advance(self, point: CommunicationPoint) -> None:
        """Take the state of the run at a communication point into all accounts."""
        self.figures.advance(point.time)
        self.scoring.advance(point.time)
        self.coupling.advance(point.time)
        report = self.coupling.report
        if point.index > 0 and report is not None:
            self.totals.advance(report)

    def save_state(self) -> dict[str, Any]:
        """Return scores and sums of the coupling, by name, as plain data.

        The totals hold wall times, and are saved by themselves; the pace belongs to the machine alone.
        """
        return {"scores": self.scoring.save_state(), "exchange": self.coupling.save_state()}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        self.scoring.restore_state(saved["scores"])
        self.coupling.restore_state(saved["exchange"])

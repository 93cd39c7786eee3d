"""The report of an advance: steps, time, iterations, errors, and particles that came and went."""

from __future__ import annotations

from collections import Counter
from dataclasses import astuple, dataclass, field
from typing import Any

import numpy as np

from oilsim.accounts.ledger import Ledger
from oilsim.step.arrays import StepResult


@dataclass(frozen=True, kw_only=True)
class AdvanceReport:
    """The report of an advance.

    time_step, iterations, the errors of solves and crowding are means over the steps that ended in the advance. If no step ended, they
    are those of the last advance in which one did.

    sub_steps           number of steps that ended in the advance
    time_step           [s]
    iterations          of the solves: density, divergence, viscosity
    density_error       mean compression of the positions that the density solve leaves [1]
    divergence_error    mean compression to which the velocities lead in a step, as the pressure solve leaves it [1]
    viscosity_error     what the viscous solve leaves of the explicit change [1]
    crowding            mean compression of liquid that fills its box [1], which no solve can change; 0 where a surface is free
    density_error_max   largest compression of a particle [1]
    stage_seconds       wall time by stage [s]
    asleep              number of particles that sleep at the end
    removed, emitted    number of particles by phase that left through the outflow, and that pipes added
    drops               number of drops finer than the flow that changed places with liquid ahead of them (*modelled*, `drops.drift`)
    budget              energy and momentum by cause if the fluid is watched, else None
    """

    sub_steps: int
    time_step: float
    iterations: dict[str, float]
    density_error: float
    divergence_error: float
    viscosity_error: float
    crowding: float
    density_error_max: float
    stage_seconds: dict[str, float]
    asleep: int = 0
    drops: int = 0
    removed: dict[str, int] = field(default_factory=dict)
    emitted: dict[str, int] = field(default_factory=dict)
    budget: Ledger | None = None


class Unreported:
    """Events since the last report: steps that ended, and particles of each phase that came and went."""

    def __init__(self) -> None:
        self.figures: dict[str, Any] = {}  # of the last steps, as in `AdvanceReport`
        self.clear()

    def clear(self) -> None:
        """Forget all steps and all particles that came and went; keep the figures of the last steps."""
        self.results: list[StepResult] = []
        self.removed: Counter[str] = Counter()
        self.emitted: Counter[str] = Counter()

    def save(self) -> dict[str, Any]:
        """Return figures, steps and numbers of particles as plain data, for `restore`."""
        results = [astuple(result) for result in self.results]
        return {
            "figures": dict(self.figures), "results": results, "removed": dict(self.removed), "emitted": dict(self.emitted),
        }  # fmt: skip

    def restore(self, saved: dict[str, Any]) -> None:
        """Restore the events that `save` returned; ValueError for figures that a report does not have."""
        numbers = {"time_step", "density_error", "divergence_error", "viscosity_error", "crowding", "density_error_max"}
        solves = saved["figures"].get("iterations", {})
        given = {**{name: one for name, one in saved["figures"].items() if name != "iterations"}, **solves}
        wanted = numbers | {"density", "divergence", "viscosity"}
        if saved["figures"] and (set(given) != wanted or not all(isinstance(one, float) for one in given.values())):
            raise ValueError(f"saved state has the figures {sorted(given)}, allowed: numbers {sorted(wanted)}")
        self.figures, self.results = dict(saved["figures"]), [StepResult(*result) for result in saved["results"]]
        self.removed, self.emitted = Counter(saved["removed"]), Counter(saved["emitted"])

    def report(self, density_error_max: float, **others: Any) -> AdvanceReport:
        """Return the report of all events since the last one, and begin the next.

        density_error_max [1] and `others` are fields of the report that describe the present state.
        """
        results = self.results

        def mean(name: str) -> float:
            return float(np.mean([getattr(result, name) for result in results]))

        if results:
            self.figures = {
                "time_step": mean("time_step"),
                "iterations": {kind: mean(f"{kind}_iterations") for kind in ("density", "divergence", "viscosity")},
                **{name: mean(name) for name in ("density_error", "divergence_error", "viscosity_error", "crowding")},
                "density_error_max": density_error_max,
            }
        report = AdvanceReport(
            sub_steps=len(results),
            drops=sum(result.drops for result in results),
            removed=dict(self.removed),
            emitted=dict(self.emitted),
            **self.figures,
            **others,
        )
        self.clear()
        return report

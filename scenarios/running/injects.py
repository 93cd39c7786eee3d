"""The injects of a run: which of them are due at a communication point.

Times come from the scenario and its seed. Conditions are looked at after each step; the point at which one is met first is remembered, and
belongs into checkpoints. So a run that is made again, or goes on from a checkpoint, gives the same injects at the same points.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from scenarios.controls.order_checks import condition_signals, inject_problems
from scenarios.controls.signals import RunParts
from scenarios.spec.scenario import Scenario
from scenarios.text.problems import ScenarioError

WHOLE = 1e-6  # of a communication step that a time may lie before a communication point; numerical


class Injects:
    """Watches the conditions of a scenario's injects, and says which injects are due."""

    def __init__(self, scenario: Scenario, parts: RunParts) -> None:
        """Watch a scenario as it begins; ScenarioError for orders and conditions that it cannot have."""
        problems = list(inject_problems(scenario.parts))
        if problems:
            raise ScenarioError(problems, scenario.name)
        self._scenario, self._parts = scenario, parts
        watched = {name: one for name, one in scenario.injects.items() if one.when is not None}
        signals = condition_signals(scenario.parts) if watched else {}
        self._reads = {name: signals[one.when.signal].read for name, one in watched.items() if one.when is not None}
        self._met: dict[str, int] = {}  # communication point at which a condition was met first
        self._skipped: set[str] = set()

    def look(self, index: int) -> None:
        """Note the conditions that are met first at a communication point."""
        time = index * self._scenario.run.communication_step
        for name, read in self._reads.items():
            when = self._scenario.injects[name].when
            assert when is not None and read is not None  # it is an output of the run
            if name not in self._met and time >= when.after and when.is_met_by(read(self._parts)):
                self._met[name] = index

    def due(self, scenario: Scenario, index: int) -> Iterator[str]:
        """Yield the names of the injects to give at a communication point; `scenario` says which have been given."""
        step = scenario.run.communication_step
        for name, inject in scenario.injects.items():
            if not inject.given and name not in self._skipped and index * step >= self._time(name) - WHOLE * step:
                yield name

    def skip(self, name: str) -> None:
        """Pass over an inject that cannot be given any more."""
        self._skipped.add(name)

    def _time(self, name: str) -> float:
        """Return the time [s] at which an inject is due; infinite if it is not known, or never."""
        inject, run = self._scenario.injects[name], self._scenario.run
        if inject.when is None:
            return inject.time_at(name, run.seed)
        comes, shift = inject.drawn(name, run.seed)
        met = self._met.get(name)
        return math.inf if met is None or not comes else met * run.communication_step + max(0.0, inject.delay + shift)

    def save_state(self) -> dict[str, Any]:
        """Return which conditions have been met, and which injects are passed over, as plain data."""
        return {"met": dict(self._met), "skipped": sorted(self._skipped)}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        self._skipped = set(saved["skipped"])
        self._met = {name: int(index) for name, index in saved["met"].items()}

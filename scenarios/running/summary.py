"""What a run came to, as one JSON object with stable keys; what was not measured is null, never left out."""

from __future__ import annotations

import json
import time as wall_clock
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from booms.balance import OilBalance
from oilsim.accounts.ledger import Ledger, ledger_from
from oilsim.advance_report import AdvanceReport
from recordings.files import write_whole
from recordings.frame import Event, Frame, RunDescription
from scenarios.running.assembly import Assembly
from scenarios.running.decimated_series import EvenSample
from scenarios.versions import versions

_SUMS = (
    "_steps",
    "_longest_step",
    "_stage_seconds",
    "_removed",
    "_emitted",
    "_iteration_sums",
    "_error_sum",
    "_largest_error",
)
_KINDS = ("density", "divergence", "viscosity")


class SummaryObserver:
    """Watches a run and adds up what its summary needs; the Observer protocol by shape."""

    def __init__(self, assembly: Assembly) -> None:
        """`assembly` is the run that is watched; it is only read."""
        self._assembly = assembly
        self._started = wall_clock.perf_counter()
        self._last = self._started
        self._steps = 0
        self._step_seconds = EvenSample()
        self._longest_step = 0.0  # s
        self._stage_seconds: dict[str, float] = {}
        self._iteration_sums = dict.fromkeys(_KINDS, 0.0)
        self._error_sum = self._largest_error = 0.0  # of density
        self._budget: Ledger | None = None
        self._removed: dict[str, int] = {}
        self._emitted: dict[str, int] = {}
        self._series: dict[str, EvenSample] = {}
        self._times = EvenSample()
        self.events: list[Event] = []
        self.reason = "not started"
        self.state_hash: str | None = None  # of the run's state at its end; None if it failed

    def initialized(self, run: RunDescription) -> None:
        """The clock of the run starts."""
        self._started = self._last = wall_clock.perf_counter()
        self.reason = "running"

    def step_completed(self, frame: Frame) -> None:
        """Take what the step cost and what the probes read."""
        now = wall_clock.perf_counter()
        report = self._assembly.report()
        if frame.index > 0 and report is not None:
            self._steps += 1
            self._step_seconds.append(now - self._last)
            self._longest_step = max(self._longest_step, now - self._last)
            self._add(report)
        self._last = now
        self._times.append(frame.time)
        for name, value in frame.scalars.items():
            if name.startswith("probes/"):
                self._series.setdefault(name.removeprefix("probes/"), EvenSample()).append(value)

    def event(self, event: Event) -> None:
        """Keep it."""
        self.events.append(event)

    def terminated(self, reason: str) -> None:
        """Keep why the run ended."""
        self.reason = reason

    def save_state(self) -> dict[str, Any]:
        """What was added up so far, as plain data."""
        return {
            "wall_seconds": self._last - self._started,
            "exchange": self._exchange(),
            "budget": None if self._budget is None else asdict(self._budget),
            "events": [asdict(event) for event in self.events],
            "step_seconds": self._step_seconds.save_state(),
            "times": self._times.save_state(),
            "series": {name: sample.save_state() for name, sample in self._series.items()},
            **{name: deepcopy(getattr(self, name)) for name in _SUMS},
        }

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go on adding to what `save_state` returned; to be called once the run has begun."""
        self._started = self._last - saved["wall_seconds"]
        self._budget = None if saved["budget"] is None else ledger_from(saved["budget"])
        self.events = [Event(**event) for event in saved["events"]]
        self._step_seconds = EvenSample.restored(saved["step_seconds"])
        self._times = EvenSample.restored(saved["times"])
        self._series = {name: EvenSample.restored(sample) for name, sample in saved["series"].items()}
        for name in _SUMS:
            setattr(self, name, deepcopy(saved[name]))

    def _add(self, report: AdvanceReport) -> None:
        self._error_sum += report.density_error
        self._largest_error = max(self._largest_error, report.density_error_max)
        for kind in _KINDS:
            self._iteration_sums[kind] += report.iterations[kind]
        if report.budget is not None:
            self._budget = report.budget if self._budget is None else self._budget + report.budget
        for stage, seconds in report.stage_seconds.items():
            self._stage_seconds[stage] = self._stage_seconds.get(stage, 0.0) + seconds
        for total, counts in ((self._removed, report.removed), (self._emitted, report.emitted)):
            for phase, count in counts.items():
                total[phase] = total.get(phase, 0) + count

    def summary(self, simulated: float, overrides: tuple[str, ...] = ()) -> dict[str, Any]:
        """The whole summary after `simulated` seconds."""
        wall = self._last - self._started
        budget = self._budget
        return {
            "format": 1,
            "scenario": self._assembly.scenario.name,
            "overrides": list(overrides),
            "versions": versions(),
            "ended": self.reason,
            "simulated_s": simulated,
            "wall_s": wall,
            "real_time_factor": simulated / wall if wall > 0.0 else None,
            "steps": self._steps,
            "step_ms": self._step_milliseconds(),
            "stage_ms": {stage: 1e3 * total / self._steps for stage, total in self._stage_seconds.items()},
            "particles": self._assembly.particle_counts(),
            "bodies": list(self._assembly.body_names),
            "left_the_tank": dict(self._removed),
            "density_error": self._density_error(),
            "iterations": self._iterations(),
            "momentum_residual": None if budget is None else budget.momentum_residual,
            "energy_residual": None if budget is None else budget.energy_residual,
            "exchange": self._exchange(),
            "budget": None if budget is None else budget_entries(budget),
            "oil_m3": self._oil_volumes(),
            "scores": self._assembly.scoring.summary(),
            "probes": self._probe_series(),
            "state_hash": self.state_hash,
            "events": [
                {"time_s": event.time, "level": event.level, "source": event.source, "text": event.text}
                for event in self.events
            ],
        }

    def _step_milliseconds(self) -> dict[str, float | None]:
        if not self._steps:
            return {"median": None, "p95": None, "max": None}
        median, p95 = np.percentile(1e3 * np.array(self._step_seconds.values), [50.0, 95.0])
        return {"median": float(median), "p95": float(p95), "max": 1e3 * self._longest_step}

    def _density_error(self) -> dict[str, float | None]:
        """Mean over the steps of the mean compression, and the largest compression of any particle at a step's end."""
        if not self._steps:
            return {"mean": None, "max": None}
        return {"mean": self._error_sum / self._steps, "max": self._largest_error}

    def _iterations(self) -> dict[str, float | None]:
        return {kind: total / self._steps if self._steps else None for kind, total in self._iteration_sums.items()}

    def _exchange(self) -> dict[str, Any] | None:
        """How bodies were coupled, and what was lost and made on the way between them and the fluid; None without free bodies."""
        ledger, schemes = self._assembly.ledger, self._assembly.exchange.schemes
        if not schemes:
            return None
        return {
            "schemes": {body: scheme.value for body, scheme in schemes.items()},
            "added_mass_to_mass": dict(self._assembly.exchange.stability_numbers),
            "momentum_residual": ledger.momentum_residual,
            "energy_residual": ledger.energy_residual,
        }

    def _oil_volumes(self) -> dict[str, Any]:
        """Oil [m3] by what became of it; what nothing accounts for is null.

        Each particle once: released = retained + free + all of lost. Afloat is what of these is in the water still.
        """
        assembly = self._assembly
        volume = assembly.fluid.config.rest_volume
        oils = [name for name, phase in assembly.scenario.phases.items() if phase.is_oil]
        counts = assembly.particle_counts()
        here = sum(counts[name] for name in oils)
        gone = sum(self._removed.get(name, 0) for name in oils)
        balance = assembly.scoring.balance or OilBalance(retained=0, free=here, lost_by_cause={}, lost_and_gone=0)
        lost = dict(balance.lost_by_cause) | {"left_the_tank": gone - balance.lost_and_gone}
        return {
            "released": (here + gone) * volume,
            "afloat": here * volume,
            "retained": None if assembly.scoring.balance is None else balance.retained * volume,
            "free": balance.free * volume,
            "lost": {cause: count * volume for cause, count in lost.items()},
            "recovered": None,
            "ashore": None,
        }

    def _probe_series(self) -> dict[str, dict[str, list[float]]]:
        times = self._times.values
        return {name: {"time_s": [*times], "value": [*sample.values]} for name, sample in self._series.items()}


def budget_entries(budget: Ledger) -> dict[str, Any]:
    """Where energy and momentum of the liquid went during the run, cause by cause; per metre in two dimensions."""
    return {
        "kinetic_J": budget.energy.kinetic,
        "potential_J": budget.energy.potential,
        "parts": {
            cause: {
                "kinetic_J": part.kinetic,
                "potential_J": part.potential,
                "work_on_bodies_J": part.work_on_bodies,
                "momentum_Ns": part.momentum[:3].tolist(),
                "angular_momentum_Nms": part.momentum[3:].tolist(),
                "impulse_on_bodies_Ns": part.impulse_on_bodies[:3].tolist(),
            }
            for cause, part in budget.parts.items()
        },
        "gravity_work_J": budget.gravity_work,
        "viscous_dissipation_J": budget.viscous_dissipation,
        "numerical_dissipation_J": budget.numerical_dissipation,
        "numerical_viscosity_m2_s": budget.numerical_viscosity,
        "wall_impulse_Ns": budget.wall_impulse[:3].tolist(),
        "compression": vars(budget.compression),
    }


def write_summary(summary: Mapping[str, Any], path: Path) -> None:
    """Write it as indented JSON, whole or not at all; numbers that are not finite would be no JSON and are refused."""
    write_whole(path, json.dumps(summary, indent=1, allow_nan=False) + "\n")

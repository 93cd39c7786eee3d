"""The summary of a run, as one JSON object with stable keys; what was not measured is null, never left out."""

from __future__ import annotations

import json
import time as wall_clock
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from coupling.master.saved_fields import require_alike
from oilsim.accounts.ledger import Ledger
from recordings.files.writing import write_whole
from recordings.model.frame import Event, Frame, RunDescription
from scenarios.running.assembly import Assembly
from scenarios.running.instructor import EvenSample
from scenarios.text.versions import versions


class SummaryObserver:
    """Watches a run: keeps its wall time, probes and events, and writes its summary from them and the run's accounts.

    It has the shape of the Observer protocol.
    """

    def __init__(self, assembly: Assembly) -> None:
        """Observe the run `assembly`, which is only read."""
        self._assembly = assembly
        self._started = wall_clock.perf_counter()
        self._last = self._started
        self._figures = assembly.accounts.figures
        self._step_seconds = EvenSample()
        self._longest_step = 0.0  # s
        self._series: dict[str, EvenSample] = {}
        self._times = EvenSample()
        self.events: list[Event] = []
        self.reason = "not started"
        self.state_hash: str | None = None  # of the run's state at its end; None if it failed

    def initialized(self, run: RunDescription) -> None:
        """Start the clock of the run."""
        self._started = self._last = wall_clock.perf_counter()
        self.reason = "running"

    def step_completed(self, frame: Frame) -> None:
        """Keep the wall time of the step and the readings of the probes."""
        now = wall_clock.perf_counter()
        if frame.index > 0:
            self._step_seconds.append(now - self._last)
            self._longest_step = max(self._longest_step, now - self._last)
        self._last = now
        self._times.append(frame.time)
        for name, value in frame.scalars.items():
            if name.startswith("probes/"):
                self._series.setdefault(name.removeprefix("probes/"), EvenSample()).append(value)

    def event(self, event: Event) -> None:
        """Keep the event."""
        self.events.append(event)

    def terminated(self, reason: str) -> None:
        """Keep the reason why the run ended."""
        self.reason = reason

    def save_state(self) -> dict[str, Any]:
        """Return what was kept so far, as plain data."""
        return {
            "wall_seconds": self._last - self._started,
            "exchange": self._exchange(),
            "events": [asdict(event) for event in self.events],
            "step_seconds": self._step_seconds.save_state(),
            "times": self._times.save_state(),
            "series": {name: sample.save_state() for name, sample in self._series.items()},
            "longest_step": self._longest_step,
        }

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go on from what `save_state` returned; to be called once the run has begun."""
        self._started = self._last - saved["wall_seconds"]
        for event in saved["events"]:  # an empty list, as a new summary has, does not tell what it may hold
            require_alike("summary/events", event, asdict(Event(0.0, "")))
        self.events = [Event(**event) for event in saved["events"]]
        self._step_seconds = EvenSample.restored(saved["step_seconds"])
        self._times = EvenSample.restored(saved["times"])
        self._series = {name: EvenSample.restored(sample) for name, sample in saved["series"].items()}
        self._longest_step = saved["longest_step"]

    def summary(self, simulated: float, overrides: tuple[str, ...] = ()) -> dict[str, Any]:
        """Return the whole summary after `simulated` seconds."""
        wall = self._last - self._started
        figures, budget = self._figures, self._figures.budget
        return {
            "format": 1,
            "scenario": self._assembly.scenario.name,
            "overrides": list(overrides),
            "versions": versions(),
            "ended": self.reason,
            "simulated_s": simulated,
            "wall_s": wall,
            "real_time_factor": simulated / wall if wall > 0.0 else None,
            "steps": figures.steps,
            "step_ms": self._step_milliseconds(),
            "stage_ms": {stage: 1e3 * total / figures.steps for stage, total in figures.stage_seconds.items()},
            "particles": self._assembly.particle_counts(),
            "bodies": list(self._assembly.body_names),
            "left_the_tank": self._left_the_tank(),
            "density_error": {"mean": figures.mean_error, "max": figures.largest_error if figures.steps else None},
            "iterations": figures.mean_iterations,
            "momentum_residual": None if budget is None else budget.momentum_residual,
            "energy_residual": None if budget is None else budget.energy_residual,
            "exchange": self._exchange(),
            "budget": None if budget is None else budget_entries(budget),
            "oil_m3": self._assembly.scoring.ledger.rows.summary(),
            "scores": self._scores(),
            "skimmers": {one.short_name: one.summary() for one in self._assembly.skimmers},
            "probes": self._probe_series(),
            "state_hash": self.state_hash,
            "events": [
                {"time_s": event.time, "level": event.level, "source": event.source, "text": event.text}
                for event in self.events
            ],
        }

    def _left_the_tank(self) -> dict[str, int]:
        """Return the particles that have left a tank, by phase; those that leave a window, or that a skimmer takes, have left none."""
        left = self._assembly.fluid_participant.left if self._assembly.scenario.tanks else {}
        return {name: count for name, count in left.items() if count}

    def _scores(self) -> dict[str, Any]:
        """Return the scores of each boom, with the largest share of its strength that it has borne; null for one without a strength."""
        shares = self._assembly.strength.peak_share
        scores = self._assembly.scoring.summary()
        return {
            name: own | {"largest_share_of_strength": shares.get(name)} if own else own for name, own in scores.items()
        }

    def _step_milliseconds(self) -> dict[str, float | None]:
        if not self._step_seconds.values:  # nor are there any of a run that was refused once its figures were read
            return {"median": None, "p95": None, "max": None}
        median, p95 = np.percentile(1e3 * np.array(self._step_seconds.values), [50.0, 95.0])
        return {"median": float(median), "p95": float(p95), "max": 1e3 * self._longest_step}

    def _exchange(self) -> dict[str, Any] | None:
        """Summarize the coupling of bodies, and what was lost or created between them and the fluid; None without free bodies."""
        ledger, schemes = self._assembly.ledger, self._assembly.exchange.schemes
        if not schemes:
            return None
        return {
            "schemes": {body: scheme.value for body, scheme in schemes.items()},
            "added_mass_to_mass": dict(self._assembly.exchange.stability_numbers),
            "momentum_residual": ledger.momentum_residual,
            "energy_residual": ledger.energy_residual,
        }

    def _probe_series(self) -> dict[str, dict[str, list[float]]]:
        times = self._times.values
        return {name: {"time_s": [*times], "value": [*sample.values]} for name, sample in self._series.items()}


def budget_entries(budget: Ledger) -> dict[str, Any]:
    """Return where energy and momentum of the liquid went during the run, cause by cause; per metre in two dimensions."""
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

"""Verification: a recording's scenario is run again and must give the same frames."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from coupling.master.errors import CoSimulationError
from recordings.files.writing import RecordingError
from recordings.replay.recording import Replay
from recordings.replay.replay_check import ReplayCheck
from scenarios.running.assembly import build
from scenarios.running.plan import Plan, plan_from, with_given_orders
from scenarios.running.run_loop import RunLoop
from scenarios.running.run_requests import RunRequests
from scenarios.text.versions import versions
from scenarios.watch.progress import ProgressDisplay


@dataclass(frozen=True, kw_only=True)
class Verification:
    """Result of running a recording's scenario again.

    equal_frames: number of recorded frames that came out equal. difference: a sentence on the first frame that differs; empty if none does.
    precision: grid [m] on which particles are recorded and compared; None: all is compared bit for bit, as series and bodies are.
    versions: a sentence on the versions that differ from the recording's.
    """

    equal_frames: int
    difference: str
    precision: float | None
    versions: str


def verify(
    recording: Path, *, threads: int | None = None, until: float | None = None, console: Console
) -> Verification:
    """Run the recording's scenario again, orders included, up to its last frame, the first difference or `until` [s].

    Raises RecordingError if the recording does not hold its scenario, or cannot be read.
    """
    replay = Replay(recording)
    check = ReplayCheck(replay)
    plan = _plan_of(replay, threads)
    step = plan.scenario.run.communication_step
    last = check.last_index if until is None else min(check.last_index, round(until / step))
    assembly = build(plan.scenario)
    with ProgressDisplay(f"{plan.scenario.name} again", last * step, console) as progress:
        simulation = assembly.co_simulation([check, progress])
        loop = RunLoop(plan, assembly, simulation, requests=RunRequests(), keepers={}, checkpoints=None)
        try:
            loop.begin()
            while not check.difference and simulation.communication_point.index < last:
                loop.step()
            simulation.terminate("verified")
        except CoSimulationError as error:
            check.difference = f"the run failed: {error}"
    return Verification(
        equal_frames=check.compared,
        difference=check.difference,
        precision=check.precision,
        versions=_other_versions(replay),
    )


def _plan_of(replay: Replay, threads: int | None) -> Plan:
    """Return the plan that the recording holds; the number of threads changes nothing but the time it takes."""
    stored = replay.run.properties.get("plan")
    if stored is None:
        raise RecordingError(replay.given, "has no scenario; allowed: recordings of scenarios, which can be run again")
    plan = with_given_orders(plan_from(json.loads(str(stored))), replay)
    if threads is None:
        return plan
    return replace(plan, scenario=replace(plan.scenario, run=replace(plan.scenario.run, threads=threads)))


def _other_versions(replay: Replay) -> str:
    """Write which versions differ from the recording's; results may differ in the last bits."""
    then = replay.run.properties
    return "; ".join(
        f"{name} {then.get(f'version_{name}', 'unknown')} then, {now} now"
        for name, now in versions().items()
        if then.get(f"version_{name}") != now
    )

"""The rest in which an exercise begins for its crews: vessels hold their places, and skimmers stand. What a scenario orders is its plan."""

from __future__ import annotations

from collections.abc import Iterator

from scenarios.schema.exercise import VesselSettings
from scenarios.spec.scenario import Scenario


def rest_settings(scenario: Scenario) -> tuple[str, ...]:
    """Return the settings with which an exercise begins at rest, as for ``--set``; none if it begins so.

    Vessels hold their places; those that hold them by the scenario's plan, or go by waypoints, have stopped engines. Skimmers do not run.
    A trial runs by its program, and where nobody can order anything, all is decided before the start.
    """
    if scenario.exercise is None or scenario.exercise.group == "trial":
        return ()
    tows = scenario.tow is not None and scenario.tow.speed != 0.0
    found = ["tow.speed=0.0"] if tows and any(one.follows_tow for one in scenario.vessels.values()) else []
    for name, vessel in scenario.vessels.items():
        if not (vessel.follows_tow and tows):
            found += (f"vessels.{name}.{setting}" for setting in _of_vessel(vessel))
    found += (f"skimmers.{name}.running=false" for name, one in scenario.skimmers.items() if one.running)
    return ("exercise.needs_orders=true", *found) if found else ()


def _of_vessel(vessel: VesselSettings) -> Iterator[str]:
    """Yield the settings that keep a vessel where it is placed."""
    if vessel.control != "helmsman" or vessel.engine != "running":
        return
    if any(leg.speed != 0.0 for leg in vessel.legs):
        x, y = vessel.position[:2]
        yield f"legs=[{{speed=0.0,heading={vessel.heading!r},through=[{x!r},{y!r}]}}]"
    else:
        yield "engine=stopped"

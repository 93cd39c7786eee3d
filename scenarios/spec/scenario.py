"""A scenario: everything that defines a run, as frozen keyword-only dataclasses that refuse impossible values.

The dataclasses are the Python API. A scenario file says the same, table by table and key by key; `scenarios.spec.load` reads it.
Conventions: SI units, world frame with z up, angles counter-clockwise. In a file, a key for a speed may carry the suffix ``_kn`` (knots),
and one for an angle ``_deg`` (degrees). Sailors' directions are taken too, in degrees clockwise from north: ``heading_compass`` for a
heading, ``from_compass`` for where wind or waves come from, ``toward_compass`` for where a current runs to.

An exercise begins at rest for its crews: vessels hold their places, and skimmers stand. What a scenario orders is its plan.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from scenarios.schema.cross_checks import NAME_ALLOWED, NAME_PATTERN, problems_between
from scenarios.schema.exercise import VesselSettings
from scenarios.schema.liquid import FluidSettings, PhaseSettings
from scenarios.schema.parsing.quantity_fields import Section
from scenarios.schema.run_settings import (
    CameraSettings,
    ExerciseSettings,
    Fidelity,
    Level,
    RecordingSettings,
    RunSettings,
    SiteSettings,
)
from scenarios.schema.sea import SeaSettings
from scenarios.schema.tables import NAMED_TABLES, Parts, Tables
from scenarios.text.problems import Problem

__all__ = ["CameraSettings", "RecordingSettings", "RunSettings", "Scenario", "SiteSettings"]


@dataclass(frozen=True, kw_only=True)
class Scenario(Section, Tables):
    """A whole scenario. Tables of named things (`phases`, `fill`, ...) are mappings from name to settings.

    name    name of the scenario; title: one line; text: what the scenario shows, and its source
    fill    liquid at the start, in order
    tank    a box with walls that holds particles; without it and without a window, a run has none
    window  a box of particles with rims, which takes the place of a tank
    fidelity    "live" or "fine": with the boxes of particles that the exercise offers under that name, "none": without any; by default as
                the file has them
    fidelities  changes for ``live``, ``fine`` and ``none``, nested like the file; reading a file applies those of its fidelity
    demo    changes that make a run short, nested like the file; ``oilsim run NAME --demo`` applies them
    level   "easy", "normal" or "hard"; reading a file applies the changes that `levels` has under that name
    levels  changes that make the exercise easier or harder, under ``easy`` and ``hard``, nested like the file
    """

    name: str
    title: str = ""
    text: str = ""
    exercise: ExerciseSettings | None = None
    run: RunSettings
    fluid: FluidSettings
    phases: Mapping[str, PhaseSettings]
    fidelity: Fidelity | None = None
    fidelities: Mapping[str, object] = field(default_factory=dict)
    sea: SeaSettings = field(default_factory=SeaSettings)
    recording: RecordingSettings = field(default_factory=RecordingSettings)
    camera: CameraSettings | None = None
    demo: Mapping[str, object] = field(default_factory=dict)
    level: Level = "normal"
    levels: Mapping[str, object] = field(default_factory=dict)

    def problems(self) -> Iterator[Problem]:
        """Yield the problems between the tables: references, places, sizes."""
        if not re.fullmatch(NAME_PATTERN, self.name):
            yield Problem("name", f"is {self.name!r}, allowed: {NAME_ALLOWED}")
        yield from problems_of(self.parts)

    @property
    def parts(self) -> Parts:
        """The tables of this scenario, as the checks between them and the controls of a run read them."""
        names = {table: tuple(getattr(self, table)) for table in NAMED_TABLES}
        parts = {name: getattr(self, name) for name in Parts.__dataclass_fields__ if name not in ("names", "given")}
        given = frozenset(name for name, part in parts.items() if part is not None and part != {})
        return Parts(names=names, given=given, **parts)


def problems_of(parts: Parts) -> Iterator[Problem]:
    """Yield every problem that concerns more than one table, but those of injects, which a run's orders may change.

    Code for FMUs is imported only if there are some.
    """
    yield from problems_between(parts)
    if parts.fmus:
        from scenarios.controls.fmu_checks import fmu_problems
        from scenarios.controls.signals import signals_of

        yield from fmu_problems(parts.fmus, signals_of(parts))


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

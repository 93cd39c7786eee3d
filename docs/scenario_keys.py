"""The reference page of the scenario format, written from the dataclasses: ``python docs/scenario_keys.py``."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, fields
from typing import Any, Literal, get_args, get_origin

from booms.boom import Pocket
from oilsim.core.quantity import quantities
from oilsim.sea import Tide
from scenarios.schema import (
    bodies,
    criteria,
    exercise,
    fmu_settings,
    injects,
    liquid,
    moorings,
    recovery,
    run_settings,
    sea,
    window,
)
from scenarios.schema.parsing.quantity_fields import Section, field_kinds
from scenarios.schema.parsing.structuring import keys_of
from scenarios.schema.parsing.type_checks import shape_of
from vessels.drive import Drive

INTRODUCTION = """# Scenario files

A scenario is a TOML file of tables. The dataclasses of `scenarios` say the same in Python, key by key. Units are SI, z points up,
angles are counter-clockwise. A key in m/s may carry the suffix `_kn` (knots), a key in rad the suffix `_deg`. Named things have tables
of their own, such as `[phases.oil]` or `[bodies.rock]`; the name is yours.

Sailors' directions are taken too, in degrees clockwise from north: `heading_compass` in place of a `heading`, `from_compass` in place of
the `direction` of wind or waves, by where they come from, and `toward_compass` in place of that of a current. North is +y, unless `[site]`
has another `bearing`.

`oilsim check FILE` reads a file, reports all wrong entries at once, then all that does not fit, and estimates the cost of a run.
`--set KEY=VALUE` changes an entry for one run:
`--set phases.oil.dynamic_viscosity=0.1`, `--set tank.upper.2=2.0`, `--set vessels.port.legs.1.speed_kn=0.5`.
The `[demo]` table holds such changes for `--demo`.

A key without a default must be given. `python docs/scenario_keys.py` writes this page.

## A first scenario
```toml
name = "my-tank"
title = "A wooden ball falls into water"

[run]
duration = 2.0

[fluid]
particle_spacing = 0.05

[phases.water]
density = 998.0
dynamic_viscosity = 1.0e-3

[tank]
lower = [0.0, 0.0, 0.0]
upper = [1.0, 1.0, 1.0]
open = ["+z"]

[fill.pool]
shape = "slab"
phase = "water"
bottom = 0.0
top = 0.4

[bodies.ball]
shape = "sphere"
radius = 0.15
density = 600.0
position = [0.5, 0.5, 0.7]

[probes.ball]
kind = "body"
body = "ball"
```
The same in Python, with a run of it that leaves a recording and a summary:
```python
from pathlib import Path

from scenarios.schema.bodies import SphereBody
from scenarios.schema.liquid import FluidSettings, PhaseSettings, SlabFill, Tank
from scenarios.schema.run_settings import BodyProbe
from scenarios.running.run import RunOptions, run_scenario
from scenarios.spec.scenario import RunSettings, Scenario

scenario = Scenario(
    name="my-tank",
    title="A wooden ball falls into water",
    run=RunSettings(duration=2.0),
    fluid=FluidSettings(particle_spacing=0.05),
    phases={"water": PhaseSettings(density=998.0, dynamic_viscosity=1.0e-3)},
    tank=Tank(lower=(0.0, 0.0, 0.0), upper=(1.0, 1.0, 1.0), open=("+z",)),
    fill={"pool": SlabFill(phase="water", bottom=0.0, top=0.4)},
    bodies={"ball": SphereBody(radius=0.15, density=600.0, position=(0.5, 0.5, 0.7))},
    probes={"ball": BodyProbe(body="ball")},
)
if __name__ == "__main__":
    run_scenario(scenario, options=RunOptions(record=Path("my-tank.rrd"), summary=Path("my-tank.json")))
```
For a loop of your own, `scenarios.running.assembly.build(scenario)` makes the parts: `assembly.fluid`, `assembly.world`, and
`assembly.co_simulation(observers)` with `initialize()`, `step()` and `terminate()`.
"""

CHAPTERS: tuple[tuple[str, tuple[type, ...]], ...] = (
    ("exercise", (run_settings.ExerciseSettings,)),
    ("run", (run_settings.RunSettings,)),
    ("fluid", (liquid.FluidSettings,)),
    ("phases.NAME", (liquid.PhaseSettings,)),
    ("tank", (liquid.Tank,)),
    ("tank.zones.NAME", (liquid.ZoneSettings,)),
    ("fill.NAME", get_args(liquid.Fill)),
    ("emitters.NAME", (liquid.PipeEmitterSettings,)),
    ("sea", (sea.SeaSettings,)),
    ("sea.waves", get_args(sea.SeaWaves)),
    ("sea.current", get_args(sea.SeaCurrent)),
    ("sea.wind", get_args(sea.SeaWind)),
    ("sea.langmuir", (sea.LangmuirSettings,)),
    ("sea.tide", (Tide,)),
    ("shore", (sea.ShoreSettings,)),
    ("land.NAME", (sea.LandSettings,)),
    ("areas.NAME", (sea.AreaSettings,)),
    ("window", (window.WindowTable,)),
    ("window.outer", (window.OuterWindow,)),
    ("bodies.NAME", get_args(bodies.Body)),
    ("bodies.NAME.motion", get_args(bodies.Motion)),
    ("vessels.NAME", (exercise.VesselSettings,)),
    ("vessels.NAME.drive", (Drive,)),
    ("vessels.NAME.legs", (exercise.LegSettings,)),
    ("tow", (exercise.TowSettings,)),
    ("booms.NAME", (exercise.BoomSettings,)),
    ("booms.NAME.pocket", (Pocket,)),
    ("booms.NAME.reel", (exercise.ReelSettings,)),
    ("moorings.NAME", (moorings.MooringSettings,)),
    ("moorings.NAME.parts", (moorings.PartSettings,)),
    ("ties.NAME", (moorings.TieSettings,)),
    ("skimmers.NAME", (recovery.SkimmerSettings,)),
    ("injects.NAME", (injects.InjectSettings,)),
    ("injects.NAME.when", (injects.ConditionSettings,)),
    ("criteria.KEY", (criteria.CriterionSettings,)),
    ("prices", (criteria.PriceSettings,)),
    ("probes.NAME", get_args(run_settings.Probe)),
    ("fmus.NAME", (fmu_settings.FmuSettings,)),
    ("recording", (run_settings.RecordingSettings,)),
    ("camera", (run_settings.CameraSettings,)),
    ("site", (run_settings.SiteSettings,)),
    ("site.chart", (run_settings.ChartSettings,)),
)


def reference() -> str:
    """Write the whole page as Markdown."""
    return "\n".join([INTRODUCTION, *(line for table, sections in CHAPTERS for line in _chapter(table, sections))])


def _chapter(table: str, sections: tuple[type, ...]) -> Iterator[str]:
    """Write one table of the file: first the keys that all its kinds share, then each kind."""
    yield f"## [{table}]"
    shared = _shared(sections)
    if shared is not None:
        yield from _section(table, shared, set())
    for section in sections:
        if tag := getattr(section, "TAG", None):
            yield f'### {tag[0]} = "{tag[1]}"' + ", the default" * getattr(section, "USUAL", False)
        known = {item.name for item in fields(shared)} if shared is not None else set()
        yield from _section(table, section, known)


def _shared(sections: tuple[type, ...]) -> type | None:
    """Return the class with the keys that all kinds share, if there are several kinds."""
    parents = {section.__mro__[1] for section in sections}
    parent = parents.pop()
    return parent if len(sections) > 1 and not parents and parent is not Section else None


def _section(table: str, section: Any, known: set[str]) -> Iterator[str]:
    """Describe a section, with a row for each key that is not known from above."""
    yield "```text"
    yield re.sub(r"\s*Raises ValueError[^.]*\.", "", inspect.cleandoc(section.__doc__ or ""))
    yield "```"
    rows = [item for item in fields(section) if item.name not in known]
    if rows:
        yield ""
        yield "| key | value | default |"
        yield "|---|---|---|"
        yield from (_row(table, section, item) for item in rows)
    yield ""


def _row(table: str, section: Any, item: Field[Any]) -> str:
    limits = quantities(section).get(item.name)
    kind = field_kinds(section)[item.name]
    value = _value(kind) if limits is None else f"{shape_of(kind)}, {limits.allowed}"
    own = f"{table}.{item.name}"
    chapter = next((one for one, _ in CHAPTERS if one in (own, f"{own}.NAME")), None)
    if chapter is not None:
        tables = {tuple: "a list of tables", Mapping: "tables"}.get(get_origin(kind), "a table")
        value = f"{tables}, see [{chapter}](#{chapter.replace('.', '').lower()})"
    names = keys_of(section, item.name)
    return f"| {', '.join(f'`{name}`' for name in names)} | {value} | {_default(item)} |"


def _value(kind: Any) -> str:
    """Write the allowed values of a key that is not a quantity."""
    if get_origin(kind) is Mapping:
        return "a table of names and " + ("names" if get_args(kind)[1] is str else "numbers")
    if get_origin(kind) is Literal:
        return ", ".join(f'`"{choice}"`' for choice in get_args(kind))
    if kind is bool:
        return "`true` or `false`"
    choices = [choice for part in get_args(kind) for choice in (get_args(part) if get_origin(part) is Literal else ())]
    if choices:
        listed = ", ".join(f'`"{choice}"`' for choice in choices)
        return f"a list of {listed}" if get_origin(kind) is tuple else listed
    if kind is str or (str in get_args(kind) and get_origin(kind) is not tuple):
        return "text"
    return shape_of(kind)


def _default(item: Field[Any]) -> str:
    if item.default_factory is not MISSING:
        made = item.default_factory()
        tag = getattr(made, "TAG", None)
        return f'`"{tag[1]}"`' if tag else ""
    if item.default is MISSING:
        return "**must be given**"
    if item.default is None or item.default == ():
        return ""
    if isinstance(item.default, bool):
        return f"`{str(item.default).lower()}`"
    default = list(item.default) if isinstance(item.default, tuple) else item.default
    return f'`"{default}"`' if isinstance(default, str) else f"`{default}`"


if __name__ == "__main__":
    print(reference())

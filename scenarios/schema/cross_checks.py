"""Checks between the tables of a scenario: names, references, places and sizes.

They work on all parts that are valid, so that a file with a mistyped number still gets its wrong references reported in the same run.
A part that could not be read is None. A named entry that could not be read is missing from its table but still in `names`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from itertools import product
from pathlib import Path

from oilsim.core.config import FURTHEST
from oilsim.core.phases import RIGHT_ANGLE
from oilsim.core.quantity import SHORTEST_DIRECTION
from oilsim.sea.flows import ALONG
from recordings.model.exercise import GROUND
from scenarios.schema.bodies import MeshBody
from scenarios.schema.criteria import criteria_problems
from scenarios.schema.exercise import body_of, line_problems, segment_names
from scenarios.schema.liquid import (
    LEAK_MARGIN,
    Fill,
    FluidSettings,
    SlabFill,
    Tank,
    afloat_problems,
    air_problems,
    floating_oil_problems,
    light_problems,
    lost_oil_problems,
    top_of_water,
)
from scenarios.schema.moorings import mooring_problems, reel_problems, tie_problems
from scenarios.schema.parsing.quantity_fields import Vector
from scenarios.schema.parsing.relations import entries_at, is_given, references, shown
from scenarios.schema.recovery import skimmer_problems
from scenarios.schema.run_settings import BodyProbe
from scenarios.schema.sea import SeaSettings
from scenarios.schema.tables import NAMED_TABLES, Parts
from scenarios.schema.window import WindowTable
from scenarios.text.problems import Problem, unknown

NAME_PATTERN = r"[A-Za-z0-9][A-Za-z0-9_-]*"
NAME_ALLOWED = "letters, digits, '-' and '_', beginning with a letter or digit"
ROLES = ("instructor", "observer")  # of the console, whose crews have the names of their vessels
MESH_SUFFIXES = (".stl", ".obj", ".ply", ".glb")  # as of coupling.solids.bodies, which takes a second to import
# of tables that are referred to
SINGULAR = {"phases": "phase", "bodies": "body", "vessels": "vessel", "booms": "boom", "skimmers": "skimmer"}
MOST_PARTICLES = 1e8  # some 300 GB of memory


def problems_between(parts: Parts) -> Iterator[Problem]:
    """Yield every problem that concerns more than one table."""
    parts = parts.as_run()
    yield from _names(parts)
    yield from _references(parts)
    yield from mooring_problems(parts.moorings, parts.booms)
    yield from tie_problems(parts.ties, parts.booms)
    yield from line_problems(parts.vessels, parts.booms)
    yield from _orders(parts)
    yield from (problem.below("criteria") for problem in criteria_problems(parts.criteria))
    yield from light_problems(parts.phases)
    yield from _meshes(parts)
    yield from _plane(parts)
    if parts.tank is not None:
        yield from _places(parts, parts.tank)
    yield from _floating(parts)
    yield from reel_problems(parts.booms, parts.moorings, parts.ties)
    yield from _barred(parts)
    yield from _shore_and_skimmers(parts)
    yield from _fidelity(parts)
    if parts.fluid is not None:
        yield from _sizes(parts, parts.fluid)
        if parts.tank is not None:
            yield from air_problems(parts.phases, parts.fluid, parts.tank, _under_the_sky(parts))
    if parts.sea is not None and parts.tank is not None:
        yield from _sea_in_a_tank(parts.sea, parts.tank)
    if parts.fluid is not None and parts.tank is not None:
        yield from _numbers(parts.fluid, parts.tank, parts.fill.values())
    if parts.window is not None and parts.fluid is not None:
        yield from _window(parts.window, parts.fluid, parts)


def _has_boxes(parts: Parts) -> bool:
    return bool(parts.boxes)


def _has_tank(parts: Parts) -> bool:
    return "tank" in parts.boxes


def _has_shore(parts: Parts) -> bool:
    return "shore" in parts.given


def _is_plane(parts: Parts) -> bool:
    return parts.fluid is not None and parts.fluid.dimension == 2


def _is_weightless(parts: Parts) -> bool:
    return parts.tank is not None and parts.fluid is not None and math.hypot(*parts.fluid.gravity) < SHORTEST_DIRECTION


def _is_window(parts: Parts) -> bool:
    return parts.window is not None


def _is_without_tension(parts: Parts) -> bool:
    return parts.fluid is not None and not parts.fluid.interfacial_tension


_SPACE = "only with fluid.dimension = 3"
# entries, ``*`` stands for a name, that some runs cannot have: which runs, and what is allowed
BARRED: tuple[tuple[str, Callable[[Parts], bool], str], ...] = (
    ("shore", _has_boxes, "at the fidelity none"),
    ("land", _has_boxes, "at the fidelity none"),
    ("areas", _has_boxes, "at the fidelity none"),
    ("sea.tide", _has_boxes, "at the fidelity none"),
    ("booms.*.pocket", _has_boxes, "at the fidelity none; particles would meet a skirt"),
    ("booms.*.reel", _has_boxes, "at the fidelity none; particles would meet a skirt"),
    ("booms.*.reel", _has_shore, "without [shore]; on a beach, a tie with `place` pays out"),
    ("emitters.*.on", _has_tank, "without a tank, in which the pipe stands"),
    ("skimmers", _has_tank, "without a tank; skimmers take parcels, not particles"),
    *((table, _is_plane, f"{_SPACE}; a tank that repeats along y (tank.periodic) is a plane with bodies")
      for table in ("bodies", "vessels", "booms", "moorings", "emitters")),
    ("sea.waves.spread", _is_plane, _SPACE),
    ("sea.waves", _is_weightless, "only with fluid.gravity, by which waves run"),
    ("bodies.*.contact_angle", _is_without_tension, f"{RIGHT_ANGLE:g} deg, or another with fluid.interfacial_tension = true"),
    ("tank.contact_angle", _is_without_tension, f"{RIGHT_ANGLE:g} deg, or another with fluid.interfacial_tension = true"),
    ("run.budget", _is_window, "false with a window, which keeps no account of causes"),
    ("fluid.scheme", _is_window, '"split" in a window'),
    ("fluid.interfacial_tension", _is_window, "false in a window"),
)  # fmt: skip


def _barred(parts: Parts) -> Iterator[Problem]:
    """Find the entries that a run of this kind cannot have."""
    for pattern, when, allowed in BARRED:
        if not when(parts):
            continue
        if parts.names.get(pattern):
            yield Problem(pattern, f"is given, allowed: {allowed}")
        for path, section, value in entries_at(pattern, parts) if pattern not in parts.names else ():
            if value is not None and is_given(section, path.rpartition(".")[2]):
                yield Problem(path, f"{shown(value)}, allowed: {allowed}")


def body_names(parts: Parts) -> tuple[str, ...]:
    """Return the names by which a probe may call a body: ``rock``, ``vessels/port``, ``boom/main/segment-03``."""
    vessels = tuple(body_of(name) for name in parts.names["vessels"])
    segments = tuple(segment for name, boom in parts.booms.items() for segment in segment_names(name, boom.segments))
    return (*parts.names["bodies"], *vessels, *segments)


def _fidelity(parts: Parts) -> Iterator[Problem]:
    """Check that the exercise offers the fidelity that is asked for."""
    changes, tables = (
        set(parts.fidelities or ()),
        {"live": "a table [fidelities.live]", "fine": "[tank], [window], or [fidelities.fine]"},
    )
    live = "live" in changes or (parts.window is not None and parts.window.spacing == "live")
    fine = "fine" in changes or bool(parts.boxes)
    offers = [name for name, there in (("live", live), ("fine", fine), ("none", True)) if there]
    if parts.fidelity is not None and parts.fidelity not in offers:
        text = f"is {parts.fidelity!r}, allowed in this exercise: {', '.join(offers)}; {parts.fidelity} needs {tables[parts.fidelity]}"
        yield Problem("fidelity", text)
    for name in sorted(changes - {"live", "fine", "none"}):
        yield Problem(f"fidelities.{name}", "is no fidelity, allowed: tables live, fine and none")


def _shore_and_skimmers(parts: Parts) -> Iterator[Problem]:
    """Check that no body has the name of the shore, and what carries skimmers."""
    for table, name, one in (
        *(("land", *item) for item in parts.land.items()),
        *(("areas", *item) for item in parts.areas.items()),
    ):
        if one.file and parts.site is None:
            yield Problem(f"{table}.{name}.file", "is given, allowed with [site], which says where its degrees lie")
    if parts.shore is not None and GROUND in parts.names["bodies"]:
        yield Problem(f"bodies.{GROUND}", "has the name of the [shore], allowed: another name")
    segments = {name: parts.booms[name].segments if name in parts.booms else 0 for name in parts.names["booms"]}
    yield from skimmer_problems(parts.skimmers, dict.fromkeys(parts.names["vessels"]), segments)


def _window(window: WindowTable, fluid: FluidSettings, parts: Parts) -> Iterator[Problem]:
    """Yield problems of the window: its gravity, its size, and particles coarser than a skirt."""
    yield from _sea_decides(fluid)
    yield from (problem.below("window") for problem in window.problems_with(fluid))
    key, spacings = "fluid.particle_spacing" if window.spacing is None else "window.spacing", dict[str, float]()
    if not isinstance(window.spacing, str):
        spacings[key] = window.spacing_in(fluid)
    if window.outer is not None:
        spacings["window.outer.spacing"] = window.outer.spacing
    for (key, spacing), (name, boom) in product(spacings.items(), parts.booms.items()):
        if boom.skirt_depth < spacing:
            text = f"is {spacing:g} m, allowed in a window: up to the skirt of boom {name!r}, {boom.skirt_depth:g} m"
            yield Problem(key, text)


def _sea_decides(fluid: FluidSettings) -> Iterator[Problem]:
    """Yield a gravity that a window cannot have."""
    if any(fluid.gravity[:2]) or fluid.gravity[2] >= 0.0:
        yield Problem("fluid.gravity", f"is {fluid.gravity}, allowed in a window: straight down, as that of the sea")


def _under_the_sky(parts: Parts) -> list[str]:
    """Name the tables with entries that take every phase that is no oil for water under an open sky."""
    tables = {"booms": parts.booms, "vessels": parts.vessels, "emitters": parts.emitters, "window": parts.window}
    if parts.sea is not None:
        tables["sea"] = {kind: one for kind in ("waves", "current", "wind") if (one := getattr(parts.sea, kind))}
    return [name for name, entries in tables.items() if entries]


def _names(parts: Parts) -> Iterator[Problem]:
    for table, names in parts.names.items():
        for name in names:
            if not re.fullmatch(NAME_PATTERN, name):
                yield Problem(table, f"has an entry {name!r}, allowed: {NAME_ALLOWED}")
    for name in parts.names["vessels"]:
        if name.lower() in ROLES:
            yield Problem("vessels", f"has an entry {name!r}, which is a role of the console, allowed: another name")
    if not parts.names["phases"]:
        yield Problem("phases", "is empty, allowed: one phase or more")
    if not parts.names["fill"] and not parts.names["emitters"] and "tank" in parts.boxes:
        yield Problem("fill", "is empty and so is emitters, allowed: liquid in one of them")


def _references(parts: Parts) -> Iterator[Problem]:
    """Find every name that leads nowhere, of the fields that are declared to be references; a probe may name vessels and segments too."""
    sections = {f"{table}.{name}": one for table in NAMED_TABLES for name, one in getattr(parts, table).items()}
    for place, section in (sections | ({} if parts.window is None else {"window": parts.window})).items():
        for key, tables, held in references(section):
            known = [one for other in tables for one in parts.names[other] if f"{other}.{one}" != place]
            verb = "is" if isinstance(getattr(section, key), str) else "holds"
            for word in (word for word in held if word not in known):
                text = unknown(word, known, " or ".join(SINGULAR[other] for other in tables))
                yield Problem(f"{place}.{key}", f"{verb} {word!r}, which {text}")
    bodies = body_names(parts)
    for name, probe in parts.probes.items():
        if isinstance(probe, BodyProbe) and probe.body not in bodies:
            yield Problem(f"probes.{name}.body", f"is {probe.body!r}, which {unknown(probe.body, bodies, 'body')}")


def _orders(parts: Parts) -> Iterator[Problem]:
    for name, vessel in parts.vessels.items():
        if vessel.control == "helmsman" and not (vessel.legs or vessel.waypoints) and "tow" not in parts.given:
            text = "is missing, allowed: give legs or waypoints, or a [tow] table for all vessels"
            yield Problem(f"vessels.{name}.legs", text)


def _plane(parts: Parts) -> Iterator[Problem]:
    """Check that a scenario in two dimensions has no motion along y."""
    if parts.fluid is None or parts.fluid.dimension == 3:
        return
    across = {f"fill.{name}.velocity": fill.velocity for name, fill in parts.fill.items()}
    across["fluid.gravity"] = parts.fluid.gravity
    for path, vector in across.items():
        if vector is not None and vector[1] != 0.0:
            yield Problem(path, f"has y = {vector[1]:g}, allowed: 0 with fluid.dimension = 2")
    for kind in ("wind", "waves", "current"):
        direction = getattr(getattr(parts.sea, kind, None), "direction", 0.0)
        if abs(math.sin(direction)) > ALONG:
            text = f"is {direction:g} rad, allowed: 0 or pi, along x, with fluid.dimension = 2"
            yield Problem(f"sea.{kind}.direction", text)


def _sea_in_a_tank(sea: SeaSettings, tank: Tank) -> Iterator[Problem]:
    """Check that the sea's surface lies in the tank."""
    if sea.level is not None and sea.level < tank.lower[2]:
        yield Problem("sea.level", f"is {sea.level:g}, allowed: the tank's floor, {tank.lower[2]:g} m, or above")


def _meshes(parts: Parts) -> Iterator[Problem]:
    for name, body in parts.bodies.items():
        if isinstance(body, MeshBody):
            suffix = Path(body.file).suffix.lower()
            if suffix not in MESH_SUFFIXES:
                text = f"is {body.file!r}, allowed: a file of the kind {', '.join(MESH_SUFFIXES)}"
                yield Problem(f"bodies.{name}.file", text)
            elif not Path(body.file).is_file():
                yield Problem(f"bodies.{name}.file", f"is {body.file!r}, which does not exist")


def _places(parts: Parts, tank: Tank) -> Iterator[Problem]:
    """Check that liquid, pipes, gauges, vessels, ends of booms and zones lie inside the tank; `scenarios.setup.layout` checks bodies."""
    for name, fill in parts.fill.items():
        yield from _inside(f"fill.{name}", fill.extent(tank), tank)
    for name, emitter in parts.emitters.items():
        yield from _inside(f"emitters.{name}.mouth", (emitter.mouth, emitter.mouth), tank)
    for name, probe in parts.probes.items():
        if not isinstance(probe, BodyProbe):
            point = (*probe.point, tank.lower[2]) if len(probe.point) == 2 else probe.point
            yield from _inside(f"probes.{name}.point", (point, point), tank)
    for name, vessel in parts.vessels.items():
        point = (*vessel.position, tank.lower[2])
        yield from _inside(f"vessels.{name}.position", (point, point), tank)
    for name, boom in parts.booms.items():
        for end in boom.ends:
            if not isinstance(end, str):
                point = (*end, tank.lower[2])
                yield from _inside(f"booms.{name}.ends", (point, point), tank)
    for name, leg in parts.moorings.items():
        point = (*leg.anchor, tank.lower[2])
        yield from _inside(f"moorings.{name}.anchor", (point, point), tank)
    for name, zone in tank.zones.items():
        if zone.lower is not None and zone.upper is not None:
            yield from _inside(f"tank.zones.{name}", (zone.lower, zone.upper), tank)


def _inside(path: str, extent: tuple[Vector, Vector], tank: Tank) -> Iterator[Problem]:
    """Yield a problem where an extent reaches out of the tank by more than rounding."""
    slack = 1e-9 * max(high - low for low, high in zip(tank.lower, tank.upper, strict=True))
    for axis, low, high, bottom, top in zip("xyz", *extent, tank.lower, tank.upper, strict=True):
        if low < bottom - slack or high > top + slack:
            reach = f"{low:g}" if low == high else f"{low:g} to {high:g}"
            yield Problem(path, f"has {axis} = {reach} m, allowed: inside the tank, {bottom:g} to {top:g} m")


def _floating(parts: Parts) -> Iterator[Problem]:
    """Check that oil floats where closures, or a sea of formulas, go by it."""
    yield from lost_oil_problems(parts.phases, [n for n, boom in parts.booms.items() if boom.losses == "closures"])
    if "tank" not in parts.boxes and len(parts.phases) == len(parts.names["phases"]):
        used = {entry.phase for entry in (*parts.fill.values(), *parts.emitters.values())}
        told = any(boom.losses == "closures" for boom in parts.booms.values())
        yield from floating_oil_problems(parts.phases, used, told)
        for name, fill in parts.fill.items() if "tank" not in parts.given else ():
            if isinstance(fill, SlabFill):
                yield Problem(f"fill.{name}.shape", 'is "slab", allowed without a tank: a shape that has sides')
        if parts.sea is not None and not parts.boxes:
            level = top_of_water(parts.fill, parts.phases) if parts.sea.level is None else parts.sea.level
            yield from afloat_problems(parts.fill, parts.phases, level or 0.0)


def _sizes(parts: Parts, fluid: FluidSettings) -> Iterator[Problem]:
    """Check pipes and skirts against a particle; windows say so themselves, of their own particles."""
    d = fluid.particle_spacing
    if "tank" not in parts.boxes:  # no pipe or skirt meets particles of this size
        return
    for name, boom in parts.booms.items():
        if boom.skirt_depth < d:
            text = f"is {boom.skirt_depth:g}, allowed: {d:g} m or more, one fluid.particle_spacing, or it holds no particle"
            yield Problem(f"booms.{name}.skirt_depth", text)
    for name, emitter in parts.emitters.items():
        if emitter.radius < 0.5 * d:
            text = f"is {emitter.radius:g}, allowed: {0.5 * d:g} m or more, half of fluid.particle_spacing"
            yield Problem(f"emitters.{name}.radius", text)
        if emitter.volume is not None and emitter.volume <= 0.5 * d**3:
            text = f"is {emitter.volume:g}, allowed: above {0.5 * d**3:g} m3, half a particle"
            yield Problem(f"emitters.{name}.volume", text)


def _numbers(fluid: FluidSettings, tank: Tank, fills: Iterable[Fill]) -> Iterator[Problem]:
    """Check that a machine can hold the particles, and 32 bits their positions; this finds lengths given in millimetres."""
    d, axes = fluid.particle_spacing, (0, 2) if fluid.dimension == 2 else (0, 1, 2)
    size = [high - low for low, high in zip(tank.lower, tank.upper, strict=True)]
    liquid = sum(
        math.prod((high[axis] - low[axis]) / d for axis in axes) for low, high in (fill.extent(tank) for fill in fills)
    )
    walls = sum(
        2.0 * math.prod(size[axis] / d for axis in axes if axis != "xyz".index(side[1])) for side in tank.closed_sides
    )
    if liquid + walls > MOST_PARTICLES:
        text = f"is {d:g} m, with which the liquid takes {liquid:.2g} particles and the tank {walls:.2g}"
        yield Problem("fluid.particle_spacing", f"{text}, allowed: {MOST_PARTICLES:.0e} together")
    furthest = max(abs(corner[axis]) for corner in (tank.lower, tank.upper) for axis in axes)
    spacings = FURTHEST - LEAK_MARGIN
    if furthest > spacings * d:
        text = f"reaches {furthest:g} m from the origin, allowed: {spacings * d:g} m, {spacings:.0f} fluid.particle_spacing"
        yield Problem("tank", text)

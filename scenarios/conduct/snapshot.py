"""Scene and state of a run for its pages: the scene once, the state at each moment, as plain data that is JSON.

All is in SI units, in the world frame; the page turns it into knots, compass courses, litres and tonnes.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from booms.boom_state import BoomState
from booms.containment import PRACTICE_SPEED
from coupling.multibody.mooring_leg import MooringLeg
from oilsim.backend.arrays import Real
from oilsim.core.physical_constants import KNOT
from oilsim.oil.fates import FATES
from recordings.model import palette
from recordings.model.exercise import GROUND, BoomDescription
from recordings.model.frame import Frame
from recordings.model.words import CAUSE_IN_WORDS, LEADING
from scenarios.conduct.history import Means
from scenarios.running.assembly import Assembly
from scenarios.schema.exercise import BoomSettings, VesselSettings, body_of, joint_name
from scenarios.schema.sea import SeaSettings
from scenarios.setup.afloat.moorings import leg_name, tie_name
from scenarios.spec.resolve import RunSpec
from scenarios.spec.scenario import Scenario
from scenarios.watch.slick_oil import spots_of_slick
from vessels.control import VesselControl
from vessels.vessel import heading_of

MOST_SPOTS = 20_000  # [1] that a page draws smoothly; the cells of particles grow until they are fewer
CELL = 2.0  # [1] smallest width of a cell, in particle spacings


def oil_spots(assembly: Assembly, frame: Frame) -> Real:
    """Return the oil afloat and ashore as spots (N, 5): x, y, radius and thickness [m], and fate.

    The frame must be that of the communication point at which the run is now.
    """
    for one in assembly.slicks:
        return spots_of_slick(one.slick)
    fluid = assembly.fluid
    oils = [phase for name, phase in frame.phases.items() if name in assembly.description.oils]
    if not oils:
        return np.empty((0, 5), np.float32)
    places = np.concatenate([oil.position for oil in oils])[:, :2].astype(np.float64)
    fates = np.concatenate([np.zeros(len(oil.id), np.uint8) if oil.fate is None else oil.fate for oil in oils])
    cell, volume = CELL * assembly.description.particle_spacing, fluid.config.rest_volume
    found = [spots_of_particles(places[fates == fate], volume, cell, fate) for fate in np.unique(fates).tolist()]
    return np.concatenate([*found, np.empty((0, 5), np.float32)])


def spots_of_particles(places: NDArray[np.float64], volume: float, cell: float, fate: int) -> Real:
    """Return one spot for each square cell [m] with oil in it, (N, 5); its thickness is the oil's volume over the cell's area.

    places (M, 2) [m] of particles of `volume` [m3]. Cells are doubled until there are at most `MOST_SPOTS`.
    """
    while True:
        cells, counts = np.unique(np.floor(places / cell).astype(np.int64), axis=0, return_counts=True)
        if len(cells) <= MOST_SPOTS:
            break
        cell *= 2.0
    shape = np.ones(len(cells))
    columns = [(cells + 0.5) * cell, cell / np.sqrt(np.pi) * shape, counts * volume / cell**2, fate * shape]
    return np.column_stack(columns).astype(np.float32)


def as_text(array: NDArray[np.float32]) -> str:
    """Return the bytes of spots (N, 5), little-endian float32, as base64."""
    return base64.b64encode(np.ascontiguousarray(array, dtype="<f4").tobytes()).decode("ascii")


GAUGES = (
    "tow_speed", "normal_speed_held", "gap_ratio", "oil_contained", "oil_lost", "oil_met", "oil_afloat", "skirt_angle",
)  # fmt: skip
NORMAL_SPEEDS = (
    0.6 * KNOT,
    0.7 * KNOT,
    1.0 * KNOT,
)  # [m/s] at which the boom's colour changes; the second is practice's limit


def scene_of(assembly: Assembly) -> dict[str, Any]:
    """Return what does not change: names, sizes, limits, and the words and colours of causes of loss."""
    scenario, exercise, site = assembly.scenario, assembly.description.exercise, assembly.description.site
    booms = exercise.booms if exercise else ()
    return {
        "kind": "scene",
        "name": scenario.name,
        "title": scenario.title,
        "duration": scenario.run.duration,
        "step": scenario.run.communication_step,
        "bearing": scenario.bearing,
        "distance": _distance(assembly),
        "bounds": [*scenario.domain.lower[:2], *scenario.domain.upper[:2]],
        "vessels": [
            {
                "name": name,
                "length": one.length,
                "beam": one.beam,
                "control": one.control,
                "line": _line_state(name, one, scenario.booms, assembly),
                "skimmers": skimmers_of_crew(name, scenario),
            }
            for name, one in scenario.vessels.items()
        ],
        "booms": [_boom_scene(boom, scenario.booms[boom.name]) for boom in booms],
        "bodies": _footprints(assembly),
        "land": _land(assembly),
        "chart": None if site is None or site.chart is None else asdict(site.chart),
        "areas": {name: [list(map(list, one)) for one in own] for name, own in assembly.areas.items()},
        "skimmers": {name: {"kind": one.kind, "on": one.on} for name, one in scenario.skimmers.items()},
        "causes": {
            name: {"words": words, "color": palette.css(palette.cause_color(name))}
            for name, words in CAUSE_IN_WORDS.items()
        },
        "oils": list(assembly.description.oils),
        "fates": list(FATES),
        "pipe": {"height": assembly.level + 0.3, "radius": max(0.1, 2.0 * assembly.description.particle_spacing)},
        "injects": [{"name": name, "text": one.text, "to": list(one.to)} for name, one in scenario.injects.items()],
        "films": [
            {"from": start, "words": words, "color": palette.css(color), "opacity": opacity}
            for start, words, color, opacity in palette.FILM
        ],
        "spot_thickness": palette.SPOT_THICKNESS,
        "speeds": {"limit": PRACTICE_SPEED, "steps": NORMAL_SPEEDS},
        "tows": scenario.tow is not None and any(not (one.legs or one.waypoints) for one in scenario.vessels.values()),
        "modelled": not scenario.tanks,
    }


def state_of(assembly: Assembly, scenario: Scenario, frame: Frame, means: Means | None = None) -> dict[str, Any]:
    """Return the state at a frame; `scenario` has all orders so far. Speeds of vessels and pulls are averaged by `means`."""
    means = means or Means()
    exercise = assembly.description.exercise
    booms = exercise.booms if exercise else ()
    current = np.array([frame.scalars.get(f"metrics/current/{axis}", 0.0) for axis in "xy"])
    several = len(booms) > 1
    return {
        "kind": "state",
        "time": frame.time,
        "index": frame.index,
        "vessels": {
            name: _vessel_state(name, one, scenario.booms, assembly, frame, current, means)
            for name, one in scenario.vessels.items()
        },
        "booms": {boom.name: _boom_state(boom, frame, current, assembly, several, means) for boom in booms},
        "skimmers": skimmers_of(assembly, scenario, frame.time, means),
        "lines": lines_of(assembly, scenario),
        "tow": None if scenario.tow is None else {"speed": scenario.tow.speed, "heading": scenario.tow.heading},
        "weather": weather_of(assembly.controls.sea) | {"within": scenario.sea.within},
        "pipes": {name: pipe.speed for name, pipe in scenario.emitters.items()},
        "given": [name for name, one in scenario.injects.items() if one.given],
        "oil": as_text(oil_spots(assembly, frame)),
        "ledger": assembly.scoring.ledger.rows.summary(),
    }


def weather_of(sea: SeaSettings) -> dict[str, Any]:
    """Return visibility [m], and current, wind and waves: speed [m/s] or height [m], and the direction [rad] they go to; None without.

    The speed of a tide, or of a table of times, is its largest, or None.
    """
    current, wind, waves = sea.current, sea.wind, sea.waves
    return {
        "current": None if current is None else _flow(current),
        "wind": None if wind is None else _flow(wind),
        "waves": None if waves is None else _waves(waves),
        "visibility": sea.visibility,
    }


def _waves(settings: Any) -> dict[str, Any]:
    """Return height [m], period [s] and direction [rad] of waves, and the keys by which height and period are ordered."""
    is_spectrum = hasattr(settings, "significant_height")
    key, period = ("significant_height", "peak_period") if is_spectrum else ("height", "period")
    height = getattr(settings, key)
    known = {"height": height, "period": getattr(settings, period), "direction": settings.direction}
    return {**known, "key": key, "period_key": period}


def _flow(settings: Any) -> dict[str, float | None]:
    return {"speed": getattr(settings, "speed", None), "direction": getattr(settings, "direction", None)}


def _boom_scene(boom: BoomDescription, settings: BoomSettings) -> dict[str, Any]:
    return {
        "name": boom.name,
        "ends": list(boom.ends),
        "segments": len(boom.segments),
        "length": boom.length,
        "skirt_depth": boom.skirt_depth,
        "full_tension": boom.full_tension,
        "tow_line": None if settings.line_stiffness is None else settings.tow_line,
        "area": [list(corner) for corner in settings.area],
    }


def _distance(assembly: Assembly) -> float:
    """Return how far the opening camera is from what it looks at [m]; without one, the length of the longest boom, or 100 m."""
    camera = assembly.scenario.camera
    if camera is None:
        return max((boom.length for boom in assembly.description.booms), default=100.0)
    return math.dist(camera.eye, camera.target)


def _footprints(assembly: Assembly) -> dict[str, list[list[float]]]:
    """Return the outlines [m] in plan of all fixed bodies, by name, as convex polygons; one on edge has none."""
    fixed = (one for one in assembly.solids if one.motion == "fixed" and one.wetted)
    found = {one.name: _hull(np.asarray(one.world_mesh().vertices)) for one in fixed}
    return {name: outline for name, outline in found.items() if outline}


def _land(assembly: Assembly) -> list[dict[str, Any]]:
    """Return the outlines [m] in plan of land and shoals with the water [m] over them, and of the shore that is dry at the start."""
    grounds = [np.asarray(one.world_mesh().vertices) for one in assembly.solids if one.name == GROUND]
    dry = [_hull(points[points[:, 2] >= assembly.level - 0.01]) for points in grounds]
    deepest_first = sorted(assembly.land, key=lambda one: -one[1])
    return [
        *({"outline": outline, "depth": 0.0} for outline in dry if outline),
        *({"outline": list(map(list, outline)), "depth": depth} for outline, depth in deepest_first),
    ]


def _hull(points: NDArray[np.float64]) -> list[list[float]]:
    """Return the convex polygon [m] around points (N, 3) in plan; empty where it has no area."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners: list[list[float]] = points[ConvexHull(points[:, :2]).vertices, :2].round(2).tolist()
    except (QhullError, ValueError):
        return []
    return corners


def _vessel_state(
    name: str,
    settings: VesselSettings,
    booms: Mapping[str, BoomSettings],
    assembly: Assembly,
    frame: Frame,
    current: np.ndarray,
    means: Means,
) -> dict[str, Any]:
    body = frame.bodies[body_of(name)]
    ground = means.mean(f"{name} over ground", frame.time, body.linear_velocity[:2])
    heading = heading_of(body.orientation)
    way = means.mean(f"{name} heading", frame.time, [np.cos(heading), np.sin(heading)])
    water = means.mean(f"{name} through water", frame.time, body.linear_velocity[:2] - current)
    helm = assembly.parts.helms[name]
    leg = helm.leg if isinstance(helm, VesselControl) else None
    return {
        "x": float(body.position[0]),
        "y": float(body.position[1]),
        "heading": heading,
        "mean_heading": float(np.arctan2(*way[::-1])),
        "over_ground": float(np.linalg.norm(ground)),
        "through_water": float(np.linalg.norm(water)),
        "engine": settings.engine,
        "line": _line_state(name, settings, booms, assembly),
        "ordered": None if leg is None else {"speed": leg.speed, "heading": leg.heading, "by_hand": leg.by_hand},
    }


def _line_state(
    vessel: str, settings: VesselSettings, booms: Mapping[str, BoomSettings], assembly: Assembly
) -> dict[str, float] | None:
    """Return the lengths [m] of a vessel's tow line: as laid for both ends, as ordered here, and now; None without a winch."""
    for name, boom in booms.items():
        if vessel in boom.ends and boom.line_stiffness is not None and assembly.world is not None:
            lines, line = assembly.world.lines, assembly.fleet.tensions_of(name)[vessel]
            ordered = boom.tow_line - settings.hauled
            changed = lines.length(line) - lines.laid_length(line)
            now = assembly.scenario.booms[name].tow_line + changed
            return {"laid": boom.tow_line, "ordered": ordered, "now": now}
    return None


def _boom_state(
    boom: BoomDescription, frame: Frame, current: np.ndarray, assembly: Assembly, several: bool, means: Means
) -> dict[str, Any]:
    bodies = [frame.bodies[segment] for segment in boom.segments]
    state = BoomState(
        position=np.array([body.position for body in bodies]),
        orientation=np.array([body.orientation for body in bodies]),
        velocity=np.array([body.linear_velocity for body in bodies]),
        joint_points=np.array(boom.joint_points),
        waterline=boom.waterline,
        flow_share=np.array(boom.flow_shares) if boom.flow_shares else 1.0,
    )
    prefix = f"metrics/{boom.name}/" if several else "metrics/"
    scalars = {key.removeprefix(prefix): value for key, value in frame.scalars.items() if key.startswith(prefix)}
    swings = {name: value for name, value in scalars.items() if name == "tow_speed" or name.startswith("tow_tension/")}
    scalars |= {name: float(means.mean(f"{boom.name} {name}", frame.time, value)) for name, value in swings.items()}
    gauges = {name: _finite(scalars.get(name)) for name in GAUGES}
    lost, led_on = _named(scalars, "oil_lost/"), None
    if boom.deployment in LEADING:  # what it leads on is not lost
        led_on = lost.pop("around_ends", None) or 0.0
        gauges["oil_lost"] = max(0.0, (gauges["oil_lost"] or 0.0) - led_on)
    return {
        "line": state.line().round(2).tolist(),
        "normal": state.normal_speed(current).round(3).tolist(),
        "tension": [_finite(round(body.tension, 1)) for body in bodies],
        "parted": _parted(boom, assembly),
        "pull": _named(scalars, "tow_tension/"),
        "lost": lost,
        "led_on": led_on,
        **gauges,
    }


def _parted(boom: BoomDescription, assembly: Assembly) -> list[int]:
    """Return the numbers of the joints of a boom that have parted, by an order or by their load."""
    assert assembly.world is not None, "booms need a world"
    holding = set(assembly.world.joint_names)
    return [number for number in range(1, len(boom.segments)) if joint_name(boom.name, number) not in holding]


def _named(scalars: Mapping[str, float], prefix: str) -> dict[str, float | None]:
    """Return the series that begin with a prefix, without it."""
    return {key.removeprefix(prefix): _finite(value) for key, value in scalars.items() if key.startswith(prefix)}


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def skimmers_of_crew(vessel: str, scenario: Scenario | RunSpec) -> list[str]:
    """Return the names of the skimmers that a vessel's crew works with: on it, on a boom that it holds, or on none that a vessel holds."""
    found = []
    for name, one in scenario.skimmers.items():
        boom = scenario.booms.get(one.on or "")
        holders = {one.on} if boom is None else set(boom.ends)
        if vessel in holders or holders.isdisjoint(scenario.vessels):
            found.append(name)
    return found


def skimmers_of(assembly: Assembly, scenario: Scenario, time: float, means: Means) -> dict[str, Any]:
    """Return what each skimmer does at `time` [s]: its place [m], rates [m3/s], volumes [m3], and why it stands; `scenario` has all orders.

    The rate of oil is averaged by `means`.
    """
    found = {}
    for one in assembly.skimmers:
        skimmer, x_y = one.skimmer, one.mouth
        is_ashore = skimmer.ashore_until is not None
        why = "" if skimmer.works else "stopped" if not skimmer.is_running else "emptied" if is_ashore else "full"
        found[one.short_name] = {
            "x": x_y[0],
            "y": x_y[1],
            "rate": float(means.mean(one.name, time, one.get("rate"))),
            "place": list(scenario.skimmers[one.short_name].place),
            "moves": bool((one.target != one.offset).any()),
            "nameplate": scenario.skimmers[one.short_name].nameplate / 3600.0,
            "swath": skimmer.design.swath,
            "stands": why,
            "oil": skimmer.account.oil,
            "oil_aboard": skimmer.oil_aboard,
            "water_aboard": skimmer.water_aboard,
            "storage": skimmer.design.storage,
        }
    return found


def lines_of(assembly: Assembly, scenario: Scenario) -> dict[str, Any]:
    """Return each leg and tie: ends [m] in plan, tension [N], whether it holds; of a leg how far [m] its anchor has dragged."""
    world, found = assembly.world, dict[str, Any]()
    if world is None:
        return found
    for name, line_name in (
        *((name, leg_name(name)) for name in scenario.moorings),
        *((name, tie_name(name)) for name in scenario.ties),
    ):
        line = world.lines[line_name]
        is_leg = isinstance(line, MooringLeg)
        found[line_name] = {
            "name": name,
            "kind": "mooring" if is_leg else "tie",
            "ends": world.line_ends(line_name)[:, :2].round(2).tolist(),
            "tension": line.tension,
            "holds": not line.parted if isinstance(line, MooringLeg) else line.holds,
            "dragged": line.dragged if isinstance(line, MooringLeg) else None,
        }
    return found

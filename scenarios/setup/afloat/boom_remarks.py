"""Remarks on booms before a run.

They tell how finely particles resolve the skirt, how much of the section the boom fills, to which side it bulges, and what drives the water
at it. They also tell whether the water starts with the current that the closures use.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np

from booms.losses.resolution import blockage_in_words, skirt_in_words
from oilsim.core.physical_constants import KNOT
from recordings.model.words import course_in_words
from scenarios.schema.exercise import BoomSettings
from scenarios.schema.sea import horizontal
from scenarios.setup.afloat.boom_losses import has_closures
from scenarios.setup.afloat.fleet import bulge_of
from scenarios.spec.resolve import RunSpec

# [1] cosine up to which a current runs along the line between the ends; numerical; far above rounding
ALONG = 1e-6
# [-] of the current's speed and [m/s], by which water at the start may differ from the current before it is said; chosen
START_SHARE, START_SLACK = 0.2, 0.02


def boom_remarks(spec: RunSpec, level: float) -> dict[str, str]:
    """Return what is to be said of each boom, by ``skirt main`` or ``blockage main``, and of all: ``start``; level [m] of the water."""
    return dict(chain(*(_remarks(name, boom, spec, level) for name, boom in spec.booms.items()), _start(spec)))


def _start(spec: RunSpec) -> Iterator[tuple[str, str]]:
    """Say that water starts with another velocity than that of a current in a zone, which the closures take everywhere."""
    speed, direction = spec.sea.steady_current
    phases = spec.phases
    closed = [name for name, boom in spec.booms.items() if has_closures(boom, phases)]
    if not speed or not spec.domain.zones or not closed:
        return
    ordered = horizontal(speed, direction)
    for name, fill in spec.fill.items():
        phase, velocity = phases[fill.phase], fill.velocity or (0.0, 0.0, 0.0)
        off = math.dist(velocity[:2], ordered[:2])
        if phase.is_oil or phase.is_air or off <= START_SHARE * speed + START_SLACK:
            continue
        along = float(np.dot(velocity, horizontal(1.0, direction)))
        advice = ", ".join(f"{round(part, 3) + 0.0:g}" for part in ordered)
        yield (
            "start",
            f"boom {', '.join(closed)}: fill.{name} starts at {along / KNOT:.2f} kn along the current, and the closures take its "
            f"{speed / KNOT:.2f} kn from the start. What is lost until the water has come up to speed is not to be trusted. "
            f"Start it with fill.{name}.velocity = [{advice}]",
        )
        return


def _remarks(name: str, boom: BoomSettings, spec: RunSpec, level: float) -> Iterator[tuple[str, str]]:
    closed = has_closures(boom, spec.phases)
    yield (
        f"skirt {name}",
        f"boom {name}: {skirt_in_words(boom.skirt_depth, spec.spacing, has_closures=closed)}",
    )
    text = _bulge_in_words(boom, spec)
    if text:
        yield f"bulge {name}", f"boom {name}: {text}"
    text = blockage_in_words(blockage(boom, spec, level))
    if text:
        yield f"blockage {name}", f"boom {name}: {text}"
    if _is_driven(boom, spec):
        yield (
            f"driven {name}",
            f"boom {name}: it stands where the sea drives the water, also the water that it holds and shelters. "
            "This can carry oil past it that a real boom would hold. Give the tank a zone (tank.zones) ahead of the boom",
        )


def _is_driven(boom: BoomSettings, spec: RunSpec) -> bool:
    """Tell whether waves or a current drive the particles at an end of the boom."""
    if spec.sea.waves is None and spec.sea.current is None:
        return False
    boxes = [(one.lower, one.upper) for one in spec.domain.zones.values()] or [(None, None)]
    return any(
        all((low or spec.domain.lower)[k] <= end[k] <= (high or spec.domain.upper)[k] for k in (0, 1))
        for low, high in boxes
        for end in _ends(boom, spec)
    )


def _ends(boom: BoomSettings, spec: RunSpec) -> list[Sequence[float]]:
    """Return the places (x, y) [m] of the ends, those of their vessels."""
    return [spec.vessels[end].position if isinstance(end, str) else end for end in boom.ends]


def _bulge_in_words(boom: BoomSettings, spec: RunSpec) -> str:
    """Say to which side a boom between fixed points is laid; empty for one with a vessel at an end, and where it is the current's side."""
    first, second = boom.ends
    if isinstance(first, str) or isinstance(second, str):
        return ""
    side = 0.5 * math.pi if bulge_of(boom, spec.sea.steady_current) == "left" else -0.5 * math.pi
    toward = math.atan2(second[1] - first[1], second[0] - first[0]) + side
    speed, direction = spec.sea.steady_current
    with_it = math.cos(direction - toward) if speed else 0.0
    if with_it > ALONG:
        return ""
    text = f"it is laid so that it bulges towards {course_in_words(toward, spec.bearing)} degrees of the compass"
    if with_it < -ALONG:
        text += ", against the current, which will swing it over"
    return text


def blockage(boom: BoomSettings, spec: RunSpec, level: float) -> float:
    """Compute the share [-] of the water's section up to `level` [m] that a boom and the hulls that tow it fill, across the water's way.

    The way is that of the tow or of the vessel's first leg under way, or of the current. Open sides do not hold the water in: the share is
    0 where one lies across, and in a run whose sea is formulas.
    """
    tank = spec.domain
    way = _way(boom, spec)
    if way is None:
        return 0.0
    across = np.array([-math.sin(way), math.cos(way)])
    axis = int(np.argmax(np.abs(across)))
    if {f"-{'xy'[axis]}", f"+{'xy'[axis]}"} & set(tank.open):
        return 0.0
    vessels = [spec.vessels[end] for end in boom.ends if isinstance(end, str)]
    ends = _ends(boom, spec)
    opening = abs(float((np.array(ends[1]) - np.array(ends[0])) @ across))
    filled = opening * boom.skirt_depth + sum(vessel.beam * vessel.draft for vessel in vessels)
    section = (tank.upper[axis] - tank.lower[axis]) / abs(across[axis]) * (level - tank.lower[2])
    return float(min(1.0, filled / section)) if section > 0.0 else 0.0


def _way(boom: BoomSettings, spec: RunSpec) -> float | None:
    """Return the direction [rad] in which the boom goes through the water, or the water past it; None if neither moves."""
    for end in boom.ends:
        for leg in spec.vessels[end].legs if isinstance(end, str) else ():
            if leg.speed != 0.0:
                return leg.heading
    towed = any(isinstance(end, str) for end in boom.ends)
    if towed and spec.tow is not None and spec.tow.speed > 0.0:
        return spec.tow.heading
    speed, direction = spec.sea.steady_current
    return direction if speed else None

"""Lays mooring legs and ties: where they are made fast, the ground and the shore, and what is wrong with them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from booms.deployment import BoomLayout, PlacedLine
from booms.equilibrium import HangingBoom, Tie, tied_lines
from coupling.bullet.rigid_body_world import RigidBodyWorld
from coupling.multibody.ground_tackle import Anchor, LegPart
from coupling.participants.plan_barriers import Beach
from oilsim.backend.arrays import Array
from scenarios.schema.exercise import BoomSettings, body_of
from scenarios.schema.moorings import MooringSettings, PartSettings, TieSettings, held_ends, tied_ends
from scenarios.schema.sea import ShoreSettings
from scenarios.setup.solids.placed_solids import Solid, vector
from scenarios.text.problems import Problem
from vessels.ground_tackle import Rope, laid_anchor, leg_part

LEG_RELAXATION_TIME = 0.02  # [s], as of an elastic line; the water around what is moored damps more
ENTRY = "moorings"  # names of legs in the run: moorings/NAME


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedLeg:
    """A mooring leg: its body, the point (3,) [m] of the world where it is made fast, parts from there down, and the anchor."""

    name: str
    body: str
    point: Array
    parts: tuple[LegPart, ...]
    anchor: Anchor
    parted: bool = False


def leg_name(mooring: str) -> str:
    """Return the name of a leg among the lines of the world."""
    return f"{ENTRY}/{mooring}"


def tie_name(tie: str) -> str:
    """Return the name of a tie among the lines of the world."""
    return f"ties/{tie}"


def place_ties(
    ties: Mapping[str, TieSettings], booms: Mapping[str, BoomLayout], problems: list[Problem]
) -> tuple[PlacedLine, ...]:
    """Return the ties of booms as laid, except those of booms that could not be laid; one that cannot be fast yet is a problem."""
    lines = []
    for name, tie in ties.items():
        if tie.made_fast:
            text = "is true at the start, allowed: false; an order makes the tie fast when its ends are within reach"
            problems.append(Problem(f"ties.{name}.made_fast", text))
        if not all(boom in booms for boom in tie.booms):
            continue
        fast = [_boom_joint(booms[boom], joint) for boom, joint in zip(tie.booms, tie.joints, strict=True)]
        one, first = fast[0]
        two, second = (None, np.array([*tie.place, first[2]])) if tie.place is not None else fast[1]
        lines.append(
            PlacedLine(
                name=tie_name(name),
                body_a=one,
                body_b=two,
                points=np.array([first, second]),
                stiffness=tie.stiffness,
                breaking_load=math.inf if tie.breaking_load is None else tie.breaking_load,
                loose_length=tie.length if tie.waits else None,
            )
        )
    return tuple(lines)


def tied_shapes(
    afloat: Mapping[str, BoomSettings],
    moorings: Mapping[str, MooringSettings],
    ties: Mapping[str, TieSettings],
    hang: Callable[[BoomSettings], Array],
    problems: list[Problem],
) -> dict[str, Array | None]:
    """Return the lines (S + 1, 2) [m] of tied booms by name; None for all if one is not `afloat`, or if they cannot hang.

    hang: the line of a boom without its ties, or ValueError.
    """
    between = {name: tie for name, tie in ties.items() if tie.length is not None and not tie.waits}
    lines: dict[str, Array | None] = {boom: None for tie in between.values() for boom in tie.booms}
    if not lines or not all(name in afloat for name in lines):
        return lines
    booms, stream = dict[str, HangingBoom](), 0.0
    for name in lines:
        settings = afloat[name]
        stream = settings.stream or 0.0
        moored = held_ends(moorings, name, settings.segments)
        tied = tied_ends(ties, name, settings.segments)
        held = (moored[0] or tied[0] is None, moored[1] or tied[1] is None)
        try:
            booms[name] = HangingBoom(line=hang(settings), load=settings.skirt_depth, held=held)
        except ValueError as error:
            problems.append(Problem(f"booms.{name}", f"cannot be laid: {error}"))
            return lines
    fast = [
        Tie(name=name, ends=((tie.booms[0], tie.joints[0]), (tie.booms[1], tie.joints[1])), length=tie.length)
        for name, tie in between.items()
        if tie.length is not None
    ]
    try:
        return {**lines, **tied_lines(booms, fast, stream)}
    except ValueError as error:
        problems.append(Problem("ties", f"cannot be laid: {error}"))
        return lines


def beach_of(shore: ShoreSettings | None, level: float) -> Beach | None:
    """Return a shore in still water up to `level` [m]; None without one."""
    if shore is None:
        return None
    return Beach(
        waterline=(*shore.waterline, level),
        seaward=shore.seaward,
        slope=shore.slope,
        width=shore.width,
        capacity=shore.capacity,
    )


def place_moorings(
    moorings: Mapping[str, MooringSettings],
    ground: float | None,
    booms: Mapping[str, BoomLayout],
    vessels: Mapping[str, Solid],
    bodies: Mapping[str, Solid],
    problems: list[Problem],
) -> tuple[PlacedLeg, ...]:
    """Lay all legs; those that cannot be are added to `problems`.

    ground: its height [m], None without one; vessels and bodies: by the names of their tables.
    """
    legs = []
    for name, settings in moorings.items():
        path = f"{ENTRY}.{name}"
        if ground is None:
            text = "lies on no ground: the tank is open below; allowed: a tank with a floor, or the fidelity none"
            problems.append(Problem(f"{path}.anchor", text))
            continue
        fast = _fast(settings, booms, vessels, bodies)
        if fast is None:
            continue  # it is already among the problems
        body, point = fast
        parts = tuple(_part(part) for part in reversed(settings.parts))
        place = (*settings.anchor, ground)
        fault = _fault(parts, point, place)
        if fault:
            problems.append(Problem(f"{path}.parts", fault))
            continue
        anchor = laid_anchor(settings.kind, settings.mass or 0.0, settings.ground, place, settings.holding)
        legs.append(
            PlacedLeg(name=leg_name(name), body=body, point=point, parts=parts, anchor=anchor, parted=settings.parted)
        )
    return tuple(legs)


def add_legs(world: RigidBodyWorld, legs: tuple[PlacedLeg, ...], problems: list[Problem]) -> None:
    """Add the legs to the world; a leg that is too stiff to be stepped is a problem."""
    for leg in legs:
        try:
            world.add_mooring_leg(
                leg.name, leg.body, vector(leg.point), leg.parts, leg.anchor, relaxation_time=LEG_RELAXATION_TIME
            )
        except ValueError as error:
            problems.append(Problem(f"{leg.name.replace('/', '.')}.parts", f"cannot be used: {error}"))
            continue
        if leg.parted:
            world.part_line(leg.name)


def _part(part: PartSettings) -> LegPart:
    return leg_part(part.material, Rope(length=part.length, diameter=part.diameter), part.breaking_load)


def _fast(
    settings: MooringSettings,
    booms: Mapping[str, BoomLayout],
    vessels: Mapping[str, Solid],
    bodies: Mapping[str, Solid],
) -> tuple[str, Array] | None:
    """Return the body that a leg holds and the point (3,) [m] where; None for one that could not be placed."""
    if settings.boom is not None:
        layout = booms.get(settings.boom)
        return None if layout is None else _boom_joint(layout, settings.joint)
    if settings.vessel is not None:
        vessel = vessels.get(settings.vessel)
        return None if vessel is None else (body_of(settings.vessel), _deck_point(vessel, settings.at))
    body = bodies.get(settings.body or "")
    if body is None:
        return None
    vertices = body.world_mesh().vertices
    return body.name, np.array([*body.placed.position[:2], float(vertices[:, 2].min())])


def _boom_joint(layout: BoomLayout, joint: int) -> tuple[str, Array]:
    """Return the segment and the point (3,) [m] of a joint, counted from the first end."""
    count = len(layout.segments)
    segment = layout.segments[min(joint, count - 1)].name
    if joint in (0, count):
        return segment, layout.end_points[0 if joint == 0 else 1]
    return segment, np.array(layout.joints[joint - 1].point)


def _deck_point(vessel: Solid, at: str) -> Array:
    """Return a point (3,) [m] of the world on a vessel's deck edge, over its centreline or its middle."""
    low, high = vessel.placed.mesh.bounds
    middle = 0.5 * (low + high)
    x = {"bow": high[0], "stern": low[0]}.get(at, middle[0])
    y = {"port": high[1], "starboard": low[1]}.get(at, middle[1])
    qx, qy, qz, qw = vessel.placed.orientation
    heading = math.atan2(2.0 * (qx * qy + qw * qz), 1.0 - 2.0 * (qy * qy + qz * qz))
    c, s = math.cos(heading), math.sin(heading)
    return vessel.placed.position + np.array([c * x - s * y, s * x + c * y, high[2]])


def _fault(parts: tuple[LegPart, ...], point: Array, place: tuple[float, float, float]) -> str:
    """Say why a leg does not reach from its anchor to its upper end; empty if it does."""
    chord, length = math.dist(point, place), sum(part.length for part in parts)
    if point[2] < place[2]:
        return f"begin {place[2] - point[2]:.3g} m under the ground, allowed: an upper end above it"
    if length < chord:
        return f"are {length:.4g} m long together, allowed: {chord:.4g} m or more, the distance of the anchor"
    return ""

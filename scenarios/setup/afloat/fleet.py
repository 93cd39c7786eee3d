"""The fleet of a scenario: vessels and booms, afloat in their places, with the joints and lines between them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Literal

import numpy as np

from booms.boom import Boom, BoomDesign
from booms.deployment import (
    BoomLayout,
    PlacedBody,
    PlacedJoint,
    PlacedLine,
    lay_aground,
    lay_along,
    lay_between,
    lay_in_stream,
    line_in_stream,
    tow_line,
)
from coupling.participants.plan_barriers import Beach
from oilsim.backend.arrays import Array
from scenarios.schema.exercise import BoomSettings, TowSettings, VesselSettings, body_of
from scenarios.schema.moorings import held_ends, leg_that_holds, tied_ends
from scenarios.schema.parsing.quantity_fields import Point2
from scenarios.schema.sea import horizontal
from scenarios.setup.afloat.boom_lines import lay_off_reel, reel_line, reel_name, strung
from scenarios.setup.afloat.moorings import PlacedLeg, leg_name, place_moorings, place_ties, tie_name, tied_shapes
from scenarios.setup.solids.placed_solids import Solid
from scenarios.spec.resolve import RunSpec
from scenarios.text.problems import Problem
from vessels.course import Course, CourseLeg, course_through
from vessels.drive import ASTERN, DriveModel
from vessels.hull import Hull, float_hull, raked_barge, wigley_hull
from vessels.hull_forces import HullForces
from vessels.looks import drawn_vessel
from vessels.vessel import ControlGains, Propulsion, Superstructure, Vessel
from vessels.windage import DRAG_COEFFICIENT, Windage

LINE_MASS = 0.1  # [kg/m], mass of a tow line
LINE_DIAMETER = 0.02  # [m]
RAKE = 0.15  # length of the slope at each end of a barge, in lengths of the barge
# [rad/s], bandwidth of the speed loop; three times a free vessel's: boom and entrained water are heavier
TOWING_BANDWIDTH = 3.0
# [1] of the thrust astern, by which an engine swings at most as its hull surges in waves; chosen; else one side is cut, and that drives
SWING = 0.5
# [s], relaxation time of an elastic line, which damps a segment's oscillation within a period or two
LINE_RELAXATION_TIME = 0.02
# [1] moment that a helmsman may ask of a drive, over length and bollard pull; the drive gives what it can
STEERING = 0.5
RUDDER_BANDWIDTH = 0.5  # [rad/s] of the heading of a vessel of REFERENCE_LENGTH with a drive: a rudder takes seconds
REFERENCE_LENGTH = 15.0  # [m]
SLACK = 1e-3  # least slack between two points, in lengths of the boom; a straight boom has an unbounded tension
TOW_POINT = -0.4  # position from midships in the waterline, in lengths of the vessel


@dataclass(frozen=True, kw_only=True, eq=False)
class Fleet:
    """Vessels, booms, the joints and lines between them, and the mooring legs of all bodies.

    tension_joints: by boom and end, for example ``("main", "port")``, the joint or elastic line whose tension is the tow tension.
    """

    vessels: tuple[Vessel, ...] = ()
    booms: Mapping[str, BoomLayout] = field(default_factory=dict)
    solids: tuple[Solid, ...] = ()
    joints: tuple[PlacedJoint, ...] = ()
    lines: tuple[PlacedLine, ...] = ()
    legs: tuple[PlacedLeg, ...] = ()
    tension_joints: Mapping[tuple[str, str], str] = field(default_factory=dict)

    def tensions_of(self, boom: str) -> dict[str, str]:
        """Return the joints that carry a boom's tow tension, by its ends."""
        return {end: joint for (name, end), joint in self.tension_joints.items() if name == boom}


@dataclass(frozen=True, kw_only=True)
class Waters:
    """The water in which vessels and booms float at the start.

    level          [m] of the still water; density [kg/m3]
    ground         [m] height of the ground; None without one
    beach          None without one
    current        speed [m/s] and direction [rad] of a steady current at the surface; 0 without one
    orbital_speed  [m/s] at which the water of waves swings at the surface
    is_windy       whether a wind blows; in_tank: whether particles of a tank bear what floats
    spacing        [m] of the particles that bodies may meet; None without any
    """

    level: float
    density: float
    ground: float | None
    beach: Beach | None
    current: tuple[float, float]
    orbital_speed: float
    is_windy: bool
    in_tank: bool
    spacing: float | None


def place_fleet(spec: RunSpec, waters: Waters, own_solids: Sequence[Solid], problems: list[Problem]) -> Fleet:
    """Place vessels and booms of a run, afloat in their waters, and moor them and the `own_solids` of [bodies].

    Those that cannot float or be laid are added to `problems`.
    """
    vessels: dict[str, Vessel] = {}
    for name, settings in spec.vessels.items():
        try:
            vessels[name] = _vessel(name, settings, spec.tow, waters)
        except ValueError as error:
            problems.append(Problem(f"vessels.{name}", f"cannot float: {error}"))
    solids = [_afloat(vessel, spec.vessels[vessel.name], waters) for vessel in vessels.values()]
    joints: list[PlacedJoint] = []
    booms: dict[str, BoomLayout] = {}
    lines: list[PlacedLine] = []
    tensions: dict[tuple[str, str], str] = {}
    afloat = {
        name: boom
        for name, boom in spec.booms.items()
        if all(end in vessels for end in boom.ends if isinstance(end, str))
    }
    hanging = tied_shapes(afloat, spec.moorings, spec.ties, lambda boom: _line_of(boom, vessels, waters), problems)
    for name, boom in afloat.items():
        if hanging.get(name, ()) is None:
            continue  # its tie is already among the problems
        try:
            layout, ends = _laid(name, boom, spec, waters, vessels, hanging.get(name))
        except ValueError as error:
            problems.append(Problem(f"booms.{name}", f"cannot be laid: {error}"))
            continue
        booms[name] = layout
        solids += [*(Solid(placed=segment) for segment in layout.segments), *ends.links]
        joints += [*layout.joints, *ends.joints]
        lines += ends.lines
        tensions |= {(name, end): joint for end, joint in ends.tensions.items()}
    return Fleet(
        vessels=tuple(vessels.values()),
        booms=booms,
        solids=tuple(solids),
        joints=tuple(joints),
        lines=(*lines, *place_ties(spec.ties, booms, problems)),
        legs=place_moorings(
            spec.moorings,
            waters.ground,
            booms,
            dict(zip(vessels, solids, strict=False)),
            {solid.name: solid for solid in own_solids},
            problems,
        ),
        tension_joints=tensions,
    )


def _vessel(name: str, settings: VesselSettings, tow: TowSettings | None, waters: Waters) -> Vessel:
    size = (settings.length, settings.beam, settings.draft, settings.depth)
    mesh = wigley_hull(*size) if settings.shape == "wigley" else raked_barge(*size, rake=RAKE * settings.length)
    hull = float_hull(mesh, settings.draft, water_density=waters.density)
    x, y, z = hull.deck_point(TOW_POINT * settings.length, 0.0)
    at_sea = not waters.in_tank
    in_wind = waters.is_windy and not at_sea
    return Vessel(
        name=name,
        hull=hull,
        propulsion=Propulsion(
            bollard_pull=settings.bollard_pull,
            astern_pull=ASTERN * settings.bollard_pull,
            yaw_moment=STEERING * settings.length * settings.bollard_pull
            if settings.yaw_moment is None
            else settings.yaw_moment,
            side_thrust=settings.side_thrust,
        ),
        course=course_of(settings, tow),
        position=settings.position,
        heading=settings.heading,
        tow_point=(float(x), float(y), float(z)),
        engine_runs=any(settings.screws),
        screws=settings.screws,
        drive=None
        if settings.drive is None
        else DriveModel(settings.drive, hull.length, settings.bollard_pull, hull.water_density),
        hull_forces=HullForces(hull, settings.skeg_area) if at_sea else None,
        gains=gains_of(settings, hull.mass_properties.mass, waters.orbital_speed),
        superstructure=_superstructure(settings, hull) if in_wind or at_sea else None,
        windage=Windage(hull.mesh, waters.level) if in_wind else None,
    )


def gains_of(settings: VesselSettings, mass: float, orbital_speed: float) -> ControlGains:
    """Return the gains of a vessel of a mass [kg] in waves whose water swings at a speed [m/s], 0 without waves.

    The loop of the speed asks for a thrust 2 m w u [N] as the hull surges at u. A vessel whose machinery cannot give that ahead and astern
    alike makes too much way. So large waves make w small.
    """
    towing = TOWING_BANDWIDTH
    if orbital_speed > 0.0:
        towing = min(towing, SWING * ASTERN * settings.bollard_pull / (2.0 * mass * orbital_speed))
    if settings.drive is None:
        return ControlGains(acceleration=settings.acceleration, speed_bandwidth=towing)
    steering = RUDDER_BANDWIDTH * math.sqrt(REFERENCE_LENGTH / settings.length)
    return ControlGains(
        acceleration=settings.acceleration,
        speed_bandwidth=towing,
        heading_bandwidth=steering,
        lane_bandwidth=steering,
    )


def _superstructure(settings: VesselSettings, hull: Hull) -> Superstructure:
    """Return a superstructure as high as wide, amidships on deck."""
    x, y, z = hull.deck_point(0.0)
    return Superstructure(
        area=settings.superstructure_area,
        drag_coefficient=DRAG_COEFFICIENT,
        center=(float(x), float(y), float(z) + 0.5 * math.sqrt(settings.superstructure_area)),
    )


def course_of(settings: VesselSettings, tow: TowSettings | None) -> Course | None:
    """Return a vessel's own course, or that of the tow: it waits in its place, then keeps to the line that begins there."""
    if settings.control == "manual":
        return None
    if settings.waypoints:
        assert settings.transit is not None
        route = course_through([settings.position, *settings.waypoints], settings.transit, start_time=settings.depart)
        wait = replace(route.legs[0], start_time=0.0, speed=0.0, until=None)
        return Course(legs=(wait, *route.legs)) if settings.depart > 0.0 else route
    legs = [
        CourseLeg(start_time=leg.start, speed=leg.speed, heading=leg.heading, through=leg.through, by_hand=leg.by_hand)
        for leg in settings.legs
    ]
    if not legs and tow is not None:
        if tow.start > 0.0:
            legs.append(CourseLeg(start_time=0.0, speed=0.0, heading=tow.heading, through=settings.position))
        legs.append(CourseLeg(start_time=tow.start, speed=tow.speed, heading=tow.heading, through=settings.position))
    return Course(legs=tuple(legs))


def _afloat(vessel: Vessel, settings: VesselSettings, waters: Waters) -> Solid:
    position, orientation = vessel.initial_pose(waters.level)
    with_lines = settings.shape == "barge" and waters.spacing is None
    placed = PlacedBody(
        name=body_of(vessel.name),
        mesh=vessel.hull.mesh,
        mass_properties=vessel.hull.mass_properties,
        position=position,
        orientation=orientation,
    )
    return Solid(placed=placed, drawn=drawn_vessel(vessel.hull, settings.superstructure_area, with_lines=with_lines))


@dataclass(kw_only=True, eq=False)
class _Ends:
    """The two ends of a boom: rigid links and their joints, elastic lines, and for each end the part that carries its tension."""

    links: list[Solid] = field(default_factory=list)
    joints: list[PlacedJoint] = field(default_factory=list)
    lines: list[PlacedLine] = field(default_factory=list)
    tensions: dict[str, str] = field(default_factory=dict)


def _layout(
    name: str, settings: BoomSettings, waters: Waters, places: tuple[Point2, Point2], line: Array | None
) -> BoomLayout:
    """Lay a boom off its reel, along a line (S + 1, 2) [m], or between two places [m], in its stream if it has one."""
    boom, whole, (first, second), level = _boom(settings, waters), f"boom/{name}", places, waters.level
    if settings.reel is not None:
        return lay_off_reel(boom, first, second, level, whole)
    if line is not None:
        return lay_along(boom, line, water_level=level, name=whole)
    if settings.stream is not None:
        return lay_in_stream(boom, first, second, settings.stream, water_level=level, name=whole)
    bulge = bulge_of(settings, waters.current)
    return lay_between(boom, first, second, water_level=level, name=whole, bulge=bulge)


def _laid(
    name: str, settings: BoomSettings, spec: RunSpec, waters: Waters, vessels: Mapping[str, Vessel], line: Array | None
) -> tuple[BoomLayout, _Ends]:
    """Lay a boom between its ends, or along a line (S + 1, 2) [m] in which ties hold it, and make it fast there."""
    water_level = waters.level
    places = [_boom_end(end, settings, vessels, water_level) for end in settings.ends]
    moored = held_ends(spec.moorings, name, settings.segments)
    tied = tied_ends(spec.ties, name, settings.segments)
    if settings.reel is None and not any((*moored, *tied, *(isinstance(end, str) for end in settings.ends))):
        _require_slack(math.dist(*places), settings.length)
    layout = _layout(name, settings, waters, (places[0], places[1]), line)
    if waters.beach is not None:  # the part of it that reaches over the shore lies there
        layout = lay_aground(layout, waters.beach.height, water_level)
    ends = _Ends()
    for index, (end, label) in enumerate(zip(settings.ends, settings.end_labels, strict=True)):
        segment, point = layout.segments[-index].name, layout.end_points[index]
        holds = f"boom/{name}/tow-{label}"
        if not isinstance(end, str) and (moored[index] or tied[index]):
            mooring = leg_that_holds(spec.moorings, name, settings.segments * index)
            ends.tensions[label] = tie_name(tied[index] or "") if mooring is None else leg_name(mooring)
        elif settings.reel is not None and index == 0:
            ends.lines.append(reel_line(name, layout, settings.reel))
            ends.tensions[label] = reel_name(name)
        elif not isinstance(end, str):
            ends.joints.append(PlacedJoint(name=holds, body_a=segment, body_b=None, point=point))
            ends.tensions[label] = holds
        else:
            ends.tensions[label] = _towed(ends, holds, (end, vessels[end]), (segment, point), settings, water_level)
    return layout, ends


def _towed(
    ends: _Ends, line: str, tow: tuple[str, Vessel], held: tuple[str, Array], settings: BoomSettings, water_level: float
) -> str:
    """Add a tow line from a vessel, by its name, to a point [m] of a segment; returns the part that carries its tension."""
    (end, vessel), (segment, point) = tow, held
    tow_point = vessel.initial_tow_point(water_level)
    if settings.line_stiffness is not None:
        ends.lines.append(strung(line, vessel, segment, np.array([tow_point, point]), settings))
        return line
    bodies, fast = tow_line(
        line, body_of(end), tow_point, segment, point, mass_per_meter=LINE_MASS, diameter=LINE_DIAMETER
    )
    ends.links += [Solid(placed=body, contact=False, wetted=False) for body in bodies]
    ends.joints += fast
    return fast[-1].name


def _line_of(settings: BoomSettings, vessels: Mapping[str, Vessel], waters: Waters) -> Array:
    """Return the line (S + 1, 2) [m] in which a boom hangs in its stream; ValueError for ends that no such boom has."""
    assert settings.stream is not None  # ties need it
    first, second = (_boom_end(end, settings, vessels, waters.level) for end in settings.ends)
    return line_in_stream(_boom(settings, waters), first, second, settings.stream)


def bulge_of(settings: BoomSettings, current: tuple[float, float]) -> Literal["left", "right"]:
    """Return the side to which a boom is laid, seen from its first end: as stated, or down the current between fixed ends.

    current: speed [m/s] and direction [rad].
    """
    first, second = settings.ends
    if settings.bulge is not None:
        return settings.bulge
    if isinstance(first, str) or isinstance(second, str):
        return "right"
    flow = horizontal(*current)
    to_left = (second[0] - first[0]) * flow[1] - (second[1] - first[1]) * flow[0]
    return "left" if to_left > 0.0 else "right"


def _require_slack(distance: float, length: float) -> None:
    """Raise ValueError for a boom of that length [m] that is straight between two fixed ends: T = q L^2 / (8 sag) has no bound."""
    longest = (1.0 - SLACK) * length
    if distance > longest:
        raise ValueError(
            f"the ends are {distance:g} m apart, allowed: at most {longest:.6g} m for a boom of {length:g} m, which needs"
            " slack to give way to the water"
        )


def _boom(settings: BoomSettings, waters: Waters) -> Boom:
    stated = {item.name: getattr(settings, item.name) for item in fields(BoomDesign) if hasattr(settings, item.name)}
    design = BoomDesign(**stated | {"segment_count": settings.segments, "water_density": waters.density})
    boom, spacing = design.boom(), waters.spacing
    return boom if spacing is None else boom.resolved_by(spacing)


def _boom_end(end: str | Point2, settings: BoomSettings, vessels: Mapping[str, Vessel], water_level: float) -> Point2:
    """Return the place [m] of an end of the boom: its point, or a tow line behind its vessel's tow point."""
    if not isinstance(end, str):
        return end
    vessel = vessels[end]
    x, y, _ = vessel.initial_tow_point(water_level)
    return (
        float(x) - settings.tow_line * math.cos(vessel.heading),
        float(y) - settings.tow_line * math.sin(vessel.heading),
    )

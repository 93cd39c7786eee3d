"""Layout of a boom: poses of its segments, the joints between them and the tow lines to the vessels.

A slack boom is laid out in the shape that steady towing gives it. If drag acts normal to the skirt only, 0.5 rho Cd d (V sin theta)^2 a
length, the tension T is the same everywhere and T d(theta)/ds = q d sin^2(theta). This is a catenary of parameter a = T / (q d), on
which tan(psi) = s / a, with psi the angle to the gap's direction and s the length from the apex.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from booms.boom import Boom
from booms.segments import BoomSegment, boom_segment
from coupling.solids.bodies import MassProperties, mass_properties
from oilsim.backend.arrays import Array

# [1] ln of the catenary's parameter, in lengths of the boom, among which that of a gap is sought; numerical; folded, and straight
NARROWEST, WIDEST = math.log(1e-6), math.log(1e6)
# [1] slope of a chain that hangs along the stream; numerical; its mean sine is 1 less 5e-9
STEEPEST = 1e4


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedBody:
    """A rigid body and its pose at the start: position (3,) [m] of the centre of mass, orientation (4,) xyzw."""

    name: str
    mesh: trimesh.Trimesh
    mass_properties: MassProperties
    position: Array
    orientation: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedJoint:
    """Two bodies that a joint holds together at a point (3,) [m] of the world, free to turn; body_b is None for a joint to the world.

    twisting_stiffness [N m/rad]: with which it resists that one rolls against the other.
    """

    name: str
    body_a: str
    body_b: str | None
    point: Array
    kind: str = "point"
    twisting_stiffness: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacedLine:
    """An elastic line from body_a to body_b (None: the world), fast at points (2, 3) [m] of the world; stiffness EA, breaking load [N].

    loose_length: of a line that is to be made fast later, its length [m] when it has been hauled in.
    """

    name: str
    body_a: str
    body_b: str | None
    points: Array
    stiffness: float
    breaking_load: float = math.inf
    loose_length: float | None = None

    @property
    def length(self) -> float:
        """Length [m] as laid, taut and without tension."""
        return (
            float(np.linalg.norm(self.points[1] - self.points[0])) if self.loose_length is None else self.loose_length
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class BoomLayout:
    """A boom as laid out: its segments from the first end to the second, and the points (2, 3) [m] for the tow lines."""

    boom: Boom
    segment: BoomSegment
    segments: tuple[PlacedBody, ...]
    joints: tuple[PlacedJoint, ...]
    end_points: Array

    @property
    def gap_ratio(self) -> float:
        """Distance between the ends / length of the boom [-], as laid out."""
        return float(np.linalg.norm(self.end_points[1] - self.end_points[0])) / self.boom.length


def catenary_chain(segment_count: int, gap_ratio: float) -> Array:
    """Compute the vertices (segment_count + 1, 2) [-] of a chain of length 1 with its ends at (-+ gap_ratio / 2, 0) and its apex at y < 0.

    Each link has the length 1 / segment_count and, at its middle, the slope tan(psi) = s / a of the catenary; a follows from the gap,
    sum cos(psi) / segment_count, which grows with a. A gap_ratio of 1 gives a straight chain. Raises ValueError for a gap ratio that
    is not above 0 and at most 1, or that is too narrow for an odd number of segments.
    """
    from scipy.optimize import brentq  # a third of a second, for those who need it

    if not 0.0 < gap_ratio <= 1.0 + 1e-9:
        raise ValueError(
            f"gap ratio {gap_ratio:g} is not allowed: it must be above 0 and at most 1, because the ends cannot be farther apart"
            " than the boom is long"
        )
    middle = (np.arange(segment_count) + 0.5) / segment_count - 0.5
    if gap_ratio >= 1.0 - 1e-9:
        angle = np.zeros(segment_count)
    else:

        def excess(exponent: float) -> float:
            return float(np.cos(np.arctan(middle / math.exp(exponent))).mean()) - gap_ratio

        if excess(NARROWEST) > 0.0:
            raise ValueError(
                f"gap ratio {gap_ratio:g} is too narrow for {segment_count} segment{'' if segment_count == 1 else 's'},"
                " allowed: an even number of segments, 2 or more"
            )
        angle = np.arctan(middle / math.exp(brentq(excess, NARROWEST, WIDEST)))
    links = np.stack([np.cos(angle), np.sin(angle)], axis=1) / segment_count
    chain = np.concatenate([np.zeros((1, 2)), np.cumsum(links, axis=0)])
    return chain - [0.5 * chain[-1, 0], 0.0]


def lay_between(
    boom: Boom,
    start: tuple[float, float],
    end: tuple[float, float],
    *,
    water_level: float,
    name: str = "boom",
    bulge: Literal["right", "left"] = "right",
) -> BoomLayout:
    """Lay a boom from `start` to `end` (x, y) [m]: straight if they are its length apart, else slack, it bulges to one side.

    Right and left are those of someone who looks from start to end. Raises ValueError if the ends coincide, are farther apart than the
    boom is long, or so near that neighbours turn beyond `Boom.maximum_turn`.
    """
    begin, along = np.array(start), np.array(end) - np.array(start)
    distance = float(np.linalg.norm(along))
    if not 0.0 < distance <= boom.length * (1.0 + 1e-9):
        raise ValueError(
            f"the ends of boom {name!r} are {distance:g} m apart, allowed: above 0 m and at most its length, {boom.length:g} m"
        )
    along = along / distance
    left = np.array([-along[1], along[0]]) * (1.0 if bulge == "right" else -1.0)
    chain = boom.length * catenary_chain(boom.segment_count, distance / boom.length)
    middle = begin + 0.5 * distance * along
    return lay_along(boom, middle + chain[:, :1] * along + chain[:, 1:] * left, water_level=water_level, name=name)


@lru_cache(maxsize=64)  # a check and a run, and runs of a sweep, lay the same boom
def stream_chain(segment_count: int, across: float, along: float) -> Array:
    """Compute the vertices (segment_count + 1, 2) [-] of a chain of length 1 in a stream along +y, from the origin to (across, along).

    It is the catenary of the module's equation, with its axis along the stream and ends at different heights: tan(psi) = (s - s0) / a.
    s0 follows from the way along the stream, mean sin(psi) = -along, for each a, and a from the way across it, mean cos(psi) = across,
    which grows with a. Raises ValueError for ends that lie in line with the stream, or too far apart.
    """
    from scipy.optimize import brentq  # a third of a second, for those who need it

    if not across > 1e-3:
        share = round(100.0 * across, 1) + 0.0  # without the sign of a zero
        raise ValueError(
            f"its ends lie {share:g} % of its length apart across the stream, from left to right, allowed: above 0.1 %;"
            " no boom hangs between ends that lie in line with the stream"
        )
    if math.hypot(across, along) > 1.0 - 1e-6:
        apart = 100.0 * math.hypot(across, along)
        raise ValueError(f"its ends lie {apart:.4g} % of its length apart, allowed: less than its length, in a stream")
    middle = (np.arange(segment_count) + 0.5) / segment_count

    def excess(exponent: float) -> float:
        return float(np.cos(_hanging(middle, math.exp(exponent), along)).mean()) - across

    if excess(NARROWEST) > 0.0:
        raise ValueError(
            f"{segment_count} segments cannot hang between these ends, allowed: more segments, or wider ends"
        )
    angle = _hanging(middle, math.exp(brentq(excess, NARROWEST, WIDEST)), along)
    links = np.stack([np.cos(angle), -np.sin(angle)], axis=1) / segment_count
    chain = np.concatenate([np.zeros((1, 2)), np.cumsum(links, axis=0)])
    chain.flags.writeable = False  # all callers have the same one
    return chain


def _hanging(middle: Array, parameter: float, along: float) -> Array:
    """Return the slopes psi (S,) [rad] at places `middle` (S,) [-] of a catenary of that parameter whose mean sin(psi) is -along."""
    from scipy.optimize import brentq  # a third of a second, for those who need it

    # in units of the parameter, which is small where links are steep
    slope, far = middle / parameter, STEEPEST + 1.0 / parameter
    apex = brentq(lambda place: float(np.sin(np.arctan(slope - place)).mean()) + along, -far, far)
    return np.asarray(np.arctan(slope - apex))


def line_in_stream(boom: Boom, start: tuple[float, float], end: tuple[float, float], stream: float) -> Array:
    """Return the joints (segment_count + 1, 2) [m] of a boom that hangs from `start` to `end` [m] in a stream to `stream` [rad].

    Raises ValueError for ends that no such boom has (see `stream_chain`).
    """
    down = np.array([math.cos(stream), math.sin(stream)])
    way = (np.array(end) - np.array(start)) / boom.length
    along = float(way @ down)
    aside = way - along * down
    across = float(np.linalg.norm(aside))
    chain = boom.length * stream_chain(boom.segment_count, across, along)
    return np.asarray(np.array(start) + chain[:, :1] * (aside / max(across, 1e-12)) + chain[:, 1:] * down)


def lay_in_stream(
    boom: Boom,
    start: tuple[float, float],
    end: tuple[float, float],
    stream: float,
    *,
    water_level: float,
    name: str = "boom",
) -> BoomLayout:
    """Lay a boom from `start` to `end` (x, y) [m] in the shape that it takes in a stream to the direction `stream` [rad].

    Raises ValueError for ends that no such boom has (see `stream_chain`), or so near that neighbours turn beyond `Boom.maximum_turn`.
    """
    return lay_along(boom, line_in_stream(boom, start, end, stream), water_level=water_level, name=name)


def lay_aground(layout: BoomLayout, ground: Callable[[Array], Array], water_level: float) -> BoomLayout:
    """Return a boom as laid afloat, with its skirt on the ground wherever that lies higher than the skirt's foot.

    ground: returns heights (N,) [m] at places (N, 2) [m]; water_level [m]. Segments follow the slope along the boom.
    """
    boom = layout.boom
    points = np.array([layout.end_points[0], *(joint.point for joint in layout.joints), layout.end_points[1]])
    lift = np.maximum(ground(points[:, :2]) + boom.skirt_depth - water_level, 0.0)
    if not lift.any():
        return layout
    points[:, 2] += lift
    pitch = np.arctan2(np.diff(lift), boom.segment_length)
    segments = tuple(
        replace(
            one,
            position=one.position + np.array([0.0, 0.0, 0.5 * (lift[k] + lift[k + 1])]),
            orientation=(Rotation.from_quat(one.orientation) * Rotation.from_euler("y", -pitch[k])).as_quat(),
        )
        for k, one in enumerate(layout.segments)
    )
    joints = tuple(replace(joint, point=point) for joint, point in zip(layout.joints, points[1:-1], strict=True))
    return replace(layout, segments=segments, joints=joints, end_points=points[[0, -1]])


def tow_line(
    name: str,
    vessel: str,
    vessel_point: Array,
    boom_end: str,
    boom_point: Array,
    *,
    mass_per_meter: float,
    diameter: float,
) -> tuple[tuple[PlacedBody, ...], tuple[PlacedJoint, ...]]:
    """Build a taut tow line: a thin rigid link with a joint at either end. Return its bodies and joints.

    vessel_point, boom_point (3,) [m] in the world; mass_per_meter [kg/m]; diameter [m]. If the points coincide, one joint fastens the boom
    to the vessel. Unlike a rope, a rigid link can also push: while the vessel slows down, the reported tension may be a thrust.
    """
    span = np.asarray(boom_point, dtype=np.float64) - vessel_point
    length = float(np.linalg.norm(span))
    if length < 1e-6:
        return (), (PlacedJoint(name=name, body_a=vessel, body_b=boom_end, point=np.array(vessel_point)),)
    mesh = trimesh.creation.cylinder(radius=0.5 * diameter, height=length, sections=8)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.5 * math.pi, (0, 1, 0)))
    body = PlacedBody(
        name=f"{name}/line",
        mesh=mesh,
        mass_properties=mass_properties(mesh, mass=mass_per_meter * length),
        position=vessel_point + 0.5 * span,
        orientation=_along(span / length),
    )
    joints = (
        PlacedJoint(name=f"{name}/vessel", body_a=vessel, body_b=body.name, point=np.array(vessel_point)),
        PlacedJoint(name=f"{name}/boom", body_a=body.name, body_b=boom_end, point=np.array(boom_point)),
    )
    return (body,), joints


def lay_along(boom: Boom, line: Array, *, water_level: float, name: str = "boom") -> BoomLayout:
    """Lay a boom along a line of joints (segment_count + 1, 2) [m]; ValueError where neighbours turn beyond `Boom.maximum_turn`."""
    segment = boom_segment(boom)
    links = np.diff(line, axis=0)
    half = 0.5 * np.arctan2(links[:, 1], links[:, 0])
    centers = 0.5 * (line[1:] + line[:-1])
    _check_turns(boom, 2.0 * half)
    names = [f"{name}/segment-{k:02d}" for k in range(boom.segment_count)]
    points = np.column_stack([line, np.full(len(line), water_level + boom.height_of_joints)])
    bodies = tuple(
        PlacedBody(
            name=names[k],
            mesh=segment.mesh,
            mass_properties=segment.mass_properties,
            position=np.array([*centers[k], water_level - segment.waterline]),
            orientation=np.array([0.0, 0.0, math.sin(half[k]), math.cos(half[k])]),
        )
        for k in range(boom.segment_count)
    )
    joints = tuple(
        PlacedJoint(
            name=f"{name}/joint-{k:02d}",
            body_a=names[k - 1],
            body_b=names[k],
            point=points[k],
            twisting_stiffness=boom.twisting_stiffness,
        )
        for k in range(1, boom.segment_count)
    )
    return BoomLayout(boom=boom, segment=segment, segments=bodies, joints=joints, end_points=points[[0, -1]])


def _check_turns(boom: Boom, angle: Array) -> None:
    """Raise ValueError for a layout whose neighbours turn so far that their ends would overlap."""
    turn = np.abs(np.arctan2(np.sin(np.diff(angle)), np.cos(np.diff(angle))))
    if turn.size and float(turn.max()) > boom.maximum_turn:
        raise ValueError(
            f"the boom's segments turn by {math.degrees(float(turn.max())):.1f} degrees at the apex, allowed: at most"
            f" {math.degrees(boom.maximum_turn):.1f} degrees (maximum_turn); take more segments or a wider gap"
        )


def _along(direction: Array) -> Array:
    """Compute the quaternion xyzw that turns +x to a unit vector (3,) by the shortest way."""
    x, y, z = (float(component) for component in direction)
    if x < -1.0 + 1e-12:
        return np.array([0.0, 0.0, 1.0, 0.0])
    quaternion = np.array([0.0, -z, y, 1.0 + x])
    return quaternion / np.linalg.norm(quaternion)

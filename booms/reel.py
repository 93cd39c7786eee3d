"""A reel, unrolled: the wound part of a boom lies straight behind the reel's mouth and runs out along its line (*modelled*).

A drum of radius r with a boom of mass m wound on it at that radius turns with the inertia m r^2. So it resists a boom that is drawn off
as the mass m does that lies straight behind the mouth and slides without friction. The tension is the same in both, and that of the line
which holds the boom's inner end is the brake's. So the wound part is laid out straight, at the height at which the boom floats. It feels
neither sea nor weight. It moves along the line only: across the line and against turning it has an inertia HEAVY times its own, and a
spring and a damper of the rate RATE take it back to the line. A segment is wound while its middle is behind the mouth, so the place where
the boom bends is right to half a segment. Left out: the drum's own inertia and friction, the height of the quay, and layers, with which
the radius grows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from booms.deployment import BoomLayout
from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.core.physical_constants import GRAVITY
from oilsim.loads.load_model import LoadModel
from oilsim.loads.morison import BodyLoads, FloatingBodies
from oilsim.sea import Sea

# [1] inertia across the line over a segment's own; numerical; the pull of a boom across the mouth moves the wound part by millimetres
HEAVY = 1e3
# [1/s] at which the wound part returns to its line, critically damped; numerical; far below 2 over a sub-step
RATE = 4.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Track:
    """The line on which a boom is wound: rows of its segments among the loaded bodies, mass [kg] and length [m] of a segment.

    mouth (3,) [m] at the height of a segment's centre of mass; outward (3,) unit vector; orientation (4,) xyzw of a segment on the line.
    """

    rows: Ints
    mass: float
    length: float
    mouth: Array
    outward: Array
    orientation: Array

    def is_wound(self, position: Array) -> Flags:
        """Tell which segments are wound, the first ones until one is off the reel; position (S, 3) [m] of their centres of mass."""
        return np.asarray(np.logical_and.accumulate((position - self.mouth) @ self.outward < 0.0))


def track_of(layout: BoomLayout, mouth: tuple[float, float], first_row: int) -> Track:
    """Return the line of a boom that was laid straight through its reel's `mouth` [m]; first_row: of its segments among the bodies."""
    inner, outer = layout.segments[0], layout.segments[-1]
    way = layout.end_points[1] - layout.end_points[0]
    return Track(
        rows=first_row + np.arange(len(layout.segments)),
        mass=layout.segment.mass_properties.mass,
        length=layout.boom.segment_length,
        mouth=np.array([*mouth, outer.position[2]]),
        outward=way / np.linalg.norm(way),
        orientation=np.array(inner.orientation),
    )


class ReeledBodies(FloatingBodies):
    """Bodies afloat of which some are segments of booms on reels: a wound one feels its line in the place of the sea."""

    def __init__(self, models: Sequence[LoadModel], sea: Sea, tracks: Sequence[Track]) -> None:
        super().__init__(models, sea)
        self._tracks = tuple(tracks)

    def loads(self, time: float, pose: Array, twist: Array) -> BodyLoads:
        """Return the loads as of `FloatingBodies.loads`, those of wound segments by their line.

        time [s]; pose (B, 7) [m, 1] with quaternions xyzw, twist (B, 6) [m/s, rad/s].
        """
        found = super().loads(time, pose, twist)
        for track in self._tracks:
            wound = track.rows[track.is_wound(pose[track.rows, :3])]
            if len(wound):
                _hold_on_line(track, wound, pose, twist, found)
        return found


def _hold_on_line(track: Track, rows: Ints, pose: Array, twist: Array, found: BodyLoads) -> None:
    """Replace the loads of wound segments in `rows` (n,); pose (B, 7), twist (B, 6) of all bodies."""
    across = np.eye(3) - np.outer(track.outward, track.outward)
    inertia = np.zeros((6, 6))
    inertia[:3, :3] = HEAVY * track.mass * across
    inertia[3:, 3:] = HEAVY * track.mass * track.length**2 * np.eye(3)
    away = np.concatenate([pose[rows, :3] - track.mouth, _turned_from(track.orientation, pose[rows, 3:])], axis=1)
    found.wrench[rows] = -(RATE**2 * away + 2.0 * RATE * twist[rows]) @ inertia
    found.wrench[rows, 2] += track.mass * GRAVITY
    found.added_mass[rows] = inertia
    found.damping[rows] = 2.0 * RATE * inertia
    found.wetted_volume[rows] = 0.0


def _turned_from(rest: Array, orientation: Array) -> Array:
    """Return the turns (n, 3) [rad] that lead from `rest` (4,) to orientations (n, 4) xyzw, 2 sin(angle / 2) about their axes."""
    vector, w = orientation[:, :3], orientation[:, 3:]
    own, rest_w = rest[:3], rest[3]
    sign = np.where(vector @ own + w[:, 0] * rest_w < 0.0, -2.0, 2.0)
    return np.asarray(sign[:, None] * (rest_w * vector - w * own - np.cross(vector, own)))

"""Booms and hulls of rigid bodies, seen in plan: the barriers that a slick meets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oilsim.boundaries.walls import rotation_matrix

Array = npt.NDArray[np.float64]
Point = tuple[float, float, float]


def _carried(pose: Array, twist: Array, points: Array, ahead: float) -> Array:
    """Points (N, 3) [m] of a body's frame, in the world, after `ahead` [s] with the velocity that they have now."""
    arms = points @ rotation_matrix(pose[3:]).T
    return np.asarray(pose[:3] + arms + ahead * (twist[:3] + np.cross(twist[3:], arms)))


@dataclass(frozen=True, kw_only=True)
class BoomBodies:
    """The bodies of a boom's S segments in order, from end to end.

    name         of the slick's boom
    bodies       names of the bodies
    start, end   joints of every segment in its body frame [m]; neighbours meet halfway between theirs
    foot         lowest point of the skirt in the body frame [m]
    """

    name: str
    bodies: Sequence[str]
    start: Point
    end: Point
    foot: Point

    def nodes(self, poses: Mapping[str, Array], twists: Mapping[str, Array], ahead: float) -> Array:
        """Return the nodes (S + 1, 2) [m] after `ahead` [s]; poses (7,) [m, 1] and twists (6,) [m/s, rad/s] by body."""
        joints = np.array([self.start, self.end])
        ends = np.stack([_carried(poses[body], twists[body], joints, ahead)[:, :2] for body in self.bodies])
        inner = 0.5 * (ends[:-1, 1] + ends[1:, 0])
        return np.concatenate([ends[:1, 0], inner, ends[-1:, 1]])

    def draft(self, poses: Mapping[str, Array], level: float) -> Array:
        """Return the depth of each foot (S,) [m] below a surface at `level` [m], 0 above it; poses (7,) [m, 1] by body."""
        feet = [_carried(poses[body], np.zeros(6), np.array([self.foot]), 0.0)[0, 2] for body in self.bodies]
        return np.maximum(level - np.array(feet), 0.0)


@dataclass(frozen=True, kw_only=True)
class HullBody:
    """A body whose outline oil sticks to.

    name     of the slick's outline
    body     name of the body
    nodes    (N, 3) [m] the outline at the waterline, in the body frame
    """

    name: str
    body: str
    nodes: Sequence[Point]

    def outline(self, poses: Mapping[str, Array], twists: Mapping[str, Array], ahead: float) -> Array:
        """Return the outline (N, 2) [m] after `ahead` [s]; poses (7,) [m, 1] and twists (6,) [m/s, rad/s] by body."""
        return _carried(poses[self.body], twists[self.body], np.asarray(self.nodes, np.float64), ahead)[:, :2]

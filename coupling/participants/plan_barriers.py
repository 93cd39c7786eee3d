"""Booms and hulls of rigid bodies, seen in plan: the barriers that a slick meets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from oilsim.boundaries.walls import rotation_matrix

Array = npt.NDArray[np.float64]
Point = tuple[float, float, float]


def _placed(pose: Array, points: Sequence[Point]) -> Array:
    """Points (N, 3) [m] of a body's frame, in the world."""
    return np.asarray(pose[:3] + np.asarray(points, np.float64) @ rotation_matrix(pose[3:]).T)


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

    def nodes(self, poses: Mapping[str, Array]) -> Array:
        """Return the nodes (S + 1, 2) [m]; poses (7,) [m, 1] by body."""
        ends = np.stack([_placed(poses[body], (self.start, self.end))[:, :2] for body in self.bodies])
        inner = 0.5 * (ends[:-1, 1] + ends[1:, 0])
        return np.concatenate([ends[:1, 0], inner, ends[-1:, 1]])

    def draft(self, poses: Mapping[str, Array], level: float) -> Array:
        """Return the depth of each foot (S,) [m] below a surface at `level` [m], 0 above it; poses (7,) [m, 1] by body."""
        feet = [_placed(poses[body], (self.foot,))[0, 2] for body in self.bodies]
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

    def outline(self, poses: Mapping[str, Array]) -> Array:
        """Return the outline (N, 2) [m]; poses (7,) [m, 1] by body."""
        return _placed(poses[self.body], self.nodes)[:, :2]

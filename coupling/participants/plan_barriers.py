"""Booms of rigid bodies, and a shore, seen in plan: the barriers that a slick meets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from oilsim.backend.arrays import Array, Flags
from oilsim.loads.body_axes import rotation_matrices
from oilsim.slick.barriers import SHORTEST

Point = tuple[float, float, float]

# [m] sides into which a waterline is divided, each with its own room for oil; numerical
SIDE = 5.0


def _placed(poses: Array, points: Sequence[Point]) -> Array:
    """Return points (K, 3) [m] of the frames of B bodies in the world, (B, K, 3); poses (B, 7) [m, 1]."""
    turned = np.einsum("bij,kj->bki", rotation_matrices(poses[:, 3:]), np.asarray(points, np.float64))
    return np.asarray(poses[:, None, :3] + turned)


@dataclass(frozen=True, kw_only=True)
class ReelMouth:
    """The mouth of a reel on which the first segments of a boom are wound, straight behind it.

    place (x, y) [m]; outward (x, y) [-] unit vector along which the boom runs out.
    """

    place: tuple[float, float]
    outward: tuple[float, float]

    def without_wound(self, nodes: Array) -> Array:
        """Return a boom's nodes (N, 2) [m], the first ones, which are behind the mouth, drawn together there: no oil meets them."""
        out = (nodes - np.array(self.place)) @ np.array(self.outward)
        wound = np.logical_and.accumulate(out < SHORTEST)
        return np.where(wound[:, None], np.array(self.place), nodes)


@dataclass(frozen=True, kw_only=True)
class BoomBodies:
    """The bodies of a boom's S segments in order, from end to end.

    name         of the slick's boom
    bodies       names of the bodies
    start, end   joints of every segment in its body frame [m]; neighbours meet halfway between theirs, unless the joint has parted
    foot, top    lowest point of the skirt and highest of the float in the body frame [m]; z points up from foot to top
    seals        whether its foot seals where it lies on the ground, as tubes full of water do (*modelled*)
    mouth        of the reel from which it runs out; None without one
    """

    name: str
    bodies: Sequence[str]
    start: Point
    end: Point
    foot: Point
    top: Point
    seals: bool = False
    mouth: ReelMouth | None = None

    def nodes(self, poses: Array, parted: Flags) -> Array:
        """Return the nodes (N, 2) [m], as many as segments, one, and one more for each joint that has parted.

        poses (S, 7) [m, 1] of the bodies; parted (S,) whether the joint at a segment's end has parted.
        """
        ends = _placed(poses, (self.start, self.end))[:, :, :2]
        middle = 0.5 * (ends[:-1, 1] + ends[1:, 0])
        whole = ~parted[:-1]
        ends[:-1, 1][whole], ends[1:, 0][whole] = middle[whole], middle[whole]
        own = np.append(True, parted[:-1])  # whether a segment's start is a node of its own
        nodes = ends[np.stack([own, np.ones_like(own)], axis=1)]
        return nodes if self.mouth is None else self.mouth.without_wound(nodes)

    def feet_and_tops(self, poses: Array) -> tuple[Array, Array]:
        """Return the feet and the tops (S, 3) [m] of the segments; poses (S, 7) [m, 1] of the bodies."""
        placed = _placed(poses, (self.foot, self.top))
        return placed[:, 0], placed[:, 1]

    def lean(self, poses: Array) -> Array:
        """Return the angle (S,) [rad] between the bodies' z axes and the vertical; poses (S, 7) [m, 1] of the bodies."""
        upward = rotation_matrices(poses[:, 3:])[:, 2, 2]
        return np.asarray(np.arccos(np.clip(upward, -1.0, 1.0)))


@dataclass(frozen=True, kw_only=True)
class Beach:
    """A straight shore of one slope.

    waterline  (x, y, z) [m] a point of the waterline at the start; seaward [rad] out to sea; slope [-] rise over run
    width      [m] half of it to each side; capacity [m3/m] of oil at the waterline
    """

    waterline: Point
    seaward: float
    slope: float
    width: float
    capacity: float
    name: str = "shore"

    @property
    def out(self) -> Array:
        """The unit vector (2,) out to sea."""
        return np.array([np.cos(self.seaward), np.sin(self.seaward)])

    @property
    def normal(self) -> Point:
        """The unit normal of the ground, upwards."""
        x, y = self.slope * self.out
        length = float(np.sqrt(1.0 + self.slope**2))
        return float(x) / length, float(y) / length, 1.0 / length

    def height(self, points_xy: Array) -> Array:
        """Return the height of the ground (N,) [m] at places (N, 2) [m]."""
        return np.asarray(self.waterline[2] - self.slope * ((points_xy - self.waterline[:2]) @ self.out))

    def outline(self, rise: float) -> Array:
        """Return the outline (N, 2) [m] of the dry land, when the water stands `rise` [m] above its level at the start."""
        count = max(1, round(self.width / SIDE))
        along = np.linspace(-0.5, 0.5, count + 1) * self.width
        edge = (
            np.array(self.waterline[:2])
            - (rise / self.slope) * self.out
            + along[:, None] * np.array([-self.out[1], self.out[0]])
        )
        return np.concatenate([edge, edge[[-1, 0]] - (self.width + abs(rise) / self.slope) * self.out])

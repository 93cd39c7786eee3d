"""Position and motion of a boom: its line in plan, the lean of its segments, and the flow of water across them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.backend.jit import njit

_NEAR = 0.1  # [1] periods around a boom within which the nearest of a point's images is found


@dataclass(frozen=True, kw_only=True, eq=False)
class BoomState:
    """Position and motion of a boom of S segments, from the first end to the second.

    position (S, 3) of the centres of mass [m], orientation (S, 4) xyzw, velocity (S, 3) [m/s]; joint_points (2, 3):
    ends of a segment in its body frame [m]; waterline [m]: of the design waterplane above the centre of mass;
    flow_share (S,) or scalar [-]: share of the water's speed that meets each segment, below 1 in a pocket.
    """

    position: Array
    orientation: Array
    velocity: Array
    joint_points: Array
    waterline: float
    flow_share: Array | float = 1.0

    def part(self, chosen: Flags) -> BoomState:
        """Return the part of the boom that the chosen segments (S,) are, which lie one behind the other."""
        share = np.broadcast_to(self.flow_share, chosen.shape)[chosen]
        bodies = {name: getattr(self, name)[chosen] for name in ("position", "orientation", "velocity")}
        return replace(self, **bodies, flow_share=share)

    def line(self) -> Array:
        """Return the boom's line in plan, (S + 1, 2) [m]: its ends and its joints, each the mean of the two that meet there."""
        return self._line

    @cached_property
    def _line(self) -> Array:
        first, last = (_rotate(self.orientation, point) + self.position for point in self.joint_points)
        inner = 0.5 * (last[:-1] + first[1:])
        return np.concatenate([first[:1], inner, last[-1:]])[:, :2]

    def normal(self) -> Array:
        """Return the horizontal unit normals (S, 2) of the segments, to the right of their direction: out of the U."""
        return self._normal

    @cached_property
    def _normal(self) -> Array:
        along = np.diff(self.line(), axis=0)
        along /= np.linalg.norm(along, axis=1)[:, None]
        return np.stack([along[:, 1], -along[:, 0]], axis=1)

    def normal_flow(self, current: Array) -> Array:
        """Return the velocity (S,) [m/s] of each segment through the water along its normal: (v - current) . n; current (2,)."""
        relative = self.velocity[:, :2] - np.asarray(current)[:2]
        return np.asarray(self.flow_share * (relative * self.normal()).sum(axis=1))

    def normal_speed(self, current: Array) -> Array:
        """Return the speed (S,) [m/s] at which water meets each segment along its normal, now."""
        return np.abs(self.normal_flow(current))

    def skirt_angle(self) -> Array:
        """Return the lean (S,) [rad] of the skirt from the vertical: angle between the body's z axis and the world's."""
        x, y = self.orientation[:, 0], self.orientation[:, 1]
        return np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))

    def heights(self, freeboard: float, skirt_depth: float) -> tuple[Array, Array]:
        """Return the heights (S,) [m] in the world of the top of the float and of the skirt's foot, at the segments' middles."""
        up = np.cos(self.skirt_angle())
        return (
            self.position[:, 2] + up * (self.waterline + freeboard),
            self.position[:, 2] + up * (self.waterline - skirt_depth),
        )

    @property
    def gap_ratio(self) -> float:
        """Distance of the ends / length of the boom."""
        line = self.line()
        length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
        return float(np.linalg.norm(line[-1] - line[0]) / length)


def beside(points: Array, line: Array, period: tuple[float, float]) -> Array:
    """Return points (N, 3) [m] of a sea that repeats, moved by whole periods to where they lie deepest in a boom, or nearest to it.

    line (K, 2) [m] is closed across the gap; period [m] along x and y, 0 along an axis on which the sea does not repeat. A boom sails on
    beyond the length of the sea, while the liquid enters it again at the opposite side.
    """
    (low, high), images = (line.min(axis=0), line.max(axis=0)), [np.zeros(2)]
    moved = nearest_image(points, 0.5 * (low + high), period)
    for axis, length in enumerate(period):
        if length > 0.0:
            most = math.ceil(0.5 * (high[axis] - low[axis]) / length + 0.5 + _NEAR) - 1
            steps = [length * step * np.eye(2)[axis] for step in range(-most, most + 1)]
            images = [image + step for image in images for step in steps]
    if len(images) == 1:
        return moved
    depths = np.array([signed_distance(moved[:, :2] + image, line)[0] for image in images])
    moved[:, :2] += np.array(images)[depths.argmax(axis=0)]
    return moved


def nearest_image(points: NDArray[Any], place: Array, period: tuple[float, float]) -> NDArray[Any]:
    """Return points (N, 2 or 3) [m] of a sea that repeats, moved by whole periods to where they lie nearest to a place in plan [m].

    period [m] along x and y, 0 along an axis on which the sea does not repeat. In a sea without periods they are the points themselves.
    """
    moved = np.array(points, dtype=np.float64) if any(period) else points
    for axis, length in enumerate(period):
        if length > 0.0:
            moved[:, axis] -= length * np.round((moved[:, axis] - place[axis]) / length)
    return moved


def signed_distance(points: Array, line: Array) -> tuple[Array, Ints]:
    """Return the distance (N,) [m] of points (N, 2) to the closed polygon of `line` (K, 2), positive inside, and the nearest edge (N,).

    Edge k runs from vertex k to k + 1; the last, K - 1, closes the polygon across the gap. Inside by the crossing
    number. Where two edges are at the same distance (a corner), the later one is taken, so that ends belong to the gap.
    """
    distance = np.empty(len(points))
    edge = np.empty(len(points), dtype=np.int64)
    _signed_distance(np.ascontiguousarray(points), np.ascontiguousarray(line), distance, edge)
    return distance, edge


@njit(nogil=True, cache=True, fastmath=True, error_model="numpy")
def _signed_distance(points: Array, line: Array, distance: Array, edge: Ints) -> None:
    """Fill distance (N,) and edge (N,); see `signed_distance`."""
    count = len(line)
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        nearest, which, inside = 1e300, 0, False
        for k in range(count):
            ax, ay = line[k, 0], line[k, 1]
            bx, by = line[(k + 1) % count, 0], line[(k + 1) % count, 1]
            dx, dy = bx - ax, by - ay
            t = ((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, 1e-30)
            t = min(max(t, 0.0), 1.0)
            gap_x, gap_y = x - ax - t * dx, y - ay - t * dy
            squared = gap_x * gap_x + gap_y * gap_y
            if squared <= nearest * (1.0 + 1e-9):
                nearest, which = min(squared, nearest), k
            if (ay > y) != (by > y) and x < ax + (y - ay) * dx / dy:
                inside = not inside
        distance[i] = math.sqrt(nearest) if inside else -math.sqrt(nearest)
        edge[i] = which


@njit(nogil=True, cache=True, error_model="numpy")
def _rotate(orientation: Array, vector: Array) -> Array:
    """Turn a body vector (3,) into the world for orientations (S, 4): v + 2 q x (q x v + w v)."""
    turned = np.empty((len(orientation), 3))
    v_x, v_y, v_z = vector
    for n in range(len(orientation)):
        x, y, z, w = orientation[n]
        a = y * v_z - z * v_y + w * v_x
        b = z * v_x - x * v_z + w * v_y
        c = x * v_y - y * v_x + w * v_z
        turned[n, 0] = v_x + 2.0 * (y * c - z * b)
        turned[n, 1] = v_y + 2.0 * (z * a - x * c)
        turned[n, 2] = v_z + 2.0 * (x * b - y * a)
    return turned

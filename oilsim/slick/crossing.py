"""The exact test whether a parcel's way crosses a segment that moves at the same time.

The parcel goes from p_0 to p_1 and the segment's ends from a_0 to a_1 and from b_0 to b_1, all on straight lines at constant speed. The
parcel is on the segment's line when (b - a) x (p - a) = 0, a quadratic equation in time. The first root at which it lies
between the ends is the crossing. The sign of the product at both ends of the step decides by itself whether an odd number of
crossings must exist, so rounding cannot lose one, and a small tolerance at the ends makes neighbours overlap at their joint.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array, Ints
from oilsim.backend.jit import EXACT, exactly_inlined
from oilsim.slick.barriers import MARGIN, NEAR, STANDOFF, Barriers

Rows = Ints

# [1] share of a segment's length by which it is longer to the test; numerical; above rounding at 10 km from the origin
OVERLAP = 1e-9
# [segments] that share a box for a first, coarse test; numerical; tests of 64 segments take a quarter of the time
GROUP = 8


class Crossings(NamedTuple):
    """First crossings of N ways.

    segment (N,) the segment that was met, -1 for none; time (N,) [-] share of the step; along (N,) [-] share of the segment;
    side (N,) from which it was met, 1 left, -1 right.
    """

    segment: Rows
    time: Array
    along: Array
    side: Rows


class Sweep(NamedTuple):
    """Moving segments: ends (S, 4, 2) [m] as old start, old end, new start, new end; their boxes (S, 4) and those of groups (G, 4) [m]."""

    ends: Array
    boxes: Array
    groups: Array


def moving_sweep(barriers: Barriers) -> Sweep:
    """Return the segments on their way from their old to their new places."""
    return _sweep(np.stack([barriers.old_start, barriers.old_end, barriers.start, barriers.end], axis=1))


def resting_sweep(barriers: Barriers, chosen: Rows | slice = slice(None)) -> Sweep:
    """Return all segments, or chosen rows (M,) of them, at rest at their new places."""
    start, end = barriers.start[chosen], barriers.end[chosen]
    return _sweep(np.stack([start, end, start, end], axis=1))


def opening_sweep(barriers: Barriers) -> Sweep:
    """Return the openings of parted booms on their way, one by each segment that `parted` marks: from its end to the next one's start."""
    one = np.flatnonzero(barriers.parted)
    other = one + 1
    return _sweep(
        np.stack([barriers.old_end[one], barriers.old_start[other], barriers.end[one], barriers.start[other]], axis=1)
    )


def _sweep(ends: Array) -> Sweep:
    low, high = ends.min(axis=1), ends.max(axis=1)
    slack = OVERLAP * (1.0 + np.abs(ends).max(initial=0.0))
    boxes = np.concatenate([low - slack, high + slack], axis=1)
    first = np.arange(0, len(boxes), GROUP)
    if not len(boxes):
        return Sweep(ends, boxes, np.empty((0, 4)))
    lowest, highest = np.minimum.reduceat(boxes[:, :2], first), np.maximum.reduceat(boxes[:, 2:], first)
    return Sweep(np.ascontiguousarray(ends), boxes, np.concatenate([lowest, highest], axis=1))


@exactly_inlined
def cross(ax, ay, bx, by):
    """Return the cross product of two vectors in the plane."""
    return ax * by - ay * bx


@exactly_inlined
def meets(px, py, qx, qy, ends, s, time):
    """Return the share [-] of segment s at which a way from p to q is at `time`, and whether that lies on it; ends (S, 4, 2) [m]."""
    ax = ends[s, 0, 0] + time * (ends[s, 2, 0] - ends[s, 0, 0])
    ay = ends[s, 0, 1] + time * (ends[s, 2, 1] - ends[s, 0, 1])
    ex = ends[s, 1, 0] + time * (ends[s, 3, 0] - ends[s, 1, 0]) - ax
    ey = ends[s, 1, 1] + time * (ends[s, 3, 1] - ends[s, 1, 1]) - ay
    rx, ry = px + time * (qx - px) - ax, py + time * (qy - py) - ay
    along = (rx * ex + ry * ey) / (ex * ex + ey * ey)
    return along, -OVERLAP <= along <= 1.0 + OVERLAP


@exactly_inlined
def crossing(px, py, qx, qy, ends, s):
    """Return time [-], share [-] and side of the first crossing of segment s by a way from p to q; time 2 for none; ends (S, 4, 2) [m]."""
    e0x, e0y = ends[s, 1, 0] - ends[s, 0, 0], ends[s, 1, 1] - ends[s, 0, 1]
    e1x, e1y = ends[s, 3, 0] - ends[s, 2, 0], ends[s, 3, 1] - ends[s, 2, 1]
    r0x, r0y = px - ends[s, 0, 0], py - ends[s, 0, 1]
    r1x, r1y = qx - ends[s, 2, 0], qy - ends[s, 2, 1]
    first, last = cross(e0x, e0y, r0x, r0y), cross(e1x, e1y, r1x, r1y)
    side = 1 if first > 0.0 else -1
    must = first * last <= 0.0 and first != 0.0
    curve = cross(e1x - e0x, e1y - e0y, r1x - r0x, r1y - r0y)
    if first * last > 0.0 and curve * first <= 0.0:
        return 2.0, 0.0, side  # the product keeps its sign: it does not bend towards 0
    slope = last - first - curve
    inside = slope * slope - 4.0 * curve * first
    if first == 0.0 or (inside < 0.0 and not must):
        return 2.0, 0.0, side
    root = math.sqrt(max(inside, 0.0))
    half = -0.5 * (slope + (root if slope >= 0.0 else -root))
    one = first / half if half != 0.0 else 2.0
    two = half / curve if curve != 0.0 else 2.0
    for time in (min(one, two), max(one, two)):
        if 0.0 < time <= 1.0:
            along, on = meets(px, py, qx, qy, ends, s, time)
            if on:
                return time, along, side
            must = False
    if must:  # rounding has moved the root past the end of the step
        along, on = meets(px, py, qx, qy, ends, s, 1.0)
        if on:
            return 1.0, along, side
    return 2.0, 0.0, side


@exactly_inlined
def apart(low_x, low_y, high_x, high_y, boxes, b):
    """Return whether a box lies outside of box b of boxes (B, 4) [m]."""
    return high_x < boxes[b, 0] or low_x > boxes[b, 2] or high_y < boxes[b, 1] or low_y > boxes[b, 3]


@exactly_inlined
def first_crossing(px, py, qx, qy, sweep):
    """Return segment, time [-], share [-] and side of the first crossing of a way from p to q [m]; segment -1 and time 2 for none."""
    low_x, low_y, high_x, high_y = min(px, qx), min(py, qy), max(px, qx), max(py, qy)
    segment, time, along, side = -1, 2.0, 0.0, 0
    for g in range(sweep.groups.shape[0]):
        if apart(low_x, low_y, high_x, high_y, sweep.groups, g):
            continue
        for s in range(g * GROUP, min((g + 1) * GROUP, sweep.boxes.shape[0])):
            if apart(low_x, low_y, high_x, high_y, sweep.boxes, s):
                continue
            when, where, left = crossing(px, py, qx, qy, sweep.ends, s)
            if when < time:
                segment, time, along, side = s, when, where, left
    return segment, time, along, side


@njit(**EXACT)
def find_crossings(origin, target, sweep, segment, time, along, side):
    """Fill segment, time, along, side (N,) [-] with the first crossings of the ways from origin to target (N, 2) [m]; see `Crossings`."""
    for n in range(origin.shape[0]):
        found = first_crossing(origin[n, 0], origin[n, 1], target[n, 0], target[n, 1], sweep)
        segment[n], time[n], along[n], side[n] = found


def first_crossings(origin: Array, target: Array, sweep: Sweep) -> Crossings:
    """Return the first crossings of N ways from `origin` to `target` (N, 2) [m] with moving segments."""
    count = len(origin)
    found = Crossings(np.empty(count, np.int64), np.empty(count), np.empty(count), np.empty(count, np.int64))
    find_crossings(np.ascontiguousarray(origin), np.ascontiguousarray(target), sweep, *found)
    return found


@njit(**EXACT)
def find_nearest(points, start, end, foot):
    """Fill foot (N, 2) [m] with the point of the segments from start to end (S, 2) [m] that is nearest to each of points (N, 2) [m]."""
    for n in range(points.shape[0]):
        nearest = math.inf
        for s in range(start.shape[0]):
            way_x, way_y = end[s, 0] - start[s, 0], end[s, 1] - start[s, 1]
            x, y = points[n, 0] - start[s, 0], points[n, 1] - start[s, 1]
            square = way_x * way_x + way_y * way_y
            along = min(max((x * way_x + y * way_y) / square, 0.0), 1.0) if square > 0.0 else 0.0
            x, y = x - along * way_x, y - along * way_y
            if x * x + y * y < nearest:
                nearest = x * x + y * y
                foot[n, 0], foot[n, 1] = points[n, 0] - x, points[n, 1] - y


def nearest_on_barriers(points: Array, barriers: Barriers) -> Array:
    """Return the points (N, 2) [m] of all barriers that are nearest to points (N, 2) [m]; infinite without any."""
    foot = np.full((len(points), 2), np.inf)
    find_nearest(np.ascontiguousarray(points), barriers.start, barriers.end, foot)
    return foot


@njit(**EXACT)
def find_hidden(middle, points, neighbour, sweep, hidden):
    """Mark in hidden (N,) the points (N, 2) [m] that the neighbour (N,) of a segment, -1 for none, parts from its middle (N, 2) [m]."""
    for n in range(middle.shape[0]):
        x, y = middle[n, 0], middle[n, 1]
        hidden[n] = neighbour[n] >= 0 and crossing(x, y, points[n, 0], points[n, 1], sweep.ends, neighbour[n])[0] <= 1.0


def beside(barriers: Barriers, segment: Rows, along: Array, side: Rows, sweep: Sweep) -> Array:
    """Return points (N, 2) [m] a standoff beside segments (N,), at shares along (N,) [-] or as near as corners allow.

    side (N,): 1 left, -1 right. A point in a corner so sharp that it would lie beyond the next segment moves to the segment's middle.
    """
    margin = MARGIN * STANDOFF / barriers.lengths()[segment]
    offset = STANDOFF * side[:, None] * barriers.normals()[segment]
    points = barriers.points(segment, np.clip(along, margin, 1.0 - margin)) + offset
    near = np.flatnonzero((along < NEAR * margin) | (along > 1.0 - NEAR * margin))
    if len(near):
        middle = barriers.points(segment[near], np.full(len(near), 0.5)) + offset[near]
        neighbour = np.where(along > 0.5, barriers.following[segment], barriers.preceding[segment])[near]
        hidden = np.empty(len(near), np.bool_)
        find_hidden(middle, points[near], neighbour, sweep, hidden)
        points[near[hidden]] = middle[hidden]
    return points

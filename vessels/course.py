"""The course of a vessel: legs of speed and heading over time, each with or without a line to keep to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from oilsim.quantity import quantity, require


@dataclass(frozen=True, kw_only=True)
class CourseLeg:
    """The orders that hold from `start_time` [s] until the next leg begins.

    speed [m/s]: over the ground along the heading, negative astern; heading [rad]: counter-clockwise about z from +x; through: a point
    (x, y) [m] of the line in the direction of the heading that the vessel keeps to. Without a line the vessel only keeps its heading, and
    current, wind and tow set it off its track. by_hand: thrust ahead and steering counter-clockwise, as parts of the largest; then nobody
    keeps speed, heading and line.
    """

    start_time: float = quantity("s", at_least=0.0)
    speed: float = quantity("m/s", at_least=-20.0, at_most=20.0)
    heading: float = quantity("rad")
    through: tuple[float, float] | None = quantity("m", default=None)
    by_hand: tuple[float, float] | None = quantity("", default=None, at_least=-1.0, at_most=1.0)

    def __post_init__(self) -> None:
        require("leg of a course", CourseLeg, vars(self))


@dataclass(frozen=True, kw_only=True)
class Course:
    """Legs in the order of their start times; the first leg also holds before its start.

    Raises ValueError without legs, and for start times that do not increase.
    """

    legs: tuple[CourseLeg, ...]

    def __post_init__(self) -> None:
        if not self.legs:
            raise ValueError("the course has no legs, allowed: one leg or more")
        times = [leg.start_time for leg in self.legs]
        if any(later <= earlier for earlier, later in pairwise(times)):
            raise ValueError(
                f"the start times of the course's legs are {times} s, allowed: times that increase from leg to leg"
            )

    def leg_index(self, time: float) -> int:
        """Return the index of the leg in force at `time` [s]."""
        begun = [k for k, leg in enumerate(self.legs) if leg.start_time <= time]
        return begun[-1] if begun else 0


def course_through(waypoints: Sequence[tuple[float, float]], speed: float, *, start_time: float = 0.0) -> Course:
    """Lay a course along straight lines through waypoints (x, y) [m] at one speed [m/s], with a stop at the last one.

    Each leg begins when a vessel that keeps the speed exactly reaches its first waypoint: start of leg k + 1 = start of leg k + distance /
    speed. Raises ValueError for fewer than two waypoints or a speed that is not above 0.
    """
    if len(waypoints) < 2 or not speed > 0.0:
        raise ValueError(
            f"the course has {len(waypoints)} waypoint(s) and a speed of {speed:g} m/s, allowed: two waypoints or more and a"
            " speed above 0 m/s"
        )
    legs, time, heading = [], start_time, 0.0
    for begin, end in pairwise(waypoints):
        heading = math.atan2(end[1] - begin[1], end[0] - begin[0])
        legs.append(CourseLeg(start_time=time, speed=speed, heading=heading, through=begin))
        time += math.dist(begin, end) / speed
    legs.append(CourseLeg(start_time=time, speed=0.0, heading=heading, through=waypoints[-1]))
    return Course(legs=tuple(legs))


def wrap_angle(angle: float) -> float:
    """Return the same angle [rad] in (-pi, pi]."""
    wrapped = math.remainder(angle, 2.0 * math.pi)
    return math.pi if wrapped == -math.pi else wrapped

"""A vessel's orders over time: legs of speed and heading, each with or without a line to keep to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from oilsim.quantity import quantity, require


@dataclass(frozen=True, kw_only=True)
class CourseLeg:
    """The orders that hold from `start_time` [s] until the next leg begins.

    speed [m/s] through the ground along the heading, negative astern; heading [rad], counter-clockwise about z from
    +x; through: a point (x, y) [m] of the line, laid in the direction of the heading, that the vessel keeps to. Without
    it the vessel only keeps its heading and is set down by current, wind and tow.
    """

    start_time: float = quantity("s", at_least=0.0)
    speed: float = quantity("m/s", at_least=-20.0, at_most=20.0)
    heading: float = quantity("rad")
    through: tuple[float, float] | None = quantity("m", default=None)

    def __post_init__(self) -> None:
        require("leg of a course", CourseLeg, vars(self))


@dataclass(frozen=True, kw_only=True)
class Course:
    """Legs in the order of their start times; the first one also holds before its start."""

    legs: tuple[CourseLeg, ...]

    def __post_init__(self) -> None:
        if not self.legs:
            raise ValueError("course has no legs: at least one is needed")
        times = [leg.start_time for leg in self.legs]
        if any(later <= earlier for earlier, later in pairwise(times)):
            raise ValueError(f"start times of the course's legs must increase, got {times}")

    def leg_index(self, time: float) -> int:
        """Index of the leg in force at `time` [s]."""
        begun = [k for k, leg in enumerate(self.legs) if leg.start_time <= time]
        return begun[-1] if begun else 0


def course_through(waypoints: Sequence[tuple[float, float]], speed: float, *, start_time: float = 0.0) -> Course:
    """Course along straight lines through waypoints (x, y) [m] at one speed [m/s], then stop at the last.

    Each leg begins when a vessel that keeps the speed exactly reaches its first waypoint: start of leg k + 1 = start of
    leg k + distance / speed.
    """
    if len(waypoints) < 2 or not speed > 0.0:
        raise ValueError(
            f"course needs two waypoints or more and a positive speed, got {len(waypoints)} and {speed:g} m/s"
        )
    legs, time, heading = [], start_time, 0.0
    for begin, end in pairwise(waypoints):
        heading = math.atan2(end[1] - begin[1], end[0] - begin[0])
        legs.append(CourseLeg(start_time=time, speed=speed, heading=heading, through=begin))
        time += math.dist(begin, end) / speed
    legs.append(CourseLeg(start_time=time, speed=0.0, heading=heading, through=waypoints[-1]))
    return Course(legs=tuple(legs))


def wrap_angle(angle: float) -> float:
    """The same angle [rad] in (-pi, pi]."""
    wrapped = math.remainder(angle, 2.0 * math.pi)
    return math.pi if wrapped == -math.pi else wrapped

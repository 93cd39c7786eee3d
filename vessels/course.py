"""The course of a vessel: legs of speed and heading over time, each with or without a line to keep to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from oilsim.core.quantity import quantity, require


@dataclass(frozen=True, kw_only=True)
class CourseLeg:
    """The orders that hold from `start_time` [s] until the next leg begins.

    speed [m/s]: over the ground along the heading, negative astern; heading [rad]: counter-clockwise about z from +x; through: a point
    (x, y) [m] of the line in the direction of the heading that the vessel keeps to. Without a line the vessel only keeps its heading, and
    current, wind and tow set it off its track. until: a point (x, y) [m]; the next leg begins where the vessel is so near to it, along the
    heading, that it has to turn or to stop, whatever the time. by_hand: thrust ahead and steering counter-clockwise, as parts of the
    largest; then nobody keeps speed, heading and line.
    """

    start_time: float = quantity("s", at_least=0.0)
    speed: float = quantity("m/s", at_least=-20.0, at_most=20.0)
    heading: float = quantity("rad")
    through: tuple[float, float] | None = quantity("m", default=None)
    until: tuple[float, float] | None = quantity("m", default=None)
    by_hand: tuple[float, float] | None = quantity("", default=None, at_least=-1.0, at_most=1.0)

    def __post_init__(self) -> None:
        require("leg of a course", CourseLeg, vars(self))


@dataclass(frozen=True, kw_only=True)
class Course:
    """Legs in the order of their start times; the first leg also holds before its start.

    A leg that follows one with an `until` begins where that one ends, and has the same start time. Raises ValueError without legs, and for
    other start times that do not increase.
    """

    legs: tuple[CourseLeg, ...]

    def __post_init__(self) -> None:
        if not self.legs:
            raise ValueError("the course has no legs, allowed: one leg or more")
        times = [leg.start_time for leg in self.legs]
        if any(one.until is None and two.start_time <= one.start_time for one, two in pairwise(self.legs)):
            raise ValueError(
                f"the start times of the course's legs are {times} s, allowed: times that increase from leg to leg"
            )

    def leg_index(
        self, time: float, last: int = 0, place: tuple[float, float] | None = None, early: float = 0.0
    ) -> int:
        """Return the index of the leg in force at `time` [s] after leg `last`, of a vessel at a `place` (x, y) [m].

        early [m]: distance before its `until` at which a leg ends; without a place, no leg ends there.
        """
        index = max(last, 0)
        while index + 1 < len(self.legs):
            leg = self.legs[index]
            if leg.until is None:
                over = self.legs[index + 1].start_time <= time
            else:
                over = place is not None and leg.start_time <= time and _way_to(leg, place) <= early
            if not over:
                break
            index += 1
        return index


def _way_to(leg: CourseLeg, place: tuple[float, float]) -> float:
    """Return how far [m] along its heading the end of a leg is ahead of a place."""
    assert leg.until is not None
    ahead = leg.until[0] - place[0], leg.until[1] - place[1]
    return math.cos(leg.heading) * ahead[0] + math.sin(leg.heading) * ahead[1]


def course_through(waypoints: Sequence[tuple[float, float]], speed: float, *, start_time: float = 0.0) -> Course:
    """Lay a course along straight lines through waypoints (x, y) [m] at one speed [m/s], with a stop at the last one.

    Each leg lasts until the vessel comes to its end. Raises ValueError for fewer than two waypoints, for two that are the same, and for a
    speed that is not above 0.
    """
    if len(waypoints) < 2 or not speed > 0.0:
        raise ValueError(
            f"the course has {len(waypoints)} waypoint(s) and a speed of {speed:g} m/s, allowed: two waypoints or more and a"
            " speed above 0 m/s"
        )
    legs, heading = [], 0.0
    for begin, end in pairwise(waypoints):
        if begin == end:
            raise ValueError(f"the course has the waypoint {begin} twice in a row, allowed: places that differ")
        heading = math.atan2(end[1] - begin[1], end[0] - begin[0])
        legs.append(CourseLeg(start_time=start_time, speed=speed, heading=heading, through=begin, until=end))
    legs.append(CourseLeg(start_time=start_time, speed=0.0, heading=heading, through=waypoints[-1]))
    return Course(legs=tuple(legs))


def wrap_angle(angle: float) -> float:
    """Return the same angle [rad] in (-pi, pi]."""
    wrapped = math.remainder(angle, 2.0 * math.pi)
    return math.pi if wrapped == -math.pi else wrapped

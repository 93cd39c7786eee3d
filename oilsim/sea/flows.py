"""Horizontal velocities over time, for currents and winds: steady, a tide as a sine with its turn, a table.

Each flow has `velocity(time)` (2,) [m/s], its `rate(time)` (2,) [m/s2], and the `travel(time)` (2,) [m] since time 0 of what it carries.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oilsim.core.quantity import quantity, require

Double = NDArray[np.float64]

# [s] period of the main lunar tide M2; paper (Doodson 1921); 12.42 h, so that the current turns every 6.21 h
LUNAR_TIDE = 12.42 * 3600.0
# [1] longest interval of a table, over its median, that counts as no gap; numerical; times of tide tables vary by less
GAP = 2.5
# [m/s] fastest flow; numerical; beyond any wind at sea
FASTEST = 100.0
# [m] largest way of a tide from one turn to the next; numerical; above the 17 m of the Bay of Fundy
LARGEST_RANGE = 20.0
# [1] component of a unit vector up to which it counts as 0; numerical; far above the rounding of sin(pi), 1e-16
ALONG = 1e-9


def heading(direction: float) -> tuple[float, float]:
    """Return the unit vector (x, y) towards `direction` [rad from +x].

    It is exact along the axes, so that a run in the plane stays there: sin(pi) is 1e-16, not 0.
    """
    x, y = math.cos(direction), math.sin(direction)
    return (x if abs(x) > ALONG else 0.0, y if abs(y) > ALONG else 0.0)


class Flow(Protocol):
    """A horizontal velocity that depends on time: (2,) arrays [m/s], [m/s2], [m]."""

    def velocity(self, time: float) -> Double:
        """Return the velocity (2,) [m/s] at `time` [s]."""

    def rate(self, time: float) -> Double:
        """Return its rate of change (2,) [m/s2]."""

    def travel(self, time: float) -> Double:
        """Return the way (2,) [m] since time 0 of what the flow carries."""

    def mean(self) -> Double:
        """Return the mean velocity (2,) [m/s]."""

    def fastest(self) -> float:
        """Return the largest speed [m/s]."""


@dataclass(frozen=True, kw_only=True)
class SteadyFlow:
    """A flow of one speed [m/s] to one direction [rad from +x]; ValueError for values that are not allowed."""

    speed: float = quantity("m/s", at_least=0.0, at_most=FASTEST)
    direction: float = quantity("rad", default=0.0)

    def __post_init__(self) -> None:
        require("steady flow", SteadyFlow, vars(self))

    def velocity(self, time: float) -> Double:
        """Return the velocity (2,) [m/s]."""
        return self.speed * np.array(heading(self.direction))

    def rate(self, time: float) -> Double:
        """Return zeros (2,) [m/s2]."""
        return np.zeros(2)

    def travel(self, time: float) -> Double:
        """Return velocity times time (2,) [m]."""
        return self.velocity(time) * time

    def mean(self) -> Double:
        """Return the velocity (2,) [m/s]."""
        return self.velocity(0.0)

    def fastest(self) -> float:
        """Return the speed [m/s]."""
        return self.speed


@dataclass(frozen=True, kw_only=True)
class TidalFlow:
    """A tide whose speed is a sine of time: U = speed sin(2 pi (t - turn) / period).

    speed      [m/s] the largest
    direction  [rad] it runs to in the half period after the turn; in the next half it runs back
    turn       [s] time of slack water
    period     [s] by default that of the main lunar tide
    Raises ValueError for values that are not allowed.
    """

    speed: float = quantity("m/s", at_least=0.0, at_most=FASTEST)
    direction: float = quantity("rad", default=0.0)
    turn: float = quantity("s", default=0.0)
    period: float = quantity("s", default=LUNAR_TIDE, above=0.0)

    def __post_init__(self) -> None:
        require("tidal flow", TidalFlow, vars(self))

    @property
    def _frequency(self) -> float:
        return 2.0 * math.pi / self.period

    def velocity(self, time: float) -> Double:
        """Return the velocity (2,) [m/s]."""
        return self.speed * math.sin(self._frequency * (time - self.turn)) * np.array(heading(self.direction))

    def rate(self, time: float) -> Double:
        """Return its rate of change (2,) [m/s2]."""
        omega = self._frequency
        return self.speed * omega * math.cos(omega * (time - self.turn)) * np.array(heading(self.direction))

    def travel(self, time: float) -> Double:
        """Return the integral of the velocity since time 0 (2,) [m]."""
        omega = self._frequency
        way = self.speed / omega * (math.cos(omega * self.turn) - math.cos(omega * (time - self.turn)))
        return way * np.array(heading(self.direction))

    def mean(self) -> Double:
        """Return zeros (2,) [m/s]."""
        return np.zeros(2)

    def fastest(self) -> float:
        """Return the speed between the turns [m/s]."""
        return self.speed


class FlowTable:
    """A flow given at times, between which its components change linearly.

    A time outside the table is an error: nothing is extrapolated. Raises ValueError, with all faults and the rows where they are, for
    arrays that do not fit together, values that are not finite, times that do not rise, and gaps: intervals longer than 2.5 median ones.
    """

    def __init__(self, time: ArrayLike, velocity: ArrayLike) -> None:
        """Take the times (N,) [s] and velocities (N, 2) [m/s]."""
        self.time, self.values = np.array(time, np.float64), np.array(velocity, np.float64)
        if self.time.ndim != 1 or self.values.shape != (self.time.size, 2) or self.time.size < 2:
            raise ValueError(
                f"flow table: time has the shape {self.time.shape}, velocity {self.values.shape}, allowed: (N,) and (N, 2), N of 2 or more"
            )
        faults = self._faults()
        if faults:
            raise ValueError("flow table: " + "; ".join(faults))
        self.time.flags.writeable = self.values.flags.writeable = False
        step = np.diff(self.time)[:, None]
        self._travel = np.vstack([np.zeros(2), np.cumsum(0.5 * (self.values[1:] + self.values[:-1]) * step, 0)])

    def _faults(self) -> list[str]:
        """Describe what is wrong with the times and the values."""
        if not np.isfinite(self.time).all():
            return [f"time of row {np.flatnonzero(~np.isfinite(self.time))[0]} is not finite, allowed: finite, in s"]
        faults = []
        wrong = np.flatnonzero(~(np.hypot(*self.values.T) <= FASTEST))
        if wrong.size:
            u, v = self.values[wrong[0]]
            rows = f" and {wrong.size - 1} more" if wrong.size > 1 else ""
            faults.append(
                f"velocity of row {wrong[0]}{rows} is ({u:g}, {v:g}), allowed: at most {FASTEST:g} m/s, and no empty values"
            )
        step = np.diff(self.time)
        back = np.flatnonzero(step <= 0.0)
        if back.size:
            row = back[0]
            faults.append(
                f"time goes from {self.time[row]:g} s to {self.time[row + 1]:g} s at row {row + 1}, allowed: times that rise"
            )
            return faults
        limit = GAP * float(np.median(step))
        for row in np.flatnonzero(step > limit)[:3]:
            faults.append(
                f"a gap of {step[row]:g} s follows {self.time[row]:g} s, allowed: intervals up to {limit:g} s"
            )
        return faults

    def _row(self, time: float) -> int:
        """Return the row before `time`; ValueError for one outside the table."""
        if not self.time[0] <= time <= self.time[-1]:
            raise ValueError(
                f"flow table: time is {time:g} s, allowed: {self.time[0]:g} to {self.time[-1]:g} s, as in the table"
            )
        return min(int(np.searchsorted(self.time, time, "right")) - 1, self.time.size - 2)

    def velocity(self, time: float) -> Double:
        """Return the velocity (2,) [m/s]; ValueError for a time outside the table."""
        row = self._row(time)
        return self.values[row] + self.rate(time) * (time - self.time[row])

    def rate(self, time: float) -> Double:
        """Return the slope of the table (2,) [m/s2]; ValueError for a time outside the table."""
        row = self._row(time)
        return (self.values[row + 1] - self.values[row]) / (self.time[row + 1] - self.time[row])

    def travel(self, time: float) -> Double:
        """Return the integral of the velocity since time 0 (2,) [m]; ValueError where time or 0 lies outside the table."""
        return self._integral(time) - self._integral(0.0)

    def _integral(self, time: float) -> Double:
        row = self._row(time)
        return self._travel[row] + 0.5 * (self.values[row] + self.velocity(time)) * (time - self.time[row])

    def mean(self) -> Double:
        """Return the mean velocity over the table (2,) [m/s]."""
        return self._travel[-1] / (self.time[-1] - self.time[0])

    def fastest(self) -> float:
        """Return the largest speed of the table [m/s]."""
        return float(np.hypot(*self.values.T).max())


@dataclass(frozen=True, kw_only=True)
class Tide:
    """A tide that raises and lowers the whole surface from each high or low water to the next; at the start it is at the sea's level.

    turns  (time [s], height [m]) of each high and low water, as a tide table has them, above any datum; the first is at the start of the
           run or before it, the last at its end or later. Between two of them the height follows half a cosine.
    The depth that waves and currents feel stays that of the still water at the start. Raises ValueError for values that are not allowed.
    """

    turns: tuple[tuple[float, float], ...] = quantity("s, m")

    def __post_init__(self) -> None:
        require("tide", Tide, vars(self), self._faults())

    def _faults(self) -> Iterator[str]:
        """Describe what is wrong with the turns together."""
        if len(self.turns) < 2:
            yield f"turns is a table of {len(self.turns)}, allowed: 2 high and low waters, or more"
        for before, after in pairwise(self.turns):
            if not before[0] < after[0]:
                yield f"turns has {after[0]:g} s after {before[0]:g} s, allowed: times that rise"
            if abs(after[1] - before[1]) > LARGEST_RANGE:
                yield f"turns has {after[1]:g} m after {before[1]:g} m, allowed: at most {LARGEST_RANGE:g} m between them"
        if self.turns and not self.turns[0][0] <= 0.0:
            yield f"turns has {self.turns[0][0]:g} s as its first time, allowed: 0, the start of the run, or before it"

    def rise(self, time: float) -> float:
        """Return the height [m] of the surface at `time` [s] above that at the time 0; ValueError for a time outside the table."""
        return self._height(time) - self._height(0.0)

    def _height(self, time: float) -> float:
        if not self.turns[0][0] <= time <= self.turns[-1][0]:
            raise ValueError(
                f"tide: time is {time:g} s, allowed: {self.turns[0][0]:g} to {self.turns[-1][0]:g} s, as in its table"
            )
        (begin, first), (end, last) = next(pair for pair in pairwise(self.turns) if time <= pair[1][0])
        return 0.5 * (first + last) + 0.5 * (first - last) * math.cos(math.pi * (time - begin) / (end - begin))

    def lowest(self, until: float) -> float:
        """Return the lowest height [m] of the surface from the time 0 to `until` [s], above that at the time 0; ValueError as in `rise`."""
        times = [0.0, until, *(time for time, _ in self.turns if 0.0 < time < until)]
        return min(self.rise(time) for time in times)

"""The past of a run: for a page that is opened late, a sample of gauges and tracks; for one that looks back, whole states.

Both are thinned out evenly, so that they stay small however long the run is.

Figures that swing with the waves are averaged over a few seconds: a label that changes with each crest cannot be read.
"""

from __future__ import annotations

import bisect
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST_ROWS = 1500  # [1] of a sample; then every second row is dropped, and rows come half as often
MOST_STATES = 400  # [1] as for rows
MOST_LETTERS = 60_000_000  # [1] of all states together; then they are thinned out too
CLOSEST = 0.5  # [s] of simulated time between rows at first


class History:
    """Rows of a run's past, thinned out evenly."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self._between = CLOSEST

    def take(self, state: Mapping[str, Any]) -> dict[str, Any] | None:
        """Keep a state's row if it is due, and return it; None if it is not."""
        time = state["time"]
        self.forget_after(time)
        if self.rows and time - self.rows[-1]["time"] < self._between - 1e-9:
            return None
        row = {
            "time": time,
            "vessels": {name: [round(one["x"], 2), round(one["y"], 2)] for name, one in state["vessels"].items()},
            "booms": {
                name: {
                    key: boom[key] for key in ("oil_contained", "oil_lost", "normal_speed_held", "tow_speed", "pull")
                }
                for name, boom in state["booms"].items()
            },
        }
        self.rows.append(row)
        if len(self.rows) > MOST_ROWS:
            self.rows = self.rows[::2]
            self._between *= 2.0
        return row

    def forget_after(self, time: float) -> None:
        """Drop the rows after `time` [s]: the run goes back there, or goes on otherwise from there."""
        while self.rows and self.rows[-1]["time"] > time:
            self.rows.pop()


class Album:
    """States of a run as texts, from which a page picks the one nearest to a moment."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._texts: list[str] = []
        self._between = CLOSEST
        self._letters = 0

    def take(self, time: float, text: str) -> None:
        """Keep the state at `time` [s] if it is due."""
        self.forget_after(time)
        if self._times and time - self._times[-1] < self._between - 1e-9:
            return
        self._times.append(time)
        self._texts.append(text)
        self._letters += len(text)
        while len(self._times) > MOST_STATES or (self._letters > MOST_LETTERS and len(self._times) > 2):
            self._times, self._texts = self._times[::2], self._texts[::2]
            self._letters = sum(map(len, self._texts))
            self._between *= 2.0

    def forget_after(self, time: float) -> None:
        """Drop the states after `time` [s], as `History.forget_after` does."""
        while self._times and self._times[-1] > time:
            self._times.pop()
            self._letters -= len(self._texts.pop())

    def nearest(self, time: float) -> str | None:
        """Return the state nearest to `time` [s]; None if there is none."""
        if not self._times:
            return None
        place = bisect.bisect_left(self._times, time)
        around = range(max(0, place - 1), min(len(self._times), place + 1))
        return self._texts[min(around, key=lambda index: abs(self._times[index] - time))]


SPAN = 5.0  # [s] of simulated time over which a figure is averaged; chosen: a wave or two of the seas in which booms hold oil


class Means:
    """Means of figures over the last `SPAN` seconds, or since the start."""

    def __init__(self) -> None:
        self._past: dict[str, deque[tuple[float, NDArray[np.float64]]]] = {}

    def mean(self, name: str, time: float, value: ArrayLike) -> NDArray[np.float64]:
        """Take the value, () or (N,), of a figure at `time` [s], once for each time; return its mean, of the same shape and unit.

        Each value stands for the time since the one before. What is not finite is returned as it is, and forgets what was before.
        """
        past, new = self._past.setdefault(name, deque()), np.asarray(value, np.float64)
        if not np.isfinite(new).all():
            past.clear()
            return new
        while past and past[-1][0] >= time - 1e-9:
            past.pop()
        past.append((time, new))
        while len(past) > 2 and past[1][0] <= time - SPAN:
            past.popleft()
        if len(past) == 1:
            return new
        times = np.maximum([when for when, _ in past], time - SPAN)
        values = np.stack([found for _, found in past])
        return np.asarray(np.tensordot(np.diff(times), values[1:], axes=1) / (times[-1] - times[0]))

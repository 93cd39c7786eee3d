"""Means over a few seconds, for figures that swing with the waves: a label that changes with each crest cannot be read."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike, NDArray

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

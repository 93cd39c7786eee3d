"""A bounded sample of an unbounded series."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

MOST = 2000  # values; even, so that the next one is due where every second was given up


class EvenSample:
    """Keeps all values of a series or, once they are more than MOST, every second one, every fourth, and so on."""

    def __init__(self) -> None:
        self.values: list[float] = []
        self._stride, self._seen = 1, 0

    def append(self, value: float) -> None:
        """Add the next value, if it is due."""
        if self._seen % self._stride == 0:
            if len(self.values) == MOST:
                del self.values[1::2]
                self._stride *= 2
            self.values.append(value)
        self._seen += 1

    def save_state(self) -> dict[str, Any]:
        """Return the values that are kept, bit for bit."""
        return {"values": np.array(self.values, np.float64), "stride": self._stride, "seen": self._seen}

    @classmethod
    def restored(cls, saved: Mapping[str, Any]) -> EvenSample:
        """Create a sample from the data of `save_state`; ValueError for data that no sample has."""
        values, stride, seen = saved["values"], saved["stride"], saved["seen"]
        if not stride >= 1 or np.shape(values) != (-(-seen // stride),):
            shape = np.shape(values)
            raise ValueError(f"a series of {seen} values, one of {stride} kept, has a sample of shape {shape}")
        sample = cls()
        sample.values, sample._stride, sample._seen = values.tolist(), stride, seen
        return sample

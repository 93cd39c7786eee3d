"""The edge of the simulated sea: where a boom or a vessel leaves it, and where it only sails on into a sea that repeats."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from scenarios.schema.liquid import Tank


class SeaEdge:
    """The sides of a tank in plan.

    period: length [m] of the sea along x and y where it repeats, else 0.
    """

    def __init__(self, tank: Tank, slack: float = 0.0) -> None:
        """Take the tank, and how far [m] a place may be beyond a side before it counts: an end that is made fast there swings a little."""
        self._tank, self._slack = tank, slack
        lengths = [high - low if axis in tank.periodic else 0.0 for axis, low, high in self._axes()]
        self.period = (lengths[0], lengths[1])

    def _axes(self) -> Iterator[tuple[str, float, float]]:
        return zip("xy", self._tank.lower[:2], self._tank.upper[:2], strict=True)

    def passed_by(self, places: NDArray[np.float64]) -> Iterator[tuple[str, str, bool]]:
        """Yield each side that some of the places (N, 2) [m] are beyond, what that means in words, and whether it ends the scoring."""
        for column, (axis, low, high) in enumerate(self._axes()):
            place = places[:, column]
            for side, way in ((f"-{axis}", low - place.min()), (f"+{axis}", place.max() - high)):
                if way <= self._slack:
                    continue
                if axis in self._tank.periodic:
                    text = f"sails past side {side} of the sea, which repeats every {high - low:g} m"
                    yield side, f"{text}: from here on it may meet its own wake and oil that it has lost", False
                elif side in self._tank.open:
                    yield side, f"has left the simulated sea through its open side {side}: its scoring ends here", True

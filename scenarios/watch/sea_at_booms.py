"""The edge of the sea, which a boom leaves, or beyond which the sea repeats."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from scenarios.schema.liquid import Tank


def sides_passed(
    tank: Tank, places: NDArray[np.float64], slack: float, *, repeats: bool = True
) -> Iterator[tuple[str, str, bool]]:
    """Yield each side that some of the places (N, 2) [m] are beyond, what that means in words, and whether it ends the scoring.

    Places up to `slack` [m] beyond a side do not count: an end that is made fast there swings a little. repeats: whether the water repeats
    beyond the tank's periodic sides; a sea by formulas goes on there.
    """
    for place, axis, low, high in zip(places.T, "xy", tank.lower, tank.upper, strict=False):
        for side, way in ((f"-{axis}", low - place.min()), (f"+{axis}", place.max() - high)):
            if way > slack and axis in tank.periodic and repeats:
                text = f"sails past side {side} of the sea, which repeats every {high - low:g} m"
                yield side, f"{text}: from here on it may meet its own wake and oil that it has lost", False
            elif way > slack and side in tank.open:
                yield side, f"has left the simulated sea through its open side {side}: its scoring ends here", True

"""A tide that raises and lowers the whole surface of the sea."""

from __future__ import annotations

import math
from dataclasses import dataclass

from oilsim.core.quantity import quantity, require
from oilsim.sea.flows import LUNAR_TIDE


@dataclass(frozen=True, kw_only=True)
class Tide:
    """A tide as a cosine of time, of the height 0 at the time 0: h(t) = A (cos(2 pi (t - high_water) / T) - cos(2 pi high_water / T)).

    range       [m] 2 A, from low to high water
    high_water  [s] time of high water; -T / 4 makes the start the time at which the water falls fastest
    period      [s] T; by default that of the main lunar tide
    The depth that waves and currents feel stays that of the still water at the start. Raises ValueError for values that are not allowed.
    """

    range: float = quantity("m", at_least=0.0, at_most=20.0)
    high_water: float = quantity("s", default=0.0)
    period: float = quantity("s", default=LUNAR_TIDE, above=0.0)

    def __post_init__(self) -> None:
        require("tide", Tide, vars(self))

    def rise(self, time: float) -> float:
        """Return the height [m] of the surface at `time` [s] above that at the time 0."""
        turn = 2.0 * math.pi / self.period
        return 0.5 * self.range * (math.cos(turn * (time - self.high_water)) - math.cos(turn * self.high_water))

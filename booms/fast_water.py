"""The pocket of a high-speed system: a covered bag at the apex, in which the water is slower than the tow (*modelled*).

Two guide booms lead the oil into the pocket. A net bottom and the pocket's outlets slow the water in it to a share of the speed outside,
so every closure acts there at the slower speed normal to the segments. Its cover keeps waves from carrying oil over it. Oil beyond
its volume leaves through the outlets at the bottom, in the time in which the slowed water passes the pocket.
The water around the guides is that of any boom, and the pocket is dragged as a skirt is: a bag that slows the water to 0.2 has a drag
coefficient of 1.7 by the law of screens (Loeland 1991), a skirt 1.88.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oilsim.core.quantity import quantity, require

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Pocket:
    """A covered bag at the middle of a boom, in which the water is slower (*modelled*).

    length       [m] of boom that it takes, at least a segment
    speed_ratio  of the water in it to that outside
    volume       [m3] of oil that it holds
    Raises ValueError for values out of range.
    """

    length: float = quantity("m", above=0.0)
    speed_ratio: float = quantity("", above=0.0, below=1.0)
    volume: float = quantity("m3", above=0.0)

    def __post_init__(self) -> None:
        require("pocket", Pocket, vars(self))

    def segments(self, boom_length: float, count: int) -> slice:
        """Return the segments of a boom that are the pocket: those whose middles lie within it, an empty slice if it has none.

        boom_length [m]; count: of the boom's segments.
        """
        middles = ((np.arange(count) + 0.5) / count - 0.5) * boom_length
        inside = np.flatnonzero(np.abs(middles) <= 0.5 * self.length * (1.0 + 1e-9))
        return slice(int(inside[0]), int(inside[-1]) + 1) if len(inside) else slice(0, 0)

    def flow_shares(self, boom_length: float, count: int) -> Array:
        """Return the share (count,) [-] of the water's speed at each segment of a boom; arguments as of `segments`."""
        shares = np.ones(count)
        shares[self.segments(boom_length, count)] = self.speed_ratio
        return shares

    def overflow(self, held: float, speed: float) -> float:
        """Compute the oil [m3/s] that leaves an overfull pocket, (V - V_pocket) u / length; 0 while it is not full.

        held V [m3] in the pocket; speed u [m/s] of the water in it.
        """
        return max(0.0, held - self.volume) * max(0.0, speed) / self.length

"""Oil that runs out at a place, such as a leaking tank or a pipe, and comes onto the water as parcels."""

from __future__ import annotations

import math
from collections.abc import Mapping

from oilsim.slick.oil import Oil
from oilsim.slick.slick import Slick

# [s] of flow in a parcel; numerical; an hour of it makes a fifth of the parcels that a slick may have
PERIOD = 1.0
# [m] thickness at which oil is laid on the water, at most; numerical; gravity spreads it in seconds
THICKEST = 0.01
# [s] by which a parcel's time may be missed; numerical; rounding of sums of steps
_SLACK = 1e-6


class SpillSource:
    """Pours `oil` at a constant `rate` [m3/s] at a center (2,) [m] within a `radius` [m].

    start [s]; volume [m3] after which it is empty, None if it pours for ever. `rate` may be changed at any time. Each PERIOD makes one
    parcel. ValueError for a rate below 0, and for a radius or volume that is not above 0.
    """

    def __init__(
        self, name: str, oil: Oil, center: tuple[float, float], radius: float, rate: float, *,
        start: float = 0.0, volume: float | None = None,
    ) -> None:  # fmt: skip
        self.name, self.oil, self.center, self.radius, self.rate, self.start = name, oil, center, radius, rate, start
        for what, value in (("radius", radius), ("volume", 1.0 if volume is None else volume)):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"source {name!r}: {what} is {value}, allowed: above 0")
        if not (math.isfinite(rate) and rate >= 0.0):
            raise ValueError(f"source {name!r}: rate is {rate} m3/s, allowed: 0 or more")
        self._left = math.inf if volume is None else volume
        self._owed = self._waited = 0.0  # m3 that have run out and are no parcel yet; s since the last one

    def pour(self, slick: Slick, time: float, duration: float) -> None:
        """Let run out what is due from `time` to `time + duration` [s], and put it on the water if a parcel is full."""
        flow = min(self._left, self.rate * min(duration, max(0.0, time + duration - self.start)))
        self._left -= flow
        self._owed += flow
        self._waited += duration
        if self._owed > 0.0 and (self._waited > PERIOD - _SLACK or self._left == 0.0):
            radius = max(self.radius, math.sqrt(1.5 * self._owed / (math.pi * THICKEST)))
            slick.pour(self.oil, self._owed, center=self.center, radius=radius)
            self._owed = self._waited = 0.0

    def save_state(self) -> dict[str, float]:
        """Return what the next parcels depend on, as plain data."""
        return {"rate": self.rate, "left": self._left, "owed": self._owed, "waited": self._waited}

    def restore_state(self, saved: Mapping[str, float]) -> None:
        """Go back to what `save_state` returned."""
        self.rate, self._left, self._owed, self._waited = (saved[key] for key in ("rate", "left", "owed", "waited"))

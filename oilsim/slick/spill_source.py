"""Oil that runs out at a place, such as a leaking tank or a pipe, and comes onto the water as parcels."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

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
    parcel. body: name of a floating body on which it lies `center` ahead and to port of its middle; "": it lies still.
    ValueError for a rate below 0, and for a radius or volume that is not above 0.
    """

    def __init__(
        self, name: str, oil: Oil, center: tuple[float, float], radius: float, rate: float, *,
        start: float = 0.0, volume: float | None = None, body: str = "",
    ) -> None:  # fmt: skip
        self.name, self.oil, self.center, self.radius, self.rate, self.start = name, oil, center, radius, rate, start
        self.body = body
        for what, value in (("radius", radius), ("volume", 1.0 if volume is None else volume)):
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"source {name!r}: {what} is {value}, allowed: above 0")
        if not (math.isfinite(rate) and rate >= 0.0):
            raise ValueError(f"source {name!r}: rate is {rate} m3/s, allowed: 0 or more")
        self._left = math.inf if volume is None else volume
        self._owed = self._waited = 0.0  # m3 that have run out and are no parcel yet; s since the last one

    def pour(self, slick: Slick, time: float, duration: float, pose: NDArray[np.float64] | None = None) -> None:
        """Let run out what is due from `time` to `time + duration` [s], and put it on the water if a parcel is full.

        pose (7,) [m, 1] of the body on which the source lies.
        """
        flow = min(self._left, self.rate * min(duration, max(0.0, time + duration - self.start)))
        self._left -= flow
        self._owed += flow
        self._waited += duration
        if self._owed > 0.0 and (self._waited > PERIOD - _SLACK or self._left == 0.0):
            radius = max(self.radius, math.sqrt(1.5 * self._owed / (math.pi * THICKEST)))
            slick.pour(
                self.oil, self._owed, center=self.center if pose is None else self._center_at(pose), radius=radius
            )
            self._owed = self._waited = 0.0

    def _center_at(self, pose: NDArray[np.float64]) -> tuple[float, float]:
        """Return the place (x, y) [m] of the source on a body at a pose (7,)."""
        (ahead, port), (i, j, k, w) = self.center, pose[3:].tolist()
        yaw = math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))
        x, y = pose[:2].tolist()
        return x + ahead * math.cos(yaw) - port * math.sin(yaw), y + ahead * math.sin(yaw) + port * math.cos(yaw)

    def save_state(self) -> dict[str, float]:
        """Return what the next parcels depend on, as plain data."""
        return {"rate": self.rate, "left": self._left, "owed": self._owed, "waited": self._waited}

    def restore_state(self, saved: Mapping[str, float]) -> None:
        """Go back to what `save_state` returned."""
        self.rate, self._left, self._owed, self._waited = (saved[key] for key in ("rate", "left", "owed", "waited"))

"""Oil between one slick and several windows: each exchanges its own, and each moves the oil that stays parcels in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from oilsim.slick.parcels import Parcels, Rows
from oilsim.slick.slick import Slick
from oilsim.window.oil_exchange import OilExchange

Array = NDArray[np.float64]


class JointExchange:
    """The exchanges of several windows, one after the other; windows that do not overlap never ask for the same oil."""

    def __init__(self, exchanges: Sequence[OilExchange]) -> None:
        self.exchanges = tuple(exchanges)

    def follow(self, slick: Slick, relative: Array, time: float) -> None:
        """Bring resolved parcels to where their particles are at `time` [s]; relative (S, 2) [m/s] of the water to the segments."""
        for one in self.exchanges:
            one.follow(slick, relative, time)

    def exchange(self, slick: Slick, time: float) -> None:
        """Let particles in the rims become parcels, and thick parcels in the middles particles."""
        for one in self.exchanges:
            one.exchange(slick, time)

    def places(self, parcels: Parcels, time: float) -> tuple[Rows, Array]:
        """Return the rows (M,) of resolved parcels, and where their particles are at `time` [s], (M, 3) [m]."""
        rows, places = zip(*(one.places(parcels, time) for one in self.exchanges), strict=True)
        return np.concatenate(rows), np.concatenate(places)

    def save_state(self) -> dict[str, float]:
        """Return what has been exchanged, by window and quantity."""
        return {
            f"{k}.{name}": value for k, one in enumerate(self.exchanges) for name, value in one.save_state().items()
        }

    def restore_state(self, saved: Mapping[str, float]) -> None:
        """Go back to what `save_state` returned."""
        for k, one in enumerate(self.exchanges):
            one.restore_state({name: saved[f"{k}.{name}"] for name in one.save_state()})

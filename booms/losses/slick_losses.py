"""The closures of booms for oil that is no particles: the pools of a slick of parcels ahead of each segment (`oilsim.slick`).

Nothing is resolved there, so every closure acts, and all that is lost is modelled. The pose of each segment and the surface of the sea
above it give draft, lean and freeboard, as they do beside particles.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from booms.fast_water import Pocket
from booms.losses.liquids import OilOnWater
from booms.losses.rates import OVER_TOP, UNDER_FOOT, Closures, Drivers
from oilsim.slick.loss_cause import LossCause, Pools

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class PooledBoom:
    """A boom of a slick: the rows of its segments there, its closures, its pocket, and the rows of the segments that are in it."""

    rows: slice
    closures: Closures
    pocket: Pocket | None = None
    pocket_rows: slice | None = None


class SlickLosses:
    """The `LossRate` of a slick whose booms have closures."""

    def __init__(self, booms: Sequence[PooledBoom]) -> None:
        self._booms = tuple(booms)

    def __call__(self, pools: Pools) -> Mapping[LossCause, Array]:
        """Return the rates (P,) [m3/s] by which each pool loses oil, of every cause that acts."""
        total = np.zeros((len(LossCause), len(pools.volume)))
        for boom in self._booms:
            held = np.zeros(len(pools.volume), np.bool_)
            held[2 * boom.rows.start : 2 * boom.rows.stop] = True
            rows = np.flatnonzero(held & (pools.volume > 0.0))
            if len(rows):
                rates = boom.closures.rates(_drivers(pools, rows), _mean_oil(pools, rows))
                rates[np.array(UNDER_FOOT, np.int64)[:, None], np.flatnonzero(pools.is_sealed[rows])] = 0.0
                total[:, rows] = rates * pools.length[rows]
                if boom.pocket is not None and boom.pocket_rows is not None:
                    inside = slice(2 * boom.pocket_rows.start, 2 * boom.pocket_rows.stop)
                    _in_pocket(total, pools, boom.pocket, inside)
        return {cause: total[cause] for cause in LossCause if total[cause].any()}


def _in_pocket(total: Array, pools: Pools, pocket: Pocket, rows: slice) -> None:
    """Change the rates (causes, P) [m3/s] of a pocket's pools: nothing passes its cover, and what is too much drains out of it."""
    total[list(OVER_TOP), rows] = 0.0
    volume = pools.volume[rows]
    held = float(volume.sum())
    if held > 0.0:
        speed = float(np.average(pools.normal_speed[rows], weights=volume))
        total[LossCause.DRAINAGE, rows] += pocket.overflow(held, speed) * volume / held


def _drivers(pools: Pools, rows: NDArray[np.int64]) -> Drivers:
    return Drivers(
        speed=pools.sustained_speed[rows],
        draft=pools.draft[rows],
        held=pools.volume_per_front[rows],
        lean=pools.lean[rows],
        freeboard=pools.freeboard[rows],
        sunk=pools.is_submerged[rows],
    )


def _mean_oil(pools: Pools, rows: NDArray[np.int64]) -> OilOnWater:
    """Return the mean of the oil that these pools hold, weighted by volume; of the viscosity, the geometric mean."""
    weights = pools.volume[rows]
    density, tension = (
        float(np.average(values[rows], weights=weights)) for values in (pools.density, pools.interfacial_tension)
    )
    viscosity = float(np.exp(np.average(np.log(np.maximum(pools.viscosity[rows], 1e-9)), weights=weights)))
    return OilOnWater(
        oil_density=density,
        water_density=pools.water_density,
        kinematic_viscosity=viscosity / density,
        interfacial_tension=tension,
    )

"""Merging: two parcels of one fate that lie close become one, so that a run's parcels stay few; volume is kept.

Drifting parcels merge in pairs within a cell of a grid, held ones within a pool, stranded ones on a side of an outline, resolved ones
never. The pair lies where the larger one lay, and has the mean properties by volume. No pair merges across a barrier.

Recovery: a skimmer takes oil out of a circle on the water, and all recovered oil of a kind is one parcel.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.slick.barriers import Barriers
from oilsim.slick.crossing import first_crossings, resting_sweep
from oilsim.slick.parcels import NONE, Parcels, ParcelState, Rows

MEANS = ("density", "viscosity", "interfacial_tension", "spreading_tension", "age", "thickness")
# columns in which parcels that merge are alike
KEYS = ("oil", "state", "cause", "loser", "carried", "place", "side", "particle")
# [1] doublings of the cell after which merging gives up; numerical; a cell is then a million times wider
ROUNDS = 20
ON_WATER = (ParcelState.AFLOAT, ParcelState.HELD, ParcelState.LOST, ParcelState.RESOLVED)


def merge_parcels(parcels: Parcels, barriers: Barriers, most: int, cell: float) -> None:
    """Merge pairs until there are `most` parcels or fewer, in cells `cell` [m] wide at first and twice as wide in every further round.

    Fewer pairs merge than wanted only where no two parcels share a fate.
    """
    for _ in range(ROUNDS):
        if len(parcels) <= most:
            return
        _merge_round(parcels, barriers, len(parcels) - most, cell)
        cell *= 2.0


def _merge_round(parcels: Parcels, barriers: Barriers, excess: int, cell: float) -> None:
    """Merge up to `excess` pairs of neighbours in the order of `KEYS` and cell."""
    drifts = np.isin(parcels.state, (ParcelState.AFLOAT, ParcelState.LOST))
    square = np.where(drifts[:, None], np.floor(parcels.position / cell), 0.0)
    keys = np.column_stack([*(getattr(parcels, name) for name in KEYS), square])
    order = np.lexsort((parcels.id, *keys.T[::-1]))
    alike = (keys[order[1:]] == keys[order[:-1]]).all(axis=1)
    first = _every_second(alike)[:excess]
    one, other = order[first], order[first + 1]
    way = first_crossings(parcels.position[one], parcels.position[other], resting_sweep(barriers))
    free = (way.segment < 0) | ~drifts[one]
    one, other = one[free], other[free]
    swap = parcels.volume[other] > parcels.volume[one]
    kept, removed = np.where(swap, other, one), np.where(swap, one, other)
    _add_to(parcels, kept, removed)
    _remove(parcels, removed)


def unite(parcels: Parcels, rows: Rows) -> None:
    """Make one parcel of those of rows (M,), at least one: it is the first one, with the volume and the mean properties of all."""
    for row in rows[1:, None]:
        _add_to(parcels, rows[:1], row)
    _remove(parcels, rows[1:])


def _add_to(parcels: Parcels, kept: Rows, removed: Rows) -> None:
    """Give volume and properties of the parcels in rows `removed` (M,) to those in rows `kept` (M,)."""
    total = parcels.volume[kept] + parcels.volume[removed]
    share = parcels.volume[removed] / total
    for name in MEANS:
        column = getattr(parcels, name)
        column[kept] += share * (column[removed] - column[kept])
    parcels.volume[kept] = total


def _remove(parcels: Parcels, rows: Rows) -> None:
    mask = np.ones(len(parcels), np.bool_)
    mask[rows] = False
    parcels.keep(mask)


def _every_second(alike: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Places k at which rows k and k + 1 form a pair, in runs (N,) of rows that are alike; no row is in two pairs."""
    places = np.flatnonzero(alike)
    starts = np.flatnonzero(np.diff(places, prepend=-2) > 1)
    run = np.repeat(starts, np.diff(starts, append=len(places)))
    return np.asarray(places[(np.arange(len(places)) - run) % 2 == 0])


def rows_within(parcels: Parcels, center: tuple[float, float], radius: float) -> Rows:
    """Return the rows (M,) of the oil on the water within `radius` [m] of a center."""
    near = np.hypot(*(parcels.position - np.asarray(center)).T) <= radius
    return np.flatnonzero(near & np.isin(parcels.state, ON_WATER))


def oil_within(parcels: Parcels, center: tuple[float, float], radius: float) -> tuple[float, float]:
    """Return the volume [m3] of the oil on the water within `radius` [m] of a center, and its mean density [kg/m3], 0 without oil."""
    rows = rows_within(parcels, center, radius)
    volume = float(parcels.volume[rows].sum())
    mass = float((parcels.volume[rows] * parcels.density[rows]).sum())
    return volume, mass / volume if volume > 0.0 else 0.0


def recover(parcels: Parcels, center: tuple[float, float], radius: float, volume: float) -> float:
    """Take up to `volume` [m3] of the oil on the water out of it within `radius` [m] of a center; return the volume that was there [m3].

    The nearest parcels go first; the last one is split. All recovered oil of a kind is one parcel. Raises ValueError for a radius or
    volume below 0.
    """
    for name, value in (("radius", radius), ("volume", volume)):
        if not (np.isfinite(value) and value >= 0.0):
            raise ValueError(f"recovery: {name} is {value}, allowed: 0 or more")
    distance = np.hypot(*(parcels.position - np.asarray(center)).T)
    rows = np.flatnonzero((distance <= radius) & np.isin(parcels.state, ON_WATER))
    taken = 0.0
    for row in rows[np.lexsort((parcels.id[rows], distance[rows]))]:
        wanted = volume - taken
        if wanted <= 0.0:
            break
        if parcels.state[row] == ParcelState.RESOLVED:  # what is left of a particle is a parcel
            parcels.state[row], parcels.particle[row] = parcels.fates()[row], NONE
        going = int(row) if parcels.volume[row] <= wanted else parcels.split(int(row), wanted)
        taken += float(parcels.volume[going])
        parcels.state[going] = ParcelState.RECOVERED
        parcels.detach(np.array([going]))
    for oil in np.unique(parcels.oil):  # rows of oil that is gone would count as parcels, and make others merge
        recovered = np.flatnonzero((parcels.state == ParcelState.RECOVERED) & (parcels.oil == oil))
        if len(recovered) > 1:
            unite(parcels, recovered)
    return taken

"""Recovery: a skimmer takes oil out of a circle on the water."""

from __future__ import annotations

import numpy as np

from oilsim.slick.merging import unite
from oilsim.slick.parcels import NONE, Parcels, ParcelState, Rows

ON_WATER = (ParcelState.AFLOAT, ParcelState.HELD, ParcelState.LOST, ParcelState.RESOLVED)


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

"""Parcels of oil as spots seen from above: a place, a radius, a thickness and a fate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from oilsim.slick.parcels import Parcels

Spots = NDArray[np.float32]

AFLOAT, HELD, LOST, ASHORE = 0, 1, 2, 3  # [1] fates of spots


def spots_of_parcels(parcels: Parcels) -> Spots:
    """Return the parcels that are not recovered as spots (N, 5): x, y, radius, thickness [m], fate; area times thickness is the volume."""
    from oilsim.slick.parcels import ParcelState

    fates = {
        ParcelState.AFLOAT: AFLOAT,
        ParcelState.HELD: HELD,
        ParcelState.LOST: LOST,
        ParcelState.STRANDED: ASHORE,
    }
    shown = parcels.state != ParcelState.RECOVERED
    thickness = np.maximum(parcels.thickness[shown], 1e-8)
    radius = np.sqrt(parcels.volume[shown] / (np.pi * thickness))
    by_state = np.array([fates.get(ParcelState(state), AFLOAT) for state in range(len(ParcelState))])
    fate = by_state[parcels.fates()[shown]]
    return np.column_stack([parcels.position[shown], radius, thickness, fate]).astype(np.float32)

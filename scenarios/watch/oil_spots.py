"""Parcels of oil as spots seen from above: a place, a radius, a thickness and a fate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from oilsim.slick.parcels import Parcels, Rows
    from oilsim.slick.slick import Slick

Spots = NDArray[np.float32]

AFLOAT, HELD, LOST, ASHORE = 0, 1, 2, 3  # [1] fates of spots
BANKED_UP = 0.01  # [m] thickest that a film is drawn so that it ends at a barrier; all oil above 0.2 mm has one colour


def film_thickness(parcels: Parcels, rows: Rows) -> NDArray[np.float64]:
    """Return the thickness (M,) [m] of the oil at parcels of rows (M,), no less than oil of their volume would have by itself at last."""
    from oilsim.slick.spreading.fay import final_thickness

    return np.maximum(parcels.thickness[rows], final_thickness(parcels.volume[rows]))


def spots_of_slick(slick: Slick) -> Spots:
    """Return the parcels that are not recovered as spots (N, 5): x, y, radius, thickness [m], fate; area times thickness is the volume.

    No spot is wider than oil of its volume would spread by itself (`final_thickness`). One beside a boom, a hull or a shore ends there,
    and is so much thicker.
    """
    from oilsim.slick.crossing import distance_to_barriers
    from oilsim.slick.parcels import ParcelState

    fates = {
        ParcelState.AFLOAT: AFLOAT,
        ParcelState.HELD: HELD,
        ParcelState.LOST: LOST,
        ParcelState.STRANDED: ASHORE,
    }
    parcels = slick.parcels
    shown = np.flatnonzero(parcels.there())
    volume, place = parcels.volume[shown], parcels.position[shown]
    thickness = film_thickness(parcels, shown)
    radius = np.sqrt(volume / (np.pi * thickness))
    room = np.maximum(distance_to_barriers(place, slick.barriers), np.sqrt(volume / (np.pi * BANKED_UP)))
    ends = room < radius
    radius[ends] = room[ends]
    thickness[ends] = volume[ends] / (np.pi * room[ends] ** 2)
    by_state = np.array([fates.get(ParcelState(state), AFLOAT) for state in range(len(ParcelState))])
    return np.column_stack([place, radius, thickness, by_state[parcels.fates()[shown]]]).astype(np.float32)

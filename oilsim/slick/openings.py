"""Openings: where a joint of a boom has parted, oil passes between the two ends that are free now, and is lost through that joint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import Barriers
from oilsim.slick.crossing import first_crossings, opening_sweep
from oilsim.slick.losses import Losses
from oilsim.slick.parcels import NONE, Parcels, ParcelState, Rows

Array = NDArray[np.float64]


def lose_through_openings(parcels: Parcels, barriers: Barriers, losses: Losses, rows: Rows, target: Array) -> None:
    """Count the parcels of rows (M,) that go to `target` (M, 2) [m] through an opening as lost, unless they are so already.

    Particles of a window stay particles, and count as carried past, too.
    """
    joints = np.flatnonzero(barriers.parted)
    if not len(joints):
        return
    met = first_crossings(parcels.position_of(rows), target, opening_sweep(barriers))
    passing = (met.segment >= 0) & (parcels.cause[rows] == NONE)
    lost, segment = rows[passing], joints[met.segment[passing]]
    resolved = parcels.state[lost] == ParcelState.RESOLVED
    np.add.at(losses.gone[LossCause.THROUGH], segment, parcels.volume[lost])
    np.add.at(losses.carried[LossCause.THROUGH], segment[resolved], parcels.volume[lost[resolved]])
    parcels.mark_lost(lost, int(LossCause.THROUGH), barriers.owner[segment], carried=resolved)
    parcels.state[lost[~resolved]] = ParcelState.LOST

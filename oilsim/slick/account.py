"""The account of a slick: where all oil that was released is now, and what has passed the booms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from oilsim.slick.loss_cause import CAUSES
from oilsim.slick.losses import Losses
from oilsim.slick.parcels import Parcels, ParcelState, sums

FATES = {
    "afloat": ParcelState.AFLOAT,
    "held": ParcelState.HELD,
    "lost": ParcelState.LOST,
    "stranded": ParcelState.STRANDED,
    "recovered": ParcelState.RECOVERED,
}


@dataclass(frozen=True, kw_only=True)
class SlickAccount:
    """Volumes of a slick at one time [m3].

    released       all that was released since the start
    afloat, held, lost, stranded, recovered   where it is now; they add up to `released`
    resolved       part of it that is particles of a window
    lost_by_cause  the lost oil by the name of the cause; oil that a boom catches again is held, not lost
    passed         the oil that booms have lost since the start, less what the same boom took back, by the name of the cause
    """

    released: float
    afloat: float
    held: float
    lost: float
    stranded: float
    recovered: float
    resolved: float
    lost_by_cause: Mapping[str, float]
    passed: Mapping[str, float]

    @property
    def residual(self) -> float:
        """Volume released less that of all parcels [m3]; round-off."""
        return self.released - (self.afloat + self.held + self.lost + self.stranded + self.recovered)


def take_account(parcels: Parcels, losses: Losses, released: float) -> SlickAccount:
    """Add up the parcels; `released` [m3] since the start."""
    fate = parcels.fates()
    lost = fate == ParcelState.LOST
    by_cause = sums(parcels.cause[lost], parcels.volume[lost], len(CAUSES))
    passed = losses.gone.sum(axis=1)
    return SlickAccount(
        released=released,
        lost_by_cause=dict(zip(CAUSES, by_cause.tolist(), strict=True)),
        passed=dict(zip(CAUSES, passed.tolist(), strict=True)),
        resolved=float(parcels.volume[parcels.state == ParcelState.RESOLVED].sum()),
        **{name: float(parcels.volume[fate == one].sum()) for name, one in FATES.items()},
    )

"""The account of a slick: where all oil that was released is now, and what has passed the booms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from oilsim.slick.loss_cause import LossCause
from oilsim.slick.losses import Losses
from oilsim.slick.parcels import Parcels, ParcelState, sums

FATES = (ParcelState.AFLOAT, ParcelState.HELD, ParcelState.LOST, ParcelState.STRANDED, ParcelState.RECOVERED)


@dataclass(frozen=True, kw_only=True)
class SlickAccount:
    """Volumes of a slick at one time [m3].

    released       all that was released since the start
    afloat, held, lost, stranded, recovered   where it is now; they add up to `released`
    resolved       part of it that is particles of a window
    lost_by_cause  the lost oil by the name of the cause; oil that a boom catches again is held, not lost
    passed         the oil that booms have lost since the start, by the name of the cause; it never falls
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
    by_cause = sums(parcels.cause[lost], parcels.volume[lost], len(LossCause))
    passed = losses.gone.sum(axis=1)
    return SlickAccount(
        released=released,
        lost_by_cause={cause.name.lower(): float(by_cause[cause]) for cause in LossCause},
        passed={cause.name.lower(): float(passed[cause]) for cause in LossCause},
        resolved=float(parcels.volume[parcels.state == ParcelState.RESOLVED].sum()),
        **{one.name.lower(): float(parcels.volume[fate == one].sum()) for one in FATES},
    )

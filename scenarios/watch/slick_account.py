"""The slick of a run without particles, or outside its windows, in the terms of accounts and frames that particles have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from booms.boom_state import signed_distance
from booms.containment import ContainmentReport
from oilsim.slick.loss_cause import CAUSES
from oilsim.slick.parcels import ParcelState, sums
from recordings.model.frame import PhaseFrame
from scenarios.watch.oil_spots import film_thickness

if TYPE_CHECKING:
    from coupling.participants.slick import SlickParticipant


def with_slick(report: ContainmentReport, slick: SlickParticipant, boom: str) -> ContainmentReport:
    """Return a boom's report with the oil [m3] held, lost, and removed by skimmers; what no particle carried past is modelled."""
    lost = {cause: float(slick.get(f"{boom}.passed.{cause}")) for cause in CAUSES}
    lost = {cause: volume for cause, volume in lost.items() if volume > 0.0}
    modelled = {cause: volume - float(slick.get(f"{boom}.carried.{cause}")) for cause, volume in lost.items()}
    held, free = float(slick.get(f"{boom}.held")), float(slick.get("afloat"))
    return replace(
        report,
        inside=held,
        outside=free,
        retained=held,
        free=free,
        removed=float(slick.get("recovered")),
        recovered=float(slick.get(f"{boom}.taken_back")),
        lost=sum(lost.values()),
        lost_by_cause=lost,
        lost_modelled=modelled,
    )


def volume_within(slick: SlickParticipant, corners: NDArray[np.float64]) -> float:
    """Return the oil [m3] on the water and ashore within a polygon of corners (K, 2) [m]."""
    parcels = slick.slick.parcels
    there = parcels.there()
    if not there.any():
        return 0.0
    within = signed_distance(parcels.position[there], corners)[0] > 0.0
    return float(parcels.volume[there][within].sum())


def phase_of(slick: SlickParticipant, oil: int, level: float, time: float) -> PhaseFrame:
    """Return the parcels of an oil (`Oil.number`) that no skimmer has taken as particles; resolved ones are where their particles are.

    level [m] of the surface, where the others are.
    """
    parcels = slick.slick.parcels
    position = np.column_stack([parcels.position, np.full(len(parcels), level)]).astype(np.float32)
    if slick.particles is not None:
        rows, places = slick.particles.places(parcels, time)
        position[rows] = places
    order = np.argsort(parcels.id, kind="stable")
    shown = order[(parcels.there() & (parcels.oil == oil))[order]]
    volume = parcels.volume[shown]
    width = np.sqrt(volume / film_thickness(parcels, shown))
    return PhaseFrame(
        position=position[shown],
        id=parcels.id[shown].astype(np.uint32),
        volume=volume.astype(np.float32),
        width=width.astype(np.float32),
    )


def lost_parcels(slick: SlickParticipant) -> dict[str, NDArray[np.uint32]]:
    """Return the ids (N,), increasing, of the parcels that are lost now, by cause."""
    parcels = slick.slick.parcels
    lost = parcels.fates() == ParcelState.LOST
    ids = {name: np.sort(parcels.id[lost & (parcels.cause == cause)]) for cause, name in enumerate(CAUSES)}
    return {name: found.astype(np.uint32) for name, found in ids.items() if len(found)}


def volumes(slick: SlickParticipant) -> Mapping[str, Any]:
    """Return the summary's `oil_m3` of a slick."""
    account, parcels = slick.slick.account, slick.slick.parcels
    lost = {cause: volume for cause, volume in account.lost_by_cause.items() if volume > 0.0}
    by_closures = (parcels.fates() == ParcelState.LOST) & ~parcels.carried
    modelled = dict(
        zip(CAUSES, sums(parcels.cause[by_closures], parcels.volume[by_closures], len(CAUSES)), strict=True)
    )
    return {
        "released": account.released,
        "afloat": account.released - account.recovered - account.stranded,
        "retained": account.held,
        "free": account.afloat,
        "lost": lost | {"left_the_tank": 0.0},
        "lost_modelled": {cause: float(modelled[cause]) for cause in lost},
        "recovered": account.recovered,
        "ashore": account.stranded,
        "resolved": account.resolved,
    }

"""What became of all oil where one or more booms tend it: each particle counted once, whatever the booms' own accounts say.

Booms in series lose the same oil one after another, nested ones hold it together; their accounts must not be added up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from booms.containment import Cause, ContainmentTracker

_NOT_LOST = -1


@dataclass(frozen=True, kw_only=True)
class OilBalance:
    """Where the oil particles are that booms have seen, each counted once.

    retained: in the water, held by any boom; free: in the water, neither held nor lost; lost_by_cause: lost by a boom and held by
    none, by the cause at the boom that lost it last, without causes that took none; lost_and_gone: how many of those have left
    the water.
    """

    retained: int
    free: int
    lost_by_cause: Mapping[str, int]
    lost_and_gone: int


def balance(trackers: Sequence[ContainmentTracker], ids: NDArray[np.integer]) -> OilBalance:
    """Count particles by what became of them; ids (N,) are those in the water, which every boom has been told of."""
    cause, retained = _settled(trackers)
    present = np.zeros(len(cause), dtype=np.bool_)
    present[ids] = True
    lost = cause != _NOT_LOST
    counts = np.bincount(cause[lost], minlength=len(Cause))
    return OilBalance(
        retained=int((present & retained).sum()),
        free=int((present & ~retained & ~lost).sum()),
        lost_by_cause={one.name.lower(): int(counts[one]) for one in Cause if counts[one]},
        lost_and_gone=int((lost & ~present).sum()),
    )


def lost_ids(trackers: Sequence[ContainmentTracker]) -> dict[str, NDArray[np.uint32]]:
    """Ids, increasing, of the particles that are lost now, each by one cause; causes that took none are left out."""
    cause, _ = _settled(trackers)
    found = {one.name.lower(): np.flatnonzero(cause == one).astype(np.uint32) for one in Cause}
    return {name: ids for name, ids in found.items() if len(ids)}


def _settled(trackers: Sequence[ContainmentTracker]) -> tuple[NDArray[np.int8], NDArray[np.bool_]]:
    """Cause (N,) by which particles 0 ... N - 1 are lost to all booms, and whether any boom holds them (N,).

    Of booms that lost a particle at the same time the first one's cause is taken.
    """
    standings = [tracker.standing() for tracker in trackers]
    if not standings:
        return np.zeros(0, np.int8), np.zeros(0, np.bool_)
    lost_at = np.stack([standing.lost_at for standing in standings])
    last = lost_at.argmax(axis=0)
    cause = np.stack([standing.cause for standing in standings])[last, np.arange(len(last))]
    retained = np.any([standing.retained for standing in standings], axis=0)
    lost = np.isfinite(lost_at.max(axis=0)) & ~retained
    return np.where(lost, cause, _NOT_LOST).astype(np.int8), retained

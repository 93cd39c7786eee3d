"""The balance of all oil that one or more booms tend: each particle counts once, whatever the booms' own accounts say.

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
    seen, cause, retained = _settled(trackers)
    present, lost = np.isin(seen, ids), cause != _NOT_LOST
    counts = np.bincount(cause[lost], minlength=len(Cause))
    return OilBalance(
        retained=int((present & retained).sum()),
        free=len(ids) - int((present & (retained | lost)).sum()),
        lost_by_cause={one.name.lower(): int(counts[one]) for one in Cause if counts[one]},
        lost_and_gone=int((lost & ~present).sum()),
    )


def lost_ids(trackers: Sequence[ContainmentTracker]) -> dict[str, NDArray[np.uint32]]:
    """Ids, increasing, of the particles that are lost now, each by one cause; causes that took none are left out."""
    seen, cause, _ = _settled(trackers)
    found = {one.name.lower(): seen[cause == one].astype(np.uint32) for one in Cause}
    return {name: ids for name, ids in found.items() if len(ids)}


def _settled(
    trackers: Sequence[ContainmentTracker],
) -> tuple[NDArray[np.int64], NDArray[np.int8], NDArray[np.bool_]]:
    """Ids (N,), increasing, of the particles that a boom holds or has lost, by what they are lost to all booms, and whether any holds them.

    Where booms lost a particle at the same time, the first one's cause is taken.
    """
    standings = [tracker.standing() for tracker in trackers]
    seen = np.unique(np.concatenate([np.zeros(0, np.int64), *(standing.ids for standing in standings)]))
    cause, retained = np.full(len(seen), _NOT_LOST, np.int8), np.zeros(len(seen), np.bool_)
    lost_at = np.full(len(seen), -np.inf)
    for standing in standings:
        row = np.searchsorted(seen, standing.ids)
        retained[row] |= standing.retained
        later = standing.lost_at > lost_at[row]
        cause[row[later]], lost_at[row[later]] = standing.cause[later], standing.lost_at[later]
    cause[retained] = _NOT_LOST
    return seen, cause, retained

"""The balance of all oil that one or more booms tend: each particle counts once, whatever the booms' own accounts say.

Booms in series lose the same oil one after another, nested ones hold it together; their accounts must not be added up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from booms.containment import ContainmentTracker
from oilsim.slick.loss_cause import LossCause

_NOT_LOST = -1


@dataclass(frozen=True, kw_only=True)
class OilBalance:
    """The oil particles that booms have seen, each counted once.

    retained      particles in the water that at least one boom holds
    free          particles in the water that no boom holds and none has lost
    lost_by_cause particles that a boom has lost and none holds, by the cause at the boom that lost them last; only causes that occur
    lost_modelled the part of these that closures carried out; only causes that occur
    lost_and_gone lost particles that have left the water
    """

    retained: int
    free: int
    lost_by_cause: Mapping[str, int]
    lost_modelled: Mapping[str, int]
    lost_and_gone: int


def balance(trackers: Sequence[ContainmentTracker], ids: NDArray[np.integer]) -> OilBalance:
    """Count the particles by their fate; `ids` (N,) are those in the water now, and every boom has been updated with them."""
    seen, cause, retained, modelled = _settled(trackers)
    present, lost = np.isin(seen, ids), cause != _NOT_LOST
    counts = np.bincount(cause[lost], minlength=len(LossCause))
    closures = np.bincount(cause[lost & modelled], minlength=len(LossCause))
    return OilBalance(
        retained=int((present & retained).sum()),
        free=len(ids) - int((present & (retained | lost)).sum()),
        lost_by_cause={one.name.lower(): int(counts[one]) for one in LossCause if counts[one]},
        lost_modelled={one.name.lower(): int(closures[one]) for one in LossCause if closures[one]},
        lost_and_gone=int((lost & ~present).sum()),
    )


def lost_ids(trackers: Sequence[ContainmentTracker]) -> dict[str, NDArray[np.uint32]]:
    """Return the ids (K,) of the particles that are lost now, in increasing order, by cause; only causes that occur."""
    seen, cause, _, _ = _settled(trackers)
    found = {one.name.lower(): seen[cause == one].astype(np.uint32) for one in LossCause}
    return {name: ids for name, ids in found.items() if len(ids)}


def _settled(
    trackers: Sequence[ContainmentTracker],
) -> tuple[NDArray[np.int64], NDArray[np.int8], NDArray[np.bool_], NDArray[np.bool_]]:
    """Ids (N,), increasing, of the particles that a boom holds or has lost, by what they are lost to all booms, and whether any holds them.

    The last array tells which a closure carried out. Where booms lost a particle at the same time, the first one's cause is taken.
    """
    standings = [tracker.standing() for tracker in trackers]
    seen = np.unique(np.concatenate([np.zeros(0, np.int64), *(standing.ids for standing in standings)]))
    cause, retained = np.full(len(seen), _NOT_LOST, np.int8), np.zeros(len(seen), np.bool_)
    lost_at, modelled = np.full(len(seen), -np.inf), np.zeros(len(seen), np.bool_)
    for standing in standings:
        row = np.searchsorted(seen, standing.ids)
        retained[row] |= standing.retained
        later = standing.lost_at > lost_at[row]
        cause[row[later]], lost_at[row[later]] = standing.cause[later], standing.lost_at[later]
        modelled[row[later]] = standing.modelled[later]
    cause[retained] = _NOT_LOST
    return seen, cause, retained, modelled

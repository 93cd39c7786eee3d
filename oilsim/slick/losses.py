"""Losses: the oil that closures take out of pools, parcel by parcel, with the cause of every litre.

Each pool owes the rates of its closures times the step, cause by cause. Once it owes a cause as much as the settings' `loss_volume`, held
oil next to the boom goes: a parcel as a whole, or a part split off a larger one. It appears behind the segment and drifts on, as lost by
that cause. A pool never owes more than it holds: the next one of its boom takes the rest over.
Volumes that are owed but have not gone yet count as held. Where a joint of a boom has parted, oil passes between the two ends that are free
now, and is lost through that joint.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numba import njit

from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.backend.jit import EXACT
from oilsim.oil.fates import LossCause
from oilsim.oil.ledger import by_cause
from oilsim.slick.barriers import Barriers
from oilsim.slick.crossing import beside, first_crossings, opening_sweep, resting_sweep
from oilsim.slick.loss_rate import Pools
from oilsim.slick.parcels import NONE, Parcels, ParcelState, Rows, sums
from oilsim.slick.pools import pool_of

# [loss volumes] of a parcel up to which it goes as a whole; numerical; the pool's account may be overdrawn by half of one
WHOLE = 1.5
# [1] of a volume that is owed, from which on it is due; numerical; a debt that was handed on in part has rounding errors
ROUNDED = 1.0 - 1e-9

ACCOUNTS = ("owed", "gone", "carried", "recontained")  # of `Losses`


class Losses:
    """Accounts of the oil that pools owe and of the oil that has gone.

    owed  (causes, P) [m3]; gone (causes, S) [m3] by the segment that lost it since the start, less what came back, by the segment of the
    same boom that took it; carried (causes, S) [m3], the part of it that particles of a window carried past by themselves; recontained (S,)
    [m3], what came back.
    """

    def __init__(self, segments: int) -> None:
        self.owed: Array = np.zeros((len(LossCause), 2 * segments))
        self.gone: Array = np.zeros((len(LossCause), segments))
        self.carried: Array = np.zeros((len(LossCause), segments))
        self.recontained: Array = np.zeros(segments)

    @property
    def passed(self) -> dict[str, float]:
        """The oil [m3] that booms have lost since the start, less what the same boom took back, by the name of the cause."""
        return by_cause(self.gone.sum(axis=1))

    def add(self, rates: Mapping[LossCause, Array], pools: Pools, barriers: Barriers, duration: float) -> None:
        """Add the rates (P,) [m3/s] of `duration` [s]; ValueError for rates of another shape, below 0, or not finite."""
        for cause, rate in rates.items():
            given = np.asarray(rate, np.float64)
            if given.shape != pools.volume.shape:
                raise ValueError(
                    f"loss rate of {LossCause(cause).name.lower()} has shape {given.shape}, allowed: {pools.volume.shape}"
                )
            if not (np.isfinite(given).all() and (given >= 0.0).all()):
                raise ValueError(
                    f"loss rate of {LossCause(cause).name.lower()} is {given.min():g} m3/s in a pool, allowed: 0 or more"
                )
            self.owed[cause] += given * duration
        self._hand_on(pools.volume, barriers)

    def _hand_on(self, volume: Array, barriers: Barriers) -> None:
        """Let pools that owe more than their volume (P,) [m3] hand the rest on to the next pool of their boom that holds enough.

        Parcels slide to and fro over joints, so a pool may be empty for a step. (Where its debt was forgotten then, a boom in steps of
        0.05 s lost a twentieth of what its closures gave.) If no pool holds enough, the debt is void.
        """
        debt = self.owed.sum(axis=0)
        for pool in np.flatnonzero(debt > volume).tolist():
            left = self.owed[:, pool] * (1.0 - volume[pool] / debt[pool])
            self.owed[:, pool] -= left
            heir = next_pool(pool, volume > debt + left.sum(), barriers.following, barriers.preceding)
            if heir >= 0:
                self.owed[:, heir] += left
                debt[heir] += left.sum()

    def _due(self, volume: Array, loss_volume: float) -> Flags:
        """Find the causes and pools (causes, P) that owe a parcel; volume (P,) [m3] of the pools.

        A pool that owes all its oil, to several causes together, owes it to the one with the largest share first.
        """
        owed = self.owed >= ROUNDED * np.minimum(loss_volume, volume)
        emptied = self.owed.sum(axis=0) >= ROUNDED * volume
        owed[self.owed.argmax(axis=0)[emptied], emptied] = True
        return np.asarray((volume > 0.0) & owed)

    def carry_out(self, parcels: Parcels, barriers: Barriers, volume: Array, loss_volume: float) -> bool:
        """Take all that is due out of pools of some volume (P,) [m3], in parcels of `loss_volume` [m3] or a pool's last oil.

        Returns whether any was due.
        """
        if not self._due(volume, loss_volume).any():
            return False
        while True:
            held = parcels.in_pools()
            pool = pool_of(parcels, held)
            due = self._due(sums(pool, parcels.volume[held], self.owed.shape[1]), loss_volume)
            if not due.any():
                return True
            causes, pools = np.nonzero(due)
            _, first = np.unique(pools, return_index=True)  # one parcel a pool and round
            taken = [
                self._take(parcels, held[pool == pools[k]], int(causes[k]), int(pools[k]), loss_volume) for k in first
            ]
            self._put_behind(parcels, barriers, np.array(taken))

    def _take(self, parcels: Parcels, members: Ints, cause: int, pool: int, loss_volume: float) -> int:
        """Mark one parcel of a pool as lost, the nearest to its boom, a particle last of all; return its row."""
        is_particle = parcels.state[members] == ParcelState.RESOLVED
        row = int(members[np.lexsort((parcels.id[members], parcels.ahead[members], is_particle))[0]])
        parcels.state[row], parcels.particle[row] = ParcelState.HELD, NONE
        if parcels.volume[row] > WHOLE * loss_volume:
            row = parcels.split(row, loss_volume)
        volume = parcels.volume[row]
        self.owed[cause, pool] -= volume
        self.gone[cause, pool // 2] += volume
        parcels.state[row], parcels.cause[row] = ParcelState.LOST, cause
        return row

    @staticmethod
    def _put_behind(parcels: Parcels, barriers: Barriers, rows: Ints) -> None:
        place, along, side = parcels.place[rows], parcels.along[rows], -parcels.side[rows]
        parcels.position[rows] = beside(barriers, place, along, side, resting_sweep(barriers))
        parcels.mark_lost(rows, parcels.cause[rows], barriers.owner[place], carried=False)
        parcels.detach(rows)

    def recontain(self, parcels: Parcels, barriers: Barriers, rows: Ints, segment: Ints) -> None:
        """Take the oil of rows (M,) off the losses where the segments (M,) that catch it are of the boom that lost it."""
        own = parcels.loser[rows] == barriers.owner[segment]
        rows, segment = rows[own], segment[own]
        volume, cause, carried = parcels.volume[rows], parcels.cause[rows], parcels.carried[rows]
        np.subtract.at(self.gone, (cause, segment), volume)
        np.subtract.at(self.carried, (cause[carried], segment[carried]), volume[carried])
        np.add.at(self.recontained, segment, volume)

    def save_state(self) -> dict[str, Any]:
        """Return what is owed, what has gone and what came back."""
        return {name: getattr(self, name).copy() for name in ACCOUNTS}

    def restore_state(self, saved: Mapping[str, Any]) -> None:
        """Go back to what `save_state` returned."""
        for name in ACCOUNTS:
            setattr(self, name, saved[name].copy())


@njit(**EXACT)
def next_pool(pool, able, following, preceding):
    """Return the pool [-] nearest along the boom, on the same side, of those that are able (P,); -1 if none is.

    following, preceding (S,): segments tied to each segment's end and start, -1 at a free end.
    """
    ahead = behind = pool // 2
    for _ in range(following.shape[0]):
        ahead = following[ahead] if ahead >= 0 else NONE
        behind = preceding[behind] if behind >= 0 else NONE
        if ahead < 0 and behind < 0:
            break
        for segment in (ahead, behind):
            if segment >= 0 and able[2 * segment + pool % 2]:
                return 2 * segment + pool % 2
    return NONE


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

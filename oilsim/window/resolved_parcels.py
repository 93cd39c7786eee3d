"""Resolved parcels: oil that is particles of a window. Each follows its own particle, and lies in a pool of the boom that it is before.

A particle whose way in plan view crosses a boom from the side against which the water presses is lost from then on, and one that crosses
back is not. Its cause is told by its height there: SPLASH_OVER above the boom's top, DRAINAGE below its foot, within half of its own edge,
THROUGH between them, and where it passes the opening of a boom that has parted. Droplets that a current tears off are smaller than
particles; closures go on to take them out of the pools.

A skirt of few particles lets oil drain under its foot that a real one holds; that loss is the closures'. So where a skirt is too coarse for
particles to decide, and stands, the parcel stays before it instead (*modelled*, as `booms.losses.closure_losses` does among particles).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import Barriers
from oilsim.slick.crossing import first_crossings, moving_sweep
from oilsim.slick.losses import lose_through_openings
from oilsim.slick.parcels import NONE, Rows
from oilsim.slick.slick import Slick

Array = NDArray[np.float64]

# [drafts] from a segment within which particles before it belong to its pool, however short that is; numerical; the water is slowed there
NEAREST = 2.0


class CoarseSkirts(NamedTuple):
    """The segments whose skirts are too few particles deep to hold oil as real ones do.

    depth     (S,) [m] of the skirts as built; 0 of segments whose particles decide
    standing  share [1] of its depth that a skirt has in the water at least, and
    lean      [rad] up to which it stands
    """

    depth: Array
    standing: float
    lean: float

    def hold(self, barriers: Barriers) -> NDArray[np.bool_]:
        """Mark the segments (S,) that hold oil back now."""
        stands = (barriers.draft > self.standing * self.depth) & (barriers.lean < self.lean)
        return np.asarray((self.depth > 0.0) & stands)


def follow_particles(
    slick: Slick, rows: Rows, target: Array, height: Array, relative: Array, skirts: CoarseSkirts | None = None
) -> Rows:
    """Move the resolved parcels of rows (M,) to `target` (M, 2) [m], book what passes booms, and return the rows that are held back.

    height (M,) [m] of the particles above the still water; relative (S, 2) [m/s]: velocity of the water relative to each segment. What is
    held back, under the foot of one of `skirts`, stays where it was; its particle has gone on.
    """
    parcels, barriers, losses = slick.parcels, slick.barriers, slick.losses
    met = first_crossings(parcels.position_of(rows), target, moving_sweep(barriers))
    back = np.zeros(len(rows), np.bool_)
    hit = np.flatnonzero(met.segment >= 0)
    hit = hit[barriers.is_boom[met.segment[hit]]]
    if len(hit):
        segment, crossing = met.segment[hit], rows[hit]
        pressed = met.side[hit] * np.einsum("mk,mk->m", relative[segment], barriers.normals()[segment]) < 0.0
        lost = pressed & (parcels.cause[crossing] == NONE)
        cause = _causes(np.cbrt(parcels.volume[crossing]), height[hit], barriers, segment)
        if skirts is not None:
            held = lost & (cause == LossCause.DRAINAGE) & skirts.hold(barriers)[segment]
            np.add.at(losses.held_back, segment[held], parcels.volume[crossing[held]])
            back[hit[held]] = True
            lost &= ~held
        for account in (losses.gone, losses.carried):
            np.add.at(account, (cause[lost], segment[lost]), parcels.volume[crossing[lost]])
        parcels.mark_lost(crossing[lost], cause[lost], barriers.owner[segment[lost]], carried=True)
        losses.recontain(parcels, barriers, crossing[~pressed], segment[~pressed])
        parcels.mark_found(crossing[~pressed])
    free = met.segment < 0
    lose_through_openings(parcels, barriers, losses, rows[free], target[free])
    parcels.put_position(rows[~back], target[~back])
    _join_pools(slick, rows[~back])
    return rows[back]


def _causes(edge: Array, height: Array, barriers: Barriers, segment: Rows) -> Rows:
    """Return the causes (M,) by which particles of an edge (M,) [m] pass segments (M,) at a height (M,) [m]."""
    foot, top = -barriers.draft[segment] + 0.5 * edge, barriers.freeboard[segment] - 0.5 * edge
    between = np.where(height > top, int(LossCause.SPLASH_OVER), int(LossCause.THROUGH))
    return np.asarray(np.where(height < foot, int(LossCause.DRAINAGE), between))


def _join_pools(slick: Slick, rows: Rows) -> None:
    """Give what is not lost to the pool of the nearest segment, if that holds oil now, as in waves, and reaches as far."""
    parcels, barriers = slick.parcels, slick.barriers
    parcels.detach(rows)
    own = rows[parcels.cause[rows] == NONE]
    booms = np.flatnonzero(barriers.is_boom & barriers.is_there)
    if not len(own) or not len(booms):
        return
    way = barriers.end[booms] - barriers.start[booms]
    offset = parcels.position[own][:, None] - barriers.start[booms]
    along = np.clip(np.einsum("msk,sk->ms", offset, way) / (way**2).sum(1), 0.0, 1.0)
    distance = np.linalg.norm(offset - along[..., None] * way, axis=2)
    near, all_rows = distance.argmin(1), np.arange(len(own))
    segment = booms[near]
    normal = barriers.normals()[segment]
    side = np.where(np.einsum("mk,mk->m", parcels.position[own] - barriers.start[segment], normal) >= 0.0, 1, -1)
    pool = 2 * segment + (side < 0)
    reach = np.maximum(slick.pools.reach[pool], NEAREST * barriers.draft[segment])
    away = distance[all_rows, near]
    chosen = (slick.slack[pool] < 1.0) & (away <= reach)
    rows, segment = own[chosen], segment[chosen]
    parcels.place[rows], parcels.side[rows] = segment, side[chosen]
    parcels.along[rows], parcels.ahead[rows] = along[all_rows, near][chosen], away[chosen]

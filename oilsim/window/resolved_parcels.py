"""Resolved parcels: oil that is particles of a window. Each follows its own particle, and lies in a pool of the boom that it is before.

A particle whose way in plan view crosses a boom from the side against which the water presses is lost from then on, and one that crosses
back is not. Its cause is told by its height there: SPLASH_OVER above the boom's top, DRAINAGE below its foot, within half of its own edge,
THROUGH between them, and where it passes the opening of a boom that has parted. Droplets that a current tears off are smaller than
particles; closures go on to take them out of the pools.
"""

from __future__ import annotations

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


def follow_particles(slick: Slick, rows: Rows, target: Array, height: Array, relative: Array) -> None:
    """Move the resolved parcels of rows (M,) to `target` (M, 2) [m], and book what passes booms.

    height (M,) [m] of the particles above the still water; relative (S, 2) [m/s]: velocity of the water relative to each segment.
    """
    parcels, barriers, losses = slick.parcels, slick.barriers, slick.losses
    met = first_crossings(parcels.position_of(rows), target, moving_sweep(barriers))
    hit = np.flatnonzero(met.segment >= 0)
    hit = hit[barriers.is_boom[met.segment[hit]]]
    if len(hit):
        segment, crossing = met.segment[hit], rows[hit]
        pressed = met.side[hit] * np.einsum("mk,mk->m", relative[segment], barriers.normals()[segment]) < 0.0
        lost = pressed & (parcels.cause[crossing] == NONE)
        cause = _causes(np.cbrt(parcels.volume[crossing]), height[hit], barriers, segment)
        for account in (losses.gone, losses.carried):
            np.add.at(account, (cause[lost], segment[lost]), parcels.volume[crossing[lost]])
        parcels.mark_lost(crossing[lost], cause[lost], barriers.owner[segment[lost]], carried=True)
        losses.recontain(parcels, barriers, crossing[~pressed], segment[~pressed])
        parcels.mark_found(crossing[~pressed])
    free = met.segment < 0
    lose_through_openings(parcels, barriers, losses, rows[free], target[free])
    parcels.put_position(rows, target)
    _join_pools(slick, rows)


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

"""Pools: the oil that each segment of a boom holds, on either side, and how its parcels lie and slide there.

A held parcel belongs to a pool and keeps a fixed rank, a share of the pool's volume that lies between it and the boom, drawn from its id
by the silver ratio, so that the parcels of a pool always fill the profile of `oilsim.slick.pool_profile` evenly. It lies against the
relative flow from its segment, never beyond another barrier, and moves to its place no faster than the water and a gravity current
(g' h_b)^(1/2) together. Along the segment it slides with the speed that balances the water's stress and the slope of the pool,

    v = U_t - rho_o g' d(h_b^2)/ds / (rho_w C_f |U|),

where the second term is at most (g' h_b)^(1/2). So oil gathers in the apex of a U until it is thick enough to lean back. Beyond a joint it
goes on in the next pool; beyond a free end it is lost around the end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from oilsim.slick.barriers import STANDOFF, Barriers
from oilsim.slick.crossing import beside, first_crossings, resting_sweep
from oilsim.slick.loss_cause import LossCause, Pools
from oilsim.slick.parcels import NONE, Parcels, ParcelState, Rows, sums
from oilsim.slick.pool_profile import (
    boom_thickness,
    distance_to,
    head_thickness,
    reduced_gravity,
    thickening,
    thickness_after,
)

Array = NDArray[np.float64]

# [1] share of its length that a segment counts as front at least, however it lies to the flow; tuned; a parallel boom would have none
LEAST_FRONT = 0.1
# [1] largest mobility times h_b^2 dt / length^2 of a pool's slope; numerical; theory of explicit diffusion allows 0.375
STABLE_SLOPE = 0.25
# [1] share of a free way to a barrier at which a parcel of a pool stops; numerical; it must stay on its own side
SHORT_OF = 0.9
# [1] square root of 2, less 1; theory (Weyl); multiples fill the unit interval evenly, whatever the golden angle of a release
SILVER = 0.41421356237309503


def pool_of(parcels: Parcels, rows: Rows) -> Rows:
    """Return the pools (M,) of held parcels in rows (M,)."""
    return np.asarray(2 * parcels.place[rows] + (parcels.side[rows] < 0))


def measure_pools(
    parcels: Parcels, barriers: Barriers, relative: Array, water_density: float, friction: float
) -> Pools:
    """Compute the state of all pools.

    relative (S, 2) [m/s]: velocity of the water relative to each segment; water_density [kg/m3]; friction C_f [-].
    """
    segment = np.repeat(np.arange(len(barriers)), 2)
    side = np.tile(np.array([1, -1]), len(barriers))
    length, speed = barriers.lengths()[segment], np.hypot(*relative.T)[segment]
    normal_speed = -side * np.einsum("sk,sk->s", relative, barriers.normals())[segment]
    held = np.flatnonzero(parcels.state == ParcelState.HELD)
    pool, weight = pool_of(parcels, held), parcels.volume[held]
    volume = sums(pool, weight, len(segment))
    full = np.where(volume > 0.0, volume, 1.0)
    density, viscosity, tension = (
        sums(pool, weight * column[held], len(segment)) / full
        for column in (parcels.density, parcels.viscosity, parcels.interfacial_tension)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = np.where(speed > 0.0, normal_speed / speed, 0.0)
    front = length * np.maximum(cosine, LEAST_FRONT)
    pressed = (normal_speed > 0.0) & (volume > 0.0)
    head, thick, reach = np.zeros((3, len(segment)))
    weaker = reduced_gravity(density[pressed], water_density)
    head[pressed] = head_thickness(normal_speed[pressed], weaker)
    growth = thickening(normal_speed[pressed], weaker, density[pressed] / water_density, friction)
    thick[pressed] = boom_thickness(head[pressed], growth, volume[pressed] / front[pressed])
    reach[pressed] = distance_to(thick[pressed], growth, head[pressed])
    return Pools(
        segment, side, length, front, normal_speed, speed, barriers.draft[segment], volume, volume / front, head, thick,
        reach, density, viscosity, tension, water_density,
    )  # fmt: skip


def release_slack(parcels: Parcels, pools: Pools) -> None:
    """Let oil float freely, from where it lies now, where the water does not press it against its segment any more."""
    held = np.flatnonzero(parcels.state == ParcelState.HELD)
    slack = held[pools.normal_speed[pool_of(parcels, held)] <= 0.0]
    parcels.state[slack] = ParcelState.AFLOAT
    parcels.detach(slack)


def _slope_speeds(pools: Pools, barriers: Barriers, friction: float, duration: float) -> Array:
    """Speeds (P, 2) [m/s] along each segment by the pool's slope, at its start and its end; positive towards its end."""
    speeds = np.zeros((len(pools.segment), 2))
    oil = np.flatnonzero((pools.volume > 0.0) & (pools.normal_speed > 0.0))
    weaker = reduced_gravity(pools.density[oil], pools.water_density)
    wave = np.sqrt(weaker * pools.thickness[oil])
    mobility = pools.density[oil] * weaker / (pools.water_density * friction * pools.speed[oil])
    stable = STABLE_SLOPE * pools.length[oil] ** 2 / (pools.thickness[oil] ** 2 * duration)
    mobility = np.minimum(mobility, stable)
    for end, tied in enumerate((barriers.preceding, barriers.following)):
        other = tied[pools.segment[oil]]
        beyond = 2 * other + (pools.side[oil] < 0)
        there = np.where(other >= 0, pools.thickness[beyond], 0.0)
        span = 0.5 * (pools.length[oil] + np.where(other >= 0, pools.length[beyond], 0.0))
        fall = (pools.thickness[oil] ** 2 - there**2) / span
        speeds[oil, end] = (2 * end - 1) * np.clip(mobility * fall, -wave, wave)
    return speeds


def slide(
    parcels: Parcels, barriers: Barriers, pools: Pools, relative: Array, duration: float, friction: float
) -> Rows:
    """Move held parcels along their segments and over joints for `duration` [s]; return the rows (M,) lost around free ends.

    relative (S, 2) [m/s]: velocity of the water relative to each segment; friction C_f [-].
    """
    held = np.flatnonzero(parcels.state == ParcelState.HELD)
    place, along, pool = parcels.place[held], parcels.along[held], pool_of(parcels, held)
    lengths = barriers.lengths()
    tangent = (barriers.end - barriers.start) / lengths[:, None]
    carried = np.einsum("sk,sk->s", relative, tangent)
    slope = _slope_speeds(pools, barriers, friction, duration)
    speed = carried[place] + (1.0 - along) * slope[pool, 0] + along * slope[pool, 1]
    along = along + speed * duration / lengths[place]
    gone = np.zeros(len(held), np.bool_)
    while (over := np.flatnonzero(~gone & ((along > 1.0) | (along < 0.0)))).size:
        ahead = along[over] > 1.0
        to = np.where(ahead, barriers.following[place[over]], barriers.preceding[place[over]])
        gone[over] = to < 0
        past = np.where(ahead, along[over] - 1.0, -along[over]) * lengths[place[over]]
        inside = np.minimum(past / lengths[to], 1.0)
        along[over] = np.where(to < 0, np.clip(along[over], 0.0, 1.0), np.where(ahead, inside, 1.0 - inside))
        place[over] = np.where(to < 0, place[over], to)
    parcels.place[held], parcels.along[held] = place, along
    return np.asarray(held[gone])


def arrange(
    parcels: Parcels, barriers: Barriers, pools: Pools, relative: Array, duration: float, friction: float
) -> None:
    """Put held parcels at their places in the pools' profiles, as far as they get in `duration` [s]; none passes a barrier.

    relative (S, 2) [m/s]: velocity of the water relative to each segment; friction C_f [-].
    """
    held = np.flatnonzero(parcels.state == ParcelState.HELD)
    pool, place = pool_of(parcels, held), parcels.place[held]
    resting = resting_sweep(barriers)
    anchor = beside(barriers, place, parcels.along[held], parcels.side[held], resting)
    rank = parcels.id[held] * SILVER % 1.0
    oil, speed = (pools.volume > 0.0) & (pools.normal_speed > 0.0), pools.normal_speed
    weaker = np.where(oil, reduced_gravity(pools.density, pools.water_density), 1.0)
    growth = np.where(
        oil, thickening(speed, weaker, np.where(oil, pools.density / pools.water_density, 1.0), friction), 1.0
    )
    local = thickness_after(pools.thickness[pool], growth[pool], rank * pools.volume_per_front[pool])
    wanted = np.where(oil[pool], distance_to(pools.thickness[pool], growth[pool], local), 0.0)
    fastest = np.where(oil, speed + np.sqrt(weaker * pools.thickness), 0.0)[pool] * duration
    ahead = parcels.ahead[held] + np.clip(wanted - parcels.ahead[held], -fastest, fastest)
    away = parcels.side[held][:, None] * barriers.normals()[place]
    away[oil[pool]] = -relative[place][oil[pool]] / pools.speed[pool][oil[pool], None]
    target = anchor + ahead[:, None] * away
    free = first_crossings(anchor, target, resting)
    share = np.where(free.segment >= 0, SHORT_OF * free.time, 1.0)
    parcels.position[held] = anchor + share[:, None] * (target - anchor)
    parcels.ahead[held] = share * ahead
    parcels.thickness[held] = np.where(oil[pool], local, parcels.thickness[held])


def lose_around_ends(parcels: Parcels, barriers: Barriers, rows: Rows) -> Array:
    """Let the parcels of rows (M,) float on beyond the free ends, lost around them; return their volume by segment (S,) [m3]."""
    place, along = parcels.place[rows], parcels.along[rows]
    volume = sums(place, parcels.volume[rows], len(barriers))
    resting = resting_sweep(barriers)
    near = beside(barriers, place, along, parcels.side[rows], resting)
    outward = np.where(along[:, None] > 0.5, 1.0, -1.0) * (barriers.end - barriers.start)[place]
    beyond = barriers.points(place, np.round(along)) + STANDOFF * outward / barriers.lengths()[place, None]
    free = first_crossings(near, beyond, resting).segment < 0
    parcels.position[rows] = np.where(free[:, None], beyond, near)
    parcels.state[rows], parcels.cause[rows] = ParcelState.LOST, int(LossCause.AROUND_ENDS)
    parcels.detach(rows)
    return volume


def hold(parcels: Parcels, rows: Rows, segment: Rows, along: Array, side: Rows) -> None:
    """Give the parcels of rows (M,) to the pools on a side (M,) of segments (M,), at shares along (M,) [-] of their lengths."""
    parcels.state[rows], parcels.cause[rows] = ParcelState.HELD, NONE
    parcels.place[rows], parcels.side[rows] = segment, side
    parcels.along[rows], parcels.ahead[rows] = np.clip(along, 0.0, 1.0), 0.0

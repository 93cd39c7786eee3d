"""Pools: the oil that each segment of a boom holds, on either side, and how its parcels lie and slide there.

A held parcel belongs to a pool and keeps a fixed rank, a share of the pool's volume that lies between it and the boom, drawn from its id
by the silver ratio, so that the parcels of a pool always fill the profile evenly. It lies square to
its segment, never beyond another barrier, and moves to its place no faster than the water and a gravity current
(g' h_b)^(1/2) together. Along the segment it slides with the speed that balances the water's stress and the slope of the pool,

    v = U_t - rho_o g' d(h_b^2)/ds / (rho_w C_f |U|),

where the second term is at most (g' h_b)^(1/2). So oil gathers in the apex of a U until it is thick enough to lean back. A pool's
parcels lie evenly along its segment about their middle, which slides. Beyond a joint a parcel goes on in the next pool; beyond a free end
it is lost around the end, or through the joint that has parted there.

**Profile.** The head of the slick stands where the water comes to rest below it: its thickness is h_f = U^2 / (2 g'), with
g' = g (1 - rho_o / rho_w) and U [m/s] the speed of the water normal to the boom. Behind the head the interfacial stress C_f rho_w U^2 / 2
thickens the slick towards the boom: with x [m] from the head, h^2 = h_f^2 + K x, K = C_f (rho_w / rho_o) U^2 / g' [m]. Oil of V' [m2] per
metre of front then is

    h_b = (h_f^3 + 1.5 K V')^(1/3) thick at the boom [m],   L = (h_b^2 - h_f^2) / K long [m].

Range: a slender slick (L > 5 h_b) of quiescent oil in water deeper than five drafts. Source: balance of forces on a floating layer; a thin
slick without friction has h_f everywhere. This is a closure: C_f is 0.005 by default; values from 0.003 to 0.016 are plausible.
"""

from __future__ import annotations

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.core.physical_constants import GRAVITY
from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import STANDOFF, Barriers
from oilsim.slick.crossing import beside, first_crossings, resting_sweep
from oilsim.slick.loss_rate import Pools, passed_share
from oilsim.slick.parcels import Parcels, ParcelState, Rows, sums
from oilsim.slick.pool_kernels import SUMS, Aims, Held, Lines, place_parcels, slide_parcels, sum_pools

# [1] share of its length that a segment counts as front at least, however it lies to the flow; tuned; a parallel boom would have none
LEAST_FRONT = 0.1
# [1] largest mobility times h_b^2 dt / length^2 of a pool's slope; numerical; theory of explicit diffusion allows 0.375
STABLE_SLOPE = 0.25
# [1] length of a pool over its thickness, from which on its head is whole; tuned; assumed, the same as in `booms.losses.rates`
HEAD_LENGTH = 5.0
# [drafts] that water runs back from a segment until it takes the oil along; tuned; assumed, waves of that height move water by less
RETREAT = 3.0


def pool_of(parcels: Parcels, rows: Rows) -> Rows:
    """Return the pools (M,) of held parcels in rows (M,)."""
    return np.asarray(2 * parcels.place[rows] + (parcels.side[rows] < 0))


def _held(parcels: Parcels, rows: Rows | None = None) -> Held:
    rows = np.flatnonzero(parcels.state == ParcelState.HELD) if rows is None else rows
    return Held(
        rows, parcels.id, parcels.place, parcels.side, parcels.along, parcels.ahead, parcels.thickness
    )  # fmt: skip


def _lines(barriers: Barriers) -> Lines:
    return Lines(
        barriers.start, barriers.end - barriers.start, barriers.normals(), barriers.lengths(), barriers.following,
        barriers.preceding,
    )  # fmt: skip


def _sums_of_pools(parcels: Parcels, segments: int) -> Array:
    """Volume, and means by volume of density, viscosity and interfacial tension (4, P) of all pools."""
    total = np.zeros((2 * segments, SUMS))
    columns = (parcels.volume, parcels.density, parcels.viscosity, parcels.interfacial_tension)
    held = _held(parcels, parcels.in_pools())
    if len(held.rows):
        sum_pools(held, np.stack(columns), total)
    total[:, 1:] /= np.where(total[:, :1] > 0.0, total[:, :1], 1.0)
    return total.T


def normal_speeds(barriers: Barriers, relative: Array) -> Array:
    """Return the speeds (P,) [m/s] at which water runs against the pools' segments; relative (S, 2) [m/s], to each segment."""
    return np.repeat(np.einsum("sk,sk->s", relative, barriers.normals()), 2) * np.tile([-1.0, 1.0], len(barriers))


def sustain(sustained: Array, barriers: Barriers, relative: Array, duration: float) -> None:
    """Bring the sustained speeds (P,) [m/s] up to date after `duration` [s]: means over d / U, as beside particles.

    relative (S, 2) [m/s]: velocity of the water relative to each segment.
    """
    draft = np.maximum(np.repeat(barriers.draft, 2), STANDOFF)  # outlines have none
    sustained += passed_share(sustained, draft, duration) * (normal_speeds(barriers, relative) - sustained)


def slacken(slack: Array, barriers: Barriers, relative: Array, duration: float) -> None:
    """Bring the slack (P,) [-] of pools up to date after `duration` [s]: the way that water has run back from the segment, in RETREATs.

    relative (S, 2) [m/s]: velocity of the water relative to each segment. The way shortens while the water presses. It stays from 0 to 1.
    """
    farthest = RETREAT * np.maximum(np.repeat(barriers.draft, 2), STANDOFF)
    np.clip(slack - duration * normal_speeds(barriers, relative) / farthest, 0.0, 1.0, out=slack)


def measure_pools(
    parcels: Parcels, barriers: Barriers, relative: Array, sustained: Array, water_density: float, friction: float
) -> Pools:
    """Compute the state of all pools.

    relative (S, 2) [m/s]: velocity of the water relative to each segment; sustained (P,) [m/s], see `Pools`; water_density [kg/m3];
    friction C_f [-].
    """
    segment = np.repeat(np.arange(len(barriers)), 2)
    side = np.tile(np.array([1, -1]), len(barriers))
    length, speed = barriers.lengths()[segment], np.hypot(*relative.T)[segment]
    normal_speed = normal_speeds(barriers, relative)
    volume, density, viscosity, tension = _sums_of_pools(parcels, len(barriers))
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = np.where(speed > 0.0, np.abs(normal_speed) / speed, 0.0)
    front = length * np.maximum(cosine, LEAST_FRONT)
    pressed = (normal_speed > 0.0) & (volume > 0.0)
    head, thick, reach = np.zeros((3, len(segment)))
    weaker = reduced_gravity(density[pressed], water_density)
    head[pressed] = head_thickness(normal_speed[pressed], weaker)
    growth = thickening(normal_speed[pressed], weaker, density[pressed] / water_density, friction)
    thick[pressed] = boom_thickness(head[pressed], growth, volume[pressed] / front[pressed])
    reach[pressed] = distance_to(thick[pressed], growth, head[pressed])
    return Pools(
        segment, side, length, front, normal_speed, speed, barriers.draft[segment], barriers.lean[segment],
        barriers.freeboard[segment], barriers.is_submerged[segment], barriers.is_sealed[segment], volume, volume / front,
        head, thick, reach, density, viscosity, tension, water_density, np.maximum(sustained, 0.0),
    )  # fmt: skip


def release_slack(parcels: Parcels, slack: Array) -> bool:
    """Let the oil of pools whose slack (P,) [-] is 1 float freely, from where it lies now; return whether there is any.

    In waves water runs to and fro, and oil with it, but the boom still holds it.
    """
    held = np.flatnonzero(parcels.state == ParcelState.HELD)
    free = held[slack[pool_of(parcels, held)] >= 1.0]
    parcels.state[free] = ParcelState.AFLOAT
    parcels.detach(free)
    return len(free) > 0


def _slope_speeds(pools: Pools, barriers: Barriers, friction: float, duration: float) -> Array:
    """Speeds (P, 2) [m/s] along each segment by the pool's slope, at its start and its end; positive towards its end.

    A little oil has little head: its thickness counts by the share L / (5 h_b) of a head, as in the closures. Else the first oil that came
    to an apex would be pushed out of it.
    """
    whole = HEAD_LENGTH * pools.thickness
    head = np.minimum(1.0, np.divide(pools.reach, whole, out=np.zeros_like(whole), where=whole > 0.0)) * pools.thickness
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
        there = np.where(other >= 0, head[beyond], 0.0)
        span = 0.5 * (pools.length[oil] + np.where(other >= 0, pools.length[beyond], 0.0))
        fall = (head[oil] ** 2 - there**2) / span
        speeds[oil, end] = (2 * end - 1) * np.clip(mobility * fall, -wave, wave)
    return speeds


def slide(
    parcels: Parcels, barriers: Barriers, pools: Pools, relative: Array, duration: float, friction: float
) -> Rows:
    """Move held parcels along their segments and over joints for `duration` [s]; return the rows (M,) lost around free ends.

    relative (S, 2) [m/s]: velocity of the water relative to each segment; friction C_f [-].
    """
    held, lines = _held(parcels), _lines(barriers)
    carried = np.einsum("sk,sk->s", relative, lines.way) / lines.length
    gone = np.empty(len(held.rows), np.bool_)
    slide_parcels(held, lines, carried, _slope_speeds(pools, barriers, friction, duration), duration, gone)
    _even_out(parcels, held.rows[~gone], pools, duration)
    return np.asarray(held.rows[gone])


def _even_out(parcels: Parcels, rows: Rows, pools: Pools, duration: float) -> None:
    """Spread the parcels of each pool (rows (M,)) evenly about their middle, as fast as a gravity current, for `duration` [s].

    They keep their order. A pool has one thickness, so its oil lies evenly.
    (Parcels that gathered at a joint went over it all at once, and to and fro.)
    """
    pool, volume = pool_of(parcels, rows), parcels.volume[rows]
    order = np.lexsort((parcels.id[rows], parcels.along[rows], pool))
    rows, pool, volume = rows[order], pool[order], volume[order]
    total = sums(pool, volume, len(pools.volume))
    before = np.cumsum(volume) - 0.5 * volume - (np.cumsum(total) - total)[pool]
    middle = sums(pool, volume * parcels.along[rows], len(total)) / np.where(total > 0.0, total, 1.0)
    wanted = np.clip(before / total[pool] - 0.5 + middle[pool], 0.0, 1.0) - parcels.along[rows]
    wave = np.sqrt(np.maximum(reduced_gravity(pools.density, pools.water_density) * pools.thickness, 0.0))
    farthest = (wave * duration / pools.length)[pool]
    parcels.along[rows] += np.clip(wanted, -farthest, farthest)


def _aims(barriers: Barriers, pools: Pools, duration: float, friction: float) -> Aims:
    """Say where parcels of the pools lie, after `duration` [s] at most; friction C_f [-].

    The profile's way x is along the flow. Square to a segment that lies askew to it, the pool reaches x cos(a), with a between the flow and
    the normal: there K is K / cos(a), and the oil of a metre of the segment V' cos(a).
    """
    oil = (pools.volume > 0.0) & (pools.normal_speed > 0.0)
    away = pools.side[:, None] * barriers.normals()[pools.segment]
    growth, travel, cosine = np.ones(len(oil)), np.zeros(len(oil)), np.ones(len(oil))
    weaker, ratio = reduced_gravity(pools.density[oil], pools.water_density), pools.density[oil] / pools.water_density
    cosine[oil] = pools.normal_speed[oil] / pools.speed[oil]
    growth[oil] = thickening(pools.normal_speed[oil], weaker, ratio, friction) / cosine[oil]
    travel[oil] = duration * (pools.normal_speed[oil] + np.sqrt(weaker * pools.thickness[oil]))
    return Aims(away, growth, pools.thickness, pools.volume_per_front * cosine, travel, oil)


def arrange(parcels: Parcels, barriers: Barriers, pools: Pools, duration: float, friction: float) -> None:
    """Put held parcels at their places in the pools' profiles, as far as they get in `duration` [s]; none passes a barrier.

    duration [s] of the step; friction C_f [-].
    """
    aims = _aims(barriers, pools, duration, friction)
    place_parcels(_held(parcels), _lines(barriers), aims, resting_sweep(barriers), parcels.position)


def lose_around_ends(parcels: Parcels, barriers: Barriers, rows: Rows) -> Array:
    """Let the parcels of rows (M,) float on beyond the free ends; return their volume by cause and segment (causes, S) [m3].

    They are lost around the ends, or through the joint where one has parted.
    """
    place, along = parcels.place[rows], parcels.along[rows]
    parted = barriers.parted_ends[place, (along > 0.5).astype(np.int64)]
    cause = np.where(parted, int(LossCause.THROUGH), int(LossCause.AROUND_ENDS))
    volume = np.zeros((len(LossCause), len(barriers)))
    np.add.at(volume, (cause, place), parcels.volume[rows])
    resting = resting_sweep(barriers)
    near = beside(barriers, place, along, parcels.side[rows], resting)
    outward = np.where(along[:, None] > 0.5, 1.0, -1.0) * (barriers.end - barriers.start)[place]
    beyond = barriers.points(place, np.round(along)) + STANDOFF * outward / barriers.lengths()[place, None]
    free = first_crossings(near, beyond, resting).segment < 0
    parcels.position[rows] = np.where(free[:, None], beyond, near)
    parcels.state[rows] = ParcelState.LOST
    parcels.mark_lost(rows, cause, barriers.owner[place], carried=False)
    parcels.detach(rows)
    return volume


def hold(parcels: Parcels, rows: Rows, segment: Rows, along: Array, side: Rows) -> None:
    """Give the parcels of rows (M,) to the pools on a side (M,) of segments (M,), at shares along (M,) [-] of their lengths."""
    parcels.state[rows] = ParcelState.HELD
    parcels.mark_found(rows)
    parcels.place[rows], parcels.side[rows] = segment, side
    parcels.along[rows], parcels.ahead[rows] = np.clip(along, 0.0, 1.0), 0.0


def head_thickness(speed: Array, reduced_gravity: Array) -> Array:
    """Compute the thickness of the slick's head, h_f = U^2 / (2 g') [m]; speed U (P,) [m/s], reduced_gravity g' (P,) [m/s2]."""
    return np.asarray(speed * speed / (2.0 * reduced_gravity))


def thickening(speed: Array, reduced_gravity: Array, density_ratio: Array, friction: float) -> Array:
    """Compute K = C_f (rho_w / rho_o) U^2 / g' (P,) [m].

    speed U (P,) [m/s]; reduced_gravity (P,) [m/s2]; density_ratio rho_o / rho_w (P,) [-]; friction C_f [-].
    """
    return np.asarray(friction / density_ratio * speed * speed / reduced_gravity)


def boom_thickness(head: Array, growth: Array, volume_per_front: Array) -> Array:
    """Compute the thickness at the boom h_b (P,) [m] of oil with a head h_f (P,) [m], growth K (P,) [m] and V' (P,) [m2]."""
    return np.asarray(np.cbrt(head**3 + 1.5 * growth * volume_per_front))


def distance_to(thickness: Array, growth: Array, local: Array) -> Array:
    """Compute the distance from the boom (N,) [m] at which a slick that is h_b (N,) [m] thick there is `local` (N,) [m] thick.

    growth K (N,) [m].
    """
    return np.asarray((thickness**2 - local**2) / growth)


def reduced_gravity(density: Array, water_density: float) -> Array:
    """Compute g' = g (1 - rho_o / rho_w) (P,) [m/s2] of oil with density (P,) [kg/m3]."""
    return np.asarray(GRAVITY * (1.0 - density / water_density))

"""The standing of oil particles towards booms: which ones a boom holds, which it has lost, and by what cause.

Resolved by the particles, and only classified here: what flows under the skirt, over the top, around the ends or
through the line of the boom, for parcels of at least one particle. Modelled by the closures of `booms.losses`: what is finer than a
particle, first of all droplets torn off the oil's head wave. The closures tell the account of each particle that they carry out
(`Containment.lose`), and both kinds of loss are kept apart. The oil ledger (`oilsim.oil.ledger`) reads the volumes here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from booms.boom_state import BoomState, beside, signed_distance
from booms.scores import PLANING_ANGLE, VISCOUS_LIMIT
from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.core.physical_constants import HOUR, NAUTICAL_MILE
from oilsim.oil.fates import Fate, LossCause
from oilsim.oil.ledger import BoomOil, OilRows, by_cause, rows_of

PRACTICE_SPEED = 0.7 * NAUTICAL_MILE / HOUR
"""Speed normal to a boom, 0.7 knots [m/s], above which booms lose oil in practice."""


RESOLVED = "oil in parcels of a particle or more that goes under the skirt, over the boom, past its ends or between its sections"
MODELLED = "by closures, what is finer than a particle: droplet entrainment, and drainage and overflow as far as particles fall short"


class _Fate(IntEnum):
    """Standing of a particle towards a boom."""

    FREE = 0
    RETAINED = 1
    LOST = 2


@dataclass(frozen=True, kw_only=True)
class ContainmentOptions:
    """Rules and sizes by which a boom's oil is told.

    skirt_depth, freeboard [m] of the boom at its design waterline; particle_volume [m3]; hysteresis [m]: how far past
    the boom's line a particle must be to count as lost, or as back inside; one particle spacing is sensible.
    entrainment_speed [m/s] normal to the boom: 0.7 knots in practice, whatever the size of the boom.
    period [m] of the sea along x and y, 0 along an axis on which it does not repeat: inside is inside across its periodic sides.

    Raises ValueError for a size, volume or entrainment speed that is not above 0.
    """

    skirt_depth: float
    freeboard: float
    particle_volume: float
    hysteresis: float
    kinematic_viscosity: float = 0.0
    entrainment_speed: float = PRACTICE_SPEED
    period: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("skirt_depth", "freeboard", "particle_volume", "hysteresis", "entrainment_speed"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"containment: {name} is {getattr(self, name):g}, allowed: above 0")


@dataclass(frozen=True, kw_only=True, eq=False)
class Standing:
    """Standing of the particles that are held or lost.

    ids (N,), increasing; retained (N,); lost_at (N,) [s], -inf unless lost; cause (N,) of those lost; modelled (N,): carried out by a
    closure; segment (N,) that those lost passed, as many as there are segments for those that passed the gap.
    """

    ids: Ints
    retained: Flags
    lost_at: Array
    cause: NDArray[np.int8]
    modelled: Flags
    segment: NDArray[np.int16]


_BY_PARTICLE = (
    "_fate", "_was_inside", "_cause", "_known", "_lost_at", "_modelled", "_segment", "_place", "_wrapped",
)  # fmt: skip


class Containment:
    """The standing of every oil particle towards one boom, by its id, from update to update.

    A particle is inside if it lies in the polygon of the boom's line, closed across the gap. It is retained once it is inside. It is lost
    once it is farther outside than the hysteresis, and retained again once it is that far inside: re-contained, or returned if it has
    meanwhile come round a sea that repeats. The cause is chosen when the particle crosses the line, by the edge that it is nearest to,
    and becomes final when the particle is lost:

    - across the gap: AROUND_ENDS;
    - under the skirt's foot, by the first rule that applies: PLANING, if the skirt leans more than 45 degrees;
      CRITICAL_ACCUMULATION, if the oil is more viscous than 3000 cSt; DRAINAGE, if retained oil reaches down to the foot or the speed
      normal to the segment is below the entrainment speed; else ENTRAINMENT;
    - higher up: SUBMERGENCE, if the segment's top is below the still-water level; SPLASH_OVER, if the particle is above the top; else
      THROUGH (a leak at a joint).

    Foot and top have a tolerance of half a hysteresis, because a particle has a size.
    """

    def __init__(self, options: ContainmentOptions) -> None:
        self.options = options
        self._fate = np.zeros(0, dtype=np.int8)
        self._was_inside = np.zeros(0, dtype=np.bool_)
        self._cause = np.zeros(0, dtype=np.int8)
        self._known = np.zeros(0, dtype=np.bool_)
        self._lost_at = np.zeros(0)  # [s], of those that are lost
        self._modelled = np.zeros(0, dtype=np.bool_)
        self._segment = np.zeros(0, dtype=np.int16)
        self._place = np.zeros((0, 2))  # [m] in plan, at the last update
        self._wrapped = np.zeros(0, dtype=np.bool_)  # has come round a sea that repeats since it was lost
        self._recontained, self._returned, self._returned_modelled = 0, 0, 0

    def update(
        self,
        time: float,
        boom: BoomState,
        position: NDArray[np.floating],
        ids: NDArray[np.integer],
        *,
        water_level: float,
        current: tuple[float, float] = (0.0, 0.0),
    ) -> BoomOil:
        """Bring all to `time` [s] with the oil particles in the water: position (N, 3) [m], ids (N,); return the boom's oil."""
        index = ids.astype(np.int64)
        self._make_room(index)
        line = boom.line()
        points = beside(np.asarray(position, dtype=np.float64), line, self.options.period)
        signed, edge = signed_distance(points[:, :2], line)
        inside = signed > 0.0
        self._settle_causes(index, points, inside, edge, boom, water_level, np.array(current))
        self._note_ways_round(index, points)
        self._settle_fates(time, index, signed, inside)
        self._was_inside[index] = inside
        present = np.zeros(len(self._fate), dtype=np.bool_)
        present[index] = True
        return self._oil(present, inside)

    def lose(self, time: float, particle: int, cause: LossCause, segment: int) -> None:
        """Count a retained particle as lost at `time` [s] by a closure, which has carried it past `segment`.

        Raises ValueError for a particle that the boom does not hold.
        """
        if not (0 <= particle < len(self._fate) and self._fate[particle] == _Fate.RETAINED):
            raise ValueError(f"particle {particle} is not held by the boom, allowed: one that is")
        self._fate[particle], self._cause[particle], self._lost_at[particle] = _Fate.LOST, cause, time
        self._modelled[particle], self._segment[particle], self._was_inside[particle] = True, segment, False
        self._wrapped[particle] = False

    def standing(self) -> Standing:
        """Return the standing of the particles that are held or lost, which are few in a sea."""
        ids = np.flatnonzero(self._fate != _Fate.FREE)
        fate, lost_at = self._fate[ids], self._lost_at[ids]
        return Standing(
            ids=ids,
            retained=fate == _Fate.RETAINED,
            lost_at=np.where(fate == _Fate.LOST, lost_at, -np.inf),
            cause=self._cause[ids],
            modelled=self._modelled[ids],
            segment=self._segment[ids],
        )

    def save_state(self) -> dict[str, object]:
        """Return everything that is needed to go on from here."""
        arrays = {name: getattr(self, name).copy() for name in _BY_PARTICLE}
        counts = ("_recontained", "_returned", "_returned_modelled")
        return arrays | {name: getattr(self, name) for name in counts}

    def restore_state(self, state: Mapping[str, object]) -> None:
        """Go back to a state that `save_state` returned."""
        for name, value in state.items():
            setattr(self, name, value.copy() if isinstance(value, np.ndarray) else value)

    def _make_room(self, index: Ints) -> None:
        """Make room up to the largest id."""
        missing = (int(index.max()) + 1 if len(index) else 0) - len(self._fate)
        if missing > 0:
            for name in _BY_PARTICLE:
                old = getattr(self, name)
                setattr(self, name, np.concatenate([old, np.zeros((missing, *old.shape[1:]), dtype=old.dtype)]))

    def _settle_causes(
        self,
        index: Ints,
        points: Array,
        inside: Flags,
        edge: Ints,
        boom: BoomState,
        water_level: float,
        current: Array,
    ) -> None:
        """Note the cause for every retained particle that has crossed the line outward since the last update."""
        retained = self._fate[index] == _Fate.RETAINED
        crossed = self._was_inside[index] & ~inside & retained
        if not crossed.any():
            return
        pool = points[retained & inside]
        crossings = _Crossings(
            height=points[crossed, 2],
            edge=edge[crossed],
            pool_bottom=self._pool_bottom(pool, boom, water_level)[np.minimum(edge[crossed], len(boom.position) - 1)],
        )
        self._cause[index[crossed]] = _causes(crossings, boom, water_level, current, self.options)
        self._segment[index[crossed]] = edge[crossed]

    def _pool_bottom(self, pool: Array, boom: BoomState, water_level: float) -> Array:
        """Return the height (S,) [m] down to which retained oil reaches at each segment: the 5 % quantile of the oil nearby."""
        bottom = np.full(len(boom.position), water_level)
        reach = 2.0 * self.options.hysteresis + 0.5 * np.linalg.norm(boom.joint_points[1] - boom.joint_points[0])
        for k, center in enumerate(boom.position[:, :2]):
            near = pool[((pool[:, :2] - center) ** 2).sum(axis=1) < reach**2, 2]
            if len(near):
                bottom[k] = np.quantile(near, 0.05)
        return bottom

    def _note_ways_round(self, index: Ints, points: Array) -> None:
        """Mark the particles that have moved by a period of the sea since the last update: nothing else jumps half a period."""
        period = np.array(self.options.period)
        if (period > 0.0).any():
            far = np.abs(points[:, :2] - self._place[index]) > 0.5 * np.where(period > 0.0, period, np.inf)
            self._wrapped[index] |= far.any(axis=1)
            self._place[index] = points[:, :2]

    def _settle_fates(self, time: float, index: Ints, signed: Array, inside: Flags) -> None:
        """Move particles between free, retained and lost."""
        fate, margin = self._fate[index], self.options.hysteresis
        back = (fate == _Fate.LOST) & (signed > margin)
        gathered = (fate == _Fate.FREE) & ((signed > margin) | (inside & ~self._known[index]))
        gone = (fate == _Fate.RETAINED) & (signed < -margin)
        round_again = back & self._wrapped[index]
        self._recontained += int((back & ~round_again).sum())
        self._returned += int(round_again.sum())
        self._returned_modelled += int((round_again & self._modelled[index]).sum())
        self._wrapped[index[gone]] = False
        fate[back | gathered] = _Fate.RETAINED
        fate[gone] = _Fate.LOST
        self._lost_at[index[gone]] = time
        self._modelled[index[gone | back]] = False
        self._fate[index] = fate
        self._known[index] = True

    def _oil(self, present: Flags, inside: Flags) -> BoomOil:
        """Return the boom's oil; lost particles stay in it when they leave the water, where those of the mask `present` are."""
        volume, held = self.options.particle_volume, self._fate == _Fate.RETAINED
        lost = self._known & (self._fate == _Fate.LOST)
        count, modelled = (
            np.bincount(self._cause[which], minlength=len(LossCause)) for which in (lost, lost & self._modelled)
        )
        return BoomOil(
            inside=float(inside.sum()) * volume,
            outside=float((~inside).sum()) * volume,
            contained=float((present & held).sum()) * volume,
            afloat=float((present & (self._fate == _Fate.FREE)).sum()) * volume,
            recontained=self._recontained * volume,
            returned=self._returned * volume,
            returned_modelled=self._returned_modelled * volume,
            lost=by_cause(count * volume),
            lost_modelled=by_cause(modelled * volume),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Crossings:
    """Particles that have just crossed the line: height [m], the edge they crossed, and the bottom [m] of the pool there."""

    height: Array
    edge: Ints
    pool_bottom: Array


def _causes(
    crossings: _Crossings, boom: BoomState, water_level: float, current: Array, options: ContainmentOptions
) -> NDArray[np.int8]:
    """Choose the cause of each crossing by the rules of `Containment`."""
    segment = np.minimum(crossings.edge, len(boom.position) - 1)
    top, foot = (height[segment] for height in boom.heights(options.freeboard, options.skirt_depth))
    grace = 0.5 * options.hysteresis
    drains = (crossings.pool_bottom <= foot + grace) | (boom.normal_speed(current)[segment] < options.entrainment_speed)
    under = crossings.height <= foot + grace
    viscous = options.kinematic_viscosity > VISCOUS_LIMIT
    rules = [
        (crossings.edge >= len(boom.position), LossCause.AROUND_ENDS),
        (under & (boom.skirt_angle()[segment] > PLANING_ANGLE), LossCause.PLANING),
        (under & viscous, LossCause.CRITICAL_ACCUMULATION),
        (under & drains, LossCause.DRAINAGE),
        (under, LossCause.ENTRAINMENT),
        (top < water_level, LossCause.SUBMERGENCE),
        (crossings.height > top - grace, LossCause.SPLASH_OVER),
    ]
    choice = np.select([rule for rule, _ in rules], [int(cause) for _, cause in rules], int(LossCause.THROUGH))
    return choice.astype(np.int8)


class ParticleFates(NamedTuple):
    """Fates of oil particles, codes of `FATES`, each particle once whatever the booms' own accounts say.

    fate, modelled            (N,) of those in the water, and whether a closure carried out what is lost
    gone_fate, gone_modelled  (M,) of the lost ones that have left the water
    """

    fate: Ints
    modelled: Flags
    gone_fate: Ints
    gone_modelled: Flags


_NONE_GONE = np.zeros(0, np.int64), np.zeros(0, np.bool_)


def fates_of(booms: Sequence[Containment], ids: NDArray[np.integer]) -> ParticleFates:
    """Return the fates of the particles of oil; `ids` (N,) are those in the water now, and every boom has been updated with them.

    What a boom holds is contained, else what booms have lost is lost by the cause at the one that lost it last, of equals the first one.
    """
    standings = [boom.standing() for boom in booms]
    if not standings:
        return ParticleFates(np.full(len(ids), int(Fate.AFLOAT)), np.zeros(len(ids), np.bool_), *_NONE_GONE)
    seen = np.unique(np.concatenate([ids.astype(np.int64), *(standing.ids for standing in standings)]))
    fate, held = np.full(len(seen), int(Fate.AFLOAT)), np.zeros(len(seen), np.bool_)
    lost_at, modelled = np.full(len(seen), -np.inf), np.zeros(len(seen), np.bool_)
    for standing in standings:
        row = np.searchsorted(seen, standing.ids)
        held[row] |= standing.retained
        later = standing.lost_at > lost_at[row]
        fate[row[later]], lost_at[row[later]] = Fate.LOST + standing.cause[later], standing.lost_at[later]
        modelled[row[later]] = standing.modelled[later]
    fate[held] = Fate.CONTAINED
    here, gone = np.searchsorted(seen, ids), fate >= Fate.LOST
    gone[here] = False
    return ParticleFates(fate[here], modelled[here], fate[gone], modelled[gone])


def particle_rows(
    booms: Sequence[Containment], ids: NDArray[np.integer], volume: float, *, spilled: float, left: int
) -> OilRows:
    """Return the rows of all oil that is particles of `volume` [m3], those in the water with `ids` (N,).

    spilled [m3] since the start; left: number of particles that have left the water.
    """
    fates = fates_of(booms, ids)
    fate, modelled = (
        np.concatenate([fates.fate, fates.gone_fate]),
        np.concatenate([fates.modelled, fates.gone_modelled]),
    )
    return rows_of(spilled, volume, fate, modelled, left_the_domain=(left - len(fates.gone_fate)) * volume)

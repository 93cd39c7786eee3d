"""The oil that a towed boom holds, and the ways by which the rest was lost.

Resolved by the particles, and only classified here: what flows under the skirt, over the top, around the ends or
through the line of the boom, for parcels of at least one particle. Modelled by the closures of `booms.losses`: what is finer than a
particle, first of all droplets torn off the oil's head wave. The closures tell the account of each particle that they carry out
(`ContainmentTracker.lose`), and the account keeps both kinds of loss apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from booms.boom_state import BoomState, beside, signed_distance
from booms.scores import PLANING_ANGLE, VISCOUS_LIMIT
from oilsim.core.physical_constants import HOUR, NAUTICAL_MILE
from oilsim.slick.loss_cause import CAUSES, LossCause

Array = NDArray[np.float64]

PRACTICE_SPEED = 0.7 * NAUTICAL_MILE / HOUR
"""Speed normal to a boom, 0.7 knots [m/s], above which booms lose oil in practice."""


RESOLVED = "oil in parcels of a particle or more that goes under the skirt, over the boom, past its ends or between its sections"
MODELLED = "by closures, what is finer than a particle: droplet entrainment, and drainage and overflow as far as particles fall short"


class _Fate(IntEnum):
    """Standing of a particle in the account."""

    FREE = 0
    RETAINED = 1
    LOST = 2


@dataclass(frozen=True, kw_only=True)
class ContainmentOptions:
    """Rules and sizes that the account goes by.

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


@dataclass(frozen=True, kw_only=True)
class ContainmentReport:
    """The account of a boom at one time [s]; volumes in m3.

    inside, outside       all oil in the water, by its place in plan
    retained, free, lost  the oil by its history; free oil has never been inside
    removed               oil that has left the simulated water without being lost
    recovered             oil that was lost and taken back, summed over time
    returned              oil that was lost, left the sea across a side that repeats, and came in again, summed over time
    returned_modelled     the part of it that closures had carried out
    lost_by_cause         the oil that is lost now, by cause
    lost_modelled         the part of it that closures carried out, by cause; the rest is resolved
    normal_speed [m/s], skirt_angle [rad]  largest along the boom
    effective_draft [m]   smallest along the boom; gap_ratio [-]
    """

    time: float
    inside: float
    outside: float
    retained: float
    free: float
    lost: float
    removed: float
    recovered: float
    returned: float
    returned_modelled: float
    lost_by_cause: Mapping[str, float]
    lost_modelled: Mapping[str, float]
    gap_ratio: float
    normal_speed: float
    effective_draft: float
    skirt_angle: float

    @property
    def passed(self) -> float:
        """Return the oil [m3] that has gone past the boom since the start, less what the boom took back.

        Oil that came in again across a side that repeats has passed: to a boom at sea it would be other oil.
        """
        return self.lost + self.returned

    @property
    def passed_modelled(self) -> float:
        """Return the part [m3] of `passed` that closures carried out."""
        return math.fsum(self.lost_modelled.values()) + self.returned_modelled

    def scalars(self) -> dict[str, float]:
        """Return the account by the names of its series in a recording."""
        names = ("retained", "free", "lost", "removed", "recovered", "inside", "outside")
        values = {f"metrics/oil_{name}": float(getattr(self, name)) for name in names}
        values |= {f"metrics/oil_lost/{cause}": volume for cause, volume in self.lost_by_cause.items()}
        values |= {f"metrics/oil_lost_modelled/{cause}": volume for cause, volume in self.lost_modelled.items()}
        values["metrics/oil_lost_modelled"] = math.fsum(self.lost_modelled.values())
        values |= {"metrics/oil_passed": self.passed, "metrics/oil_passed_modelled": self.passed_modelled}
        shape = ("gap_ratio", "normal_speed", "effective_draft", "skirt_angle")
        return values | {f"metrics/{name}": float(getattr(self, name)) for name in shape}


@dataclass(frozen=True, kw_only=True, eq=False)
class Standing:
    """Standing of the particles that are held or lost.

    ids (N,), increasing; retained (N,); lost_at (N,) [s], -inf unless lost; cause (N,) of those lost; modelled (N,): carried out by a
    closure; segment (N,) that those lost passed, as many as there are segments for those that passed the gap.
    """

    ids: NDArray[np.int64]
    retained: NDArray[np.bool_]
    lost_at: Array
    cause: NDArray[np.int8]
    modelled: NDArray[np.bool_]
    segment: NDArray[np.int16]


_BY_PARTICLE = ("_fate", "_was_inside", "_cause", "_known", "_lost_at", "_modelled", "_segment", "_place", "_wrapped")


class ContainmentTracker:
    """The account of every oil particle by its id, from update to update.

    A particle is inside if it lies in the polygon of the boom's line, closed across the gap. It is retained once it is inside. It is lost
    once it is farther outside than the hysteresis, and retained again once it is that far inside: taken back, or returned if it has
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
        self._recovered, self._returned, self._returned_modelled = 0, 0, 0

    def update(
        self,
        time: float,
        boom: BoomState,
        position: NDArray[np.floating],
        ids: NDArray[np.integer],
        *,
        water_level: float,
        current: tuple[float, float] = (0.0, 0.0),
    ) -> ContainmentReport:
        """Bring the account to `time` [s] with the oil particles in the water: position (N, 3) [m], ids (N,)."""
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
        return self._report(time, index, inside, boom, water_level, np.array(current))

    def update_without_particles(
        self, time: float, boom: BoomState, *, water_level: float, current: tuple[float, float] = (0.0, 0.0)
    ) -> ContainmentReport:
        """Return the report at `time` [s] of a run whose oil is no particles: the boom's shape, and no oil."""
        none = dict.fromkeys(("inside", "outside", "retained", "free", "lost", "removed", "recovered"), 0.0)
        return ContainmentReport(
            time=time,
            **none,
            returned=0.0,
            returned_modelled=0.0,
            lost_by_cause=dict.fromkeys(CAUSES, 0.0),
            lost_modelled=dict.fromkeys(CAUSES, 0.0),
            **self._shape(boom, water_level, np.array(current)),
        )

    def lose(self, time: float, particle: int, cause: LossCause, segment: int) -> None:
        """Count a retained particle as lost at `time` [s] by a closure, which has carried it past `segment`.

        Raises ValueError for a particle that the boom does not hold.
        """
        if not (0 <= particle < len(self._fate) and self._fate[particle] == _Fate.RETAINED):
            raise ValueError(f"particle {particle} is not held by the boom, allowed: one that is")
        self._fate[particle], self._cause[particle], self._lost_at[particle] = _Fate.LOST, cause, time
        self._modelled[particle], self._segment[particle], self._was_inside[particle] = True, segment, False
        self._wrapped[particle] = False
        self._place[particle] = np.nan  # it has changed places: its next way is unknown

    def keep(self, particle: int) -> None:
        """Count a lost particle as retained again, as if it had never been lost; a closure has put it back before the boom."""
        self._fate[particle], self._was_inside[particle] = _Fate.RETAINED, True
        self._place[particle] = np.nan  # as in `lose`

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
        counts = ("_recovered", "_returned", "_returned_modelled")
        return arrays | {name: getattr(self, name) for name in counts}

    def restore_state(self, state: Mapping[str, object]) -> None:
        """Go back to a state that `save_state` returned."""
        for name, value in state.items():
            setattr(self, name, value.copy() if isinstance(value, np.ndarray) else value)

    def _make_room(self, index: NDArray[np.int64]) -> None:
        """Extend the account up to the largest id."""
        missing = (int(index.max()) + 1 if len(index) else 0) - len(self._fate)
        if missing > 0:
            for name in _BY_PARTICLE:
                old = getattr(self, name)
                setattr(self, name, np.concatenate([old, np.zeros((missing, *old.shape[1:]), dtype=old.dtype)]))

    def _settle_causes(
        self,
        index: NDArray[np.int64],
        points: Array,
        inside: NDArray[np.bool_],
        edge: NDArray[np.int64],
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

    def _note_ways_round(self, index: NDArray[np.int64], points: Array) -> None:
        """Mark the particles that have moved by a period of the sea since the last update: nothing else jumps half a period."""
        period = np.array(self.options.period)
        if (period > 0.0).any():
            far = np.abs(points[:, :2] - self._place[index]) > 0.5 * np.where(period > 0.0, period, np.inf)
            self._wrapped[index] |= far.any(axis=1)
            self._place[index] = points[:, :2]

    def _settle_fates(self, time: float, index: NDArray[np.int64], signed: Array, inside: NDArray[np.bool_]) -> None:
        """Move particles between free, retained and lost."""
        fate, margin = self._fate[index], self.options.hysteresis
        back = (fate == _Fate.LOST) & (signed > margin)
        gathered = (fate == _Fate.FREE) & ((signed > margin) | (inside & ~self._known[index]))
        gone = (fate == _Fate.RETAINED) & (signed < -margin)
        round_again = back & self._wrapped[index]
        self._recovered += int((back & ~round_again).sum())
        self._returned += int(round_again.sum())
        self._returned_modelled += int((round_again & self._modelled[index]).sum())
        self._wrapped[index[gone]] = False
        fate[back | gathered] = _Fate.RETAINED
        fate[gone] = _Fate.LOST
        self._lost_at[index[gone]] = time
        self._modelled[index[gone | back]] = False
        self._fate[index] = fate
        self._known[index] = True

    def _report(
        self,
        time: float,
        index: NDArray[np.int64],
        inside: NDArray[np.bool_],
        boom: BoomState,
        water_level: float,
        current: Array,
    ) -> ContainmentReport:
        """Report volumes and the boom's shape now; lost particles stay in the account when they leave the water."""
        volume = self.options.particle_volume
        lost = self._known & (self._fate == _Fate.LOST)
        present = np.zeros(len(self._fate), dtype=np.bool_)
        present[index] = True
        count = np.bincount(self._cause[lost], minlength=len(LossCause))
        modelled = np.bincount(self._cause[lost & self._modelled], minlength=len(LossCause))
        return ContainmentReport(
            time=time,
            inside=float(inside.sum()) * volume,
            outside=float((~inside).sum()) * volume,
            retained=float((present & (self._fate == _Fate.RETAINED)).sum()) * volume,
            free=float((present & (self._fate == _Fate.FREE)).sum()) * volume,
            lost=float(lost.sum()) * volume,
            removed=float((self._known & ~present & ~lost).sum()) * volume,
            recovered=self._recovered * volume,
            returned=self._returned * volume,
            returned_modelled=self._returned_modelled * volume,
            lost_by_cause={cause: float(number) * volume for cause, number in zip(CAUSES, count, strict=True)},
            lost_modelled={cause: float(number) * volume for cause, number in zip(CAUSES, modelled, strict=True)},
            **self._shape(boom, water_level, current),
        )

    def _shape(self, boom: BoomState, water_level: float, current: Array) -> dict[str, float]:
        """Return the figures of the report that tell of the boom, not of the oil."""
        foot = boom.heights(self.options.freeboard, self.options.skirt_depth)[1]
        return {
            "gap_ratio": boom.gap_ratio,
            "normal_speed": float(boom.normal_speed(current).max()),
            "effective_draft": float((water_level - foot).min()),
            "skirt_angle": float(boom.skirt_angle().max()),
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class _Crossings:
    """Particles that have just crossed the line: height [m], the edge they crossed, and the bottom [m] of the pool there."""

    height: Array
    edge: NDArray[np.int64]
    pool_bottom: Array


def _causes(
    crossings: _Crossings, boom: BoomState, water_level: float, current: Array, options: ContainmentOptions
) -> NDArray[np.int8]:
    """Choose the cause of each crossing by the rules of `ContainmentTracker`."""
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

"""Oil crosses a window both ways: parcels of a slick become particles where they lie thick enough, and particles that leave become parcels.

An oil particle is a parcel all the time, in the state RESOLVED: the parcel has its volume d^3, its properties and its fate, and follows the
particle. So volume is exact however oil crosses, and the account of the slick is that of all oil.

    parcels -> particles    in the middle of the window, FADE spacings from the rim or more, where the oil is as thick as a particle is
                            wide, and of the oil that a boom holds also beside particles of oil. Water at the surface becomes oil in place.
    particles -> parcels    as soon as they are in the rim, whose calm would hold them up. The particle becomes water in place.

What does not fill a particle, of a pool or of a square of GROUP spacings, stays parcels. A particle that the fluid loses, as spray or
where a body comes in, leaves its parcel behind; one whose parcel is taken away, by a skimmer, a closure or a skirt that holds it back,
becomes water.

A particle whose way in plan view crosses a boom from the side against which the water presses is lost from then on, and one that crosses
back is not. Its cause is told by its height there: SPLASH_OVER above the boom's top, DRAINAGE below its foot, within half of its own edge,
THROUGH between them, and where it passes the opening of a boom that has parted. Droplets that a current tears off are smaller than
particles; closures go on to take them out of the pools.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from oilsim.backend.arrays import Array, Flags
from oilsim.backend.jit import njit
from oilsim.oil.fates import LossCause
from oilsim.slick.barriers import Barriers
from oilsim.slick.crossing import first_crossings, moving_sweep, resting_sweep
from oilsim.slick.losses import lose_through_openings
from oilsim.slick.merging import KEYS, MEANS
from oilsim.slick.parcels import NONE, Parcels, ParcelState, Rows
from oilsim.slick.slick import Slick
from oilsim.window.water_motion import WaterMotion
from oilsim.window.window import Window

# [d] from the rim within which parcels stay parcels; numerical; a support, so that oil does not change back at once
FADE = 2.75
# [d] across a square in which parcels afloat are gathered into particles; numerical; a support
GROUP = 2.75
# [d] in plan from a particle of oil within which the oil that a boom holds joins it; numerical; a support
BESIDE = 2.75
# [d] within which water for a particle of oil is looked for; numerical; two supports
CHOICE = 5.5
# [1] of a particle's volume that may be lacking or over; numerical; above rounding of sums
ROUNDING = 1e-12


class OilExchange:
    """Exchanges oil between a window and a slick; one of each. `taken`, `given` [m3]: oil that became particles, and parcels, so far."""

    def __init__(self, window: Window, oils: Sequence[str] | None = None) -> None:
        """Exchange all oils of a window; ValueError for one that has no oil among its liquids.

        oils: the window's liquids that are oil, in the order of `Oil.number`; by default all but the first.
        """
        self.window, self._config = window, window.fluid.config
        water = self._config.phases[0].name
        self._water = water
        self._oils = [one.name for one in self._config.phases[1:]] if oils is None else list(oils)
        if not self._oils:
            raise ValueError(f"the window's liquids are {water}, allowed: water and an oil or more")
        self.surface = WaterMotion(window)
        self.taken = self.given = 0.0

    def places(self, parcels: Parcels, time: float) -> tuple[Rows, Array]:
        """Return the rows (M,) of resolved parcels, and where their particles are at `time` [s], (M, 3) [m]."""
        rows = self._resolved(parcels)
        index = self._index_of(parcels.particle[rows])
        rows, index = rows[index >= 0], index[index >= 0]
        return rows, self.window.motion.in_sea(self._rest(index), time)

    def save_state(self) -> dict[str, float]:
        """Return what has been exchanged; all else is the fluid's and the slick's."""
        return {"taken": self.taken, "given": self.given}

    def restore_state(self, saved: Mapping[str, float]) -> None:
        """Go back to what `save_state` returned."""
        self.taken, self.given = saved["taken"], saved["given"]

    @property
    def volume(self) -> float:
        """Volume [m3] of a particle."""
        return float(self._config.rest_volume)

    # before a step of the slick

    def follow(self, slick: Slick, relative: Array, time: float) -> None:
        """Bring resolved parcels to where their particles are at `time` [s], after the barriers were told where they are then.

        relative (S, 2) [m/s]: velocity of the water relative to the slick's segments.
        """
        self.surface.measure(time)
        parcels = slick.parcels
        rows = self._resolved(parcels)
        if not len(rows):
            return
        index = self._index_of(parcels.particle[rows])
        self._free(parcels, rows[index < 0])
        rows, index = rows[index >= 0], index[index >= 0]
        rest = self._rest(index)
        places = self.window.motion.in_sea(rest, time)
        height = rest[:, 2] - self.window.motion.sea.description.level
        follow_particles(slick, rows, places[:, :2], height, relative)

    def _resolved(self, parcels: Parcels) -> Rows:
        """Return the rows (M,) of parcels that are particles."""
        return np.flatnonzero(parcels.state == ParcelState.RESOLVED)

    def _index_of(self, ids: Rows) -> Rows:
        """Return where particles of oil (M,) are in the state, -1 for those that are no more, or no oil."""
        state = self.window.fluid.state
        oil = np.flatnonzero(state.phase > 0)
        if not len(oil):
            return np.full(len(ids), -1)
        oil = oil[np.argsort(state.id[oil])]
        at = oil[np.minimum(np.searchsorted(state.id[oil], ids), len(oil) - 1)]
        return np.where(state.id[at] == ids, at, -1)

    def _rest(self, index: Rows | slice = slice(None)) -> Array:
        """Return places at rest (M, 3) [m] of particles, about the window's middle."""
        return self.window.rim.about_center(self.window.fluid.state.position[:, index].T)

    # after a step of the slick

    def exchange(self, slick: Slick, time: float) -> None:
        """Let particles in the rim become parcels, and thick parcels in the middle particles."""
        self._give_back(slick.parcels)
        self._take(slick, time)

    def _give_back(self, parcels: Parcels) -> None:
        """Turn oil in the rim, and oil of which the slick has lost sight (a skimmer or a closure took it), into water."""
        state = self.window.fluid.state
        oil = np.flatnonzero(state.phase > 0)
        if not len(oil):
            return
        resolved = self._resolved(parcels)
        in_rim = self.window.rim.inward(state.position[:, oil].T) < self.window.rim.width
        leaving = state.id[oil[in_rim]]
        orphans = ~np.isin(state.id[oil], parcels.particle[resolved])
        rows = resolved[np.isin(parcels.particle[resolved], leaving)]
        self._free(parcels, rows)
        self.given += self.volume * int((in_rim | orphans).sum())
        ids = state.id[oil[in_rim | orphans]]
        if ids.size:
            self.window.fluid.finish_step()  # in which some may leave the window, upwards
            self.window.fluid.change_phase(ids[np.isin(ids, state.id)], self._water)

    def _free(self, parcels: Parcels, rows: Rows) -> None:
        """Let resolved parcels of rows (M,) drift on their own."""
        fate = np.where(
            parcels.cause[rows] == NONE, int(ParcelState.AFLOAT), int(ParcelState.LOST)
        )  # none is held where it is now
        parcels.state[rows], parcels.particle[rows] = fate, NONE
        parcels.thickness[rows] = self._config.particle_spacing
        parcels.detach(rows)

    def _take(self, slick: Slick, time: float) -> None:
        parcels, spacing = slick.parcels, self._config.particle_spacing
        drifting = np.isin(parcels.state, (ParcelState.AFLOAT, ParcelState.HELD, ParcelState.LOST))
        rows = np.flatnonzero(drifting & self._is_near(parcels.position, time))
        if not len(rows):
            return
        rest = self._plan_at_rest(parcels.position[rows], time)
        middle = self.window.rim.inward(rest) > self.window.rim.width + FADE * spacing
        thick = parcels.thickness[rows] >= spacing
        asked = np.flatnonzero(middle & ~thick & (parcels.state[rows] == ParcelState.HELD))
        thick[asked] = self._beside_oil(parcels.position[rows[asked]], parcels)
        rows = rows[middle & thick]
        for group in _groups(parcels, rows, GROUP * spacing):
            self._resolve(slick, group, time)
        if len(rows):
            parcels.keep(parcels.volume > 0.0)

    def _is_near(self, position: Array, time: float) -> Flags:
        """Mark parcels (N,) in the box around the window's middle, waves aside."""
        rim = self.window.rim
        offset = np.abs(
            position[:, list(rim.along)] - (rim.center + self.window.motion.travel(time)[:2])[list(rim.along)]
        )
        return np.asarray((offset < 0.5 * np.array(rim.size)[list(rim.along)]).all(1))

    def _plan_at_rest(self, position: Array, time: float) -> Array:
        """Return the places at rest (N, 3) [m] of points (N, 2) [m] of the moving surface."""
        level = self.window.motion.sea.description.level
        points = np.column_stack([position, np.full(len(position), level)])
        for _ in range(2):  # up to the surface there
            points[:, 2] = level + self.window.motion.displacement(self.window.motion.at_rest(points, time), time)[:, 2]
        return self.window.motion.at_rest(points, time)

    def _beside_oil(self, position: Array, parcels: Parcels) -> Flags:
        """Mark points (N, 2) [m] beside oil that is resolved and not lost."""
        oil = parcels.position[(parcels.state == ParcelState.RESOLVED) & (parcels.cause == NONE)]
        found = np.zeros(len(position), np.bool_)
        _mark_near(position, oil, BESIDE * self._config.particle_spacing, found)
        return found

    def _resolve(self, slick: Slick, group: Rows, time: float) -> None:
        """Turn as much of a group's oil into particles as fills whole ones, as far as there is water at the surface for them."""
        parcels, used = slick.parcels, set[int]()
        phase = self._oils[int(parcels.oil[group[0]])]
        for rows, volumes in _whole_parts(group, parcels.volume[group], self.volume):
            share = volumes / volumes.sum()
            middle = share @ parcels.position[rows]
            water = self._water_at(slick, middle, time, used)
            if water == NONE:
                return
            used.add(water)
            means, alike = (
                (*MEANS, "along", "ahead"),
                ("oil", "cause", "loser", "carried", "place", "side"),
            )  # a boom holds what it held
            columns: dict[str, Any] = {name: float(share @ getattr(parcels, name)[rows]) for name in means}
            columns |= {name: getattr(parcels, name)[rows[0]] for name in alike}
            columns |= {
                "position": middle,
                "volume": volumes.sum(),
                "state": ParcelState.RESOLVED,
                "particle": int(self.window.fluid.change_phase([water], phase)[0]),
            }
            parcels.append(columns, 1)
            parcels.volume[rows] -= volumes
            self.taken += float(volumes.sum())

    def _water_at(self, slick: Slick, place: Array, time: float, used: set[int]) -> int:
        """Return the id of the water nearest to the surface at `place` (2,) [m], on the same side of all booms; NONE without any."""
        state, spacing = self.window.fluid.state, self._config.particle_spacing
        surface = self._plan_at_rest(place[None], time)[0] - [0.0, 0.0, 0.5 * spacing]
        size = np.array(self.window.rim.size)
        offset = state.position.T - surface
        for axis in self.window.rim.along:
            offset[:, axis] -= size[axis] * np.round(offset[:, axis] / size[axis])
        distance = np.linalg.norm(offset, axis=1)
        near = np.flatnonzero((state.phase == 0) & (distance < CHOICE * spacing))
        near = near[np.lexsort((state.id[near], distance[near]))]
        places = self.window.motion.in_sea(self._rest(near), time)[:, :2]
        origin = np.broadcast_to(place, places.shape)
        free = first_crossings(origin, places, resting_sweep(slick.barriers)).segment < 0
        return next((int(one) for one in state.id[near[free]] if int(one) not in used), NONE)


@njit(nogil=True, cache=True, error_model="numpy")
def _mark_near(position: Array, oil: Array, reach: float, found: Flags) -> None:
    """Mark the points (N, 2) [m] in found (N,) that are nearer than `reach` [m] to any of the oil (M, 2) [m]."""
    for i in range(len(position)):
        for k in range(len(oil)):
            x, y = oil[k, 0] - position[i, 0], oil[k, 1] - position[i, 1]
            if abs(x) < reach and math.hypot(x, y) < reach:
                found[i] = True
                break


def _groups(parcels: Parcels, rows: Rows, width: float) -> Iterator[Rows]:
    """Yield rows (M,) of parcels by fate, and by pool or square `width` [m] wide; in a group along the boom, or across it."""
    held = parcels.state[rows] == ParcelState.HELD
    square = np.where(held[:, None], 0.0, np.floor(parcels.position[rows] / width))
    order = np.where(held, parcels.along[rows], parcels.position[rows, 0])
    keys = np.column_stack([*(getattr(parcels, name)[rows] for name in KEYS), square])
    by_key = np.lexsort((parcels.id[rows], order, *keys.T[::-1]))
    starts = np.flatnonzero((np.diff(keys[by_key], axis=0) != 0.0).any(1)) + 1
    yield from np.split(rows[by_key], starts) if len(rows) else ()


def _whole_parts(rows: Rows, volume: Array, unit: float) -> Iterator[tuple[Rows, Array]]:
    """Yield rows and the volumes [m3] that they give to a particle of the volume `unit`, in order, as long as there is enough for one.

    volume (M,) [m3] of the rows (M,).
    """
    left, at = volume.copy(), 0
    while left[at:].sum() >= unit:
        given, wanted = [], unit
        first = at
        while wanted > ROUNDING * unit:
            part = left[at] if left[at] <= wanted * (1.0 + ROUNDING) else wanted
            given.append(part)
            left[at] -= part
            wanted -= part
            at += 1 if left[at] == 0.0 else 0
        last = first + len(given)
        yield rows[first:last], np.array(given)


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

"""The closures of a boom at work in a run: they measure what drives them, and carry out the oil that particles are too coarse to lose.

At every `INTERVAL` of simulated time the closures' losses are booked into budgets, less what the particles lost by themselves. Where a
segment owes a particle, the held oil particle nearest to its foot changes place with a water particle behind and below the foot, or, over
the top, behind the float. Volume, mass and momentum stay exact, and the lost oil is seen and drifts on.

There are two ways out, under the foot and over the top. A segment's budget grows by the loss that the closures of that way give, and
falls by the oil that particles carried out there (top up, never add). Which cause a particle's loss has is told by rules of thumb, so a
loss by one cause also counts against the closures of the other causes on the same way; nothing counts twice. An overdrawn budget
forgets its debt with the time constant `WINDOW`: a burst of resolved loss counts against the closures for that window only.

A way out is due when its budget reaches one particle's volume, by the cause that has the largest claim; what particles lost by themselves
is taken off the claims of its way. Each budget begins with a part of a particle's volume, drawn from a seed. So the expected loss of all
segments is that of the closures from the beginning, though a segment can only lose whole particles.

Lean: the draft that a leaning skirt still has, from its pose.

In a run the pose is resolved; the skirt's foot and the local surface give the draft.

The oil before each segment of a boom: which particle the water carries to which segment, and how much of it the boom holds up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from booms.boom_state import BoomState, beside, nearest_image, signed_distance
from booms.containment import Containment, Standing
from booms.losses.liquids import OilOnWater, front_thickness, mixed
from booms.losses.rates import WAYS, Closures, Drivers
from booms.losses.undisturbed import flow_ahead, forced_flow, surface_ahead
from coupling.master.saved_fields import SavedFields
from oilsim import Fluid
from oilsim.backend.arrays import Array, Flags, Ints
from oilsim.backend.jit import njit
from oilsim.oil.fates import LossCause
from oilsim.slick.loss_rate import passed_share

# [s] for which a resolved loss in excess of the closures' counts against them; assumed: the time that an observer takes for one loss
WINDOW = 5.0


class LossBudgets(SavedFields):
    """Volumes owed [m3] by way out and segment (ways, S)."""

    STATE = ("owed", "_claims")

    def __init__(self, segments: int, particle_volume: float, seed: int) -> None:
        """Begin with shares of `particle_volume` [m3] drawn from `seed`."""
        self._volume = particle_volume
        self.owed: Array = particle_volume * np.random.default_rng(seed).random((len(WAYS), segments))
        self._claims = np.zeros((len(LossCause), segments))  # [m3] by the closures, less what was paid, by cause

    def add(self, closure: Array, resolved: Array, duration: float) -> None:
        """Add the closures' losses (causes, S) [m3] of `duration` [s], and the particles' own losses there in that time."""
        self.owed[self.owed < 0.0] *= np.exp(-duration / WINDOW)
        for row, way in enumerate(WAYS):
            causes = list(way)
            paid = resolved[causes].sum(axis=0)
            self.owed[row] += closure[causes].sum(axis=0) - paid
            claims = self._claims[causes] + closure[causes]
            whole = np.maximum(claims, 0.0).sum(axis=0)
            left = 1.0 - np.minimum(np.divide(paid, whole, out=np.zeros_like(whole), where=whole > 0.0), 1.0)
            self._claims[causes] = np.where(claims > 0.0, left * claims, claims)

    def due(self, segment: int, way: int) -> LossCause | None:
        """Return the cause by which a particle of a segment is due on a way out; None where less than a particle is owed."""
        if self.owed[way, segment] < self._volume:
            return None
        causes = WAYS[way]
        return causes[int(np.argmax(self._claims[list(causes), segment]))]

    def pay(self, segment: int, way: int, cause: LossCause) -> None:
        """Take one particle off what a segment owes."""
        self.owed[way, segment] -= self._volume
        self._claims[cause, segment] -= self._volume


def effective_draft(surface: ArrayLike, foot: ArrayLike) -> Array:
    """Compute the draft from the local surface down to the foot (S,) [m], 0 for a foot out of the water; both heights (S,) [m]."""
    return np.asarray(np.maximum(0.0, np.asarray(surface) - np.asarray(foot)))


# [s] between two looks; numerical: short against waves and against the time d / U in which water passes a skirt
INTERVAL = 0.1
LEAST_FRONT = 0.1  # [-] share of its length that a segment counts as front at least, however it lies to the flow
BEYOND = 1.5  # [spacings] behind the boom at which lost oil appears, and before it at which oil is held back
REACH = 3.0  # [spacings] around that place in which a water particle is looked for


@dataclass(frozen=True, kw_only=True)
class LostBoom:
    """A boom as its closures know it: sizes [m], seed, and the rules.

    closures: the rates; oils: by the name of their phase; waters: names of the other phases; segment_length, freeboard, float_width,
    spacing [m]; seed: of the order in which segments' losses fall due; period [m] of the sea along x and y, 0 along an axis on which it
    does not repeat: a boom sails on beyond the length of the sea, its liquid does not.
    """

    closures: Closures
    oils: Mapping[str, OilOnWater]
    waters: Sequence[str]
    segments: int
    segment_length: float
    freeboard: float
    float_width: float
    spacing: float
    seed: int = 0
    period: tuple[float, float] = (0.0, 0.0)


class _HeldOil:
    """The oil that the boom holds now: ids (N,), position (N, 3), velocity (N, 3), segment (N,) before which it lies, kind (N,).

    In a sea that repeats, its position is that of the image which lies in the boom.
    """

    def __init__(self, fluid: Fluid, boom: LostBoom, standing: Standing, line: Array) -> None:
        parts = [
            (fluid.phase_ids(name), fluid.phase_positions(name), fluid.phase_velocities(name)) for name in boom.oils
        ]
        ids = np.concatenate([part[0] for part in parts]).astype(np.int64)
        position = np.concatenate([part[1] for part in parts]).astype(np.float64)
        kind = np.repeat(np.arange(len(parts)), [len(part[0]) for part in parts])
        retained = np.flatnonzero(np.isin(ids, standing.ids[standing.retained]))
        place = beside(position[retained], line, boom.period)
        inside = signed_distance(place[:, :2], line)[0] > 0.0
        held = retained[inside]
        self.ids, self.position, self.kind = ids[held], place[inside], kind[held]
        self.velocity = np.concatenate([part[2] for part in parts]).astype(np.float64)[held]
        self.segment = np.full(len(self.ids), -1, np.int64)


class ClosureLosses(SavedFields):
    """The closures of one boom, with their budgets; only `act` changes anything."""

    STATE = ("_time", "_speed", "_draft", "_swaps", "rate", "_budgets")

    def __init__(self, boom: LostBoom) -> None:
        self._boom = boom
        self._volume = boom.spacing**3
        self._budgets = LossBudgets(boom.segments, self._volume, boom.seed)
        self._time: float | None = None
        self._speed = np.zeros(boom.segments)  # [m/s] against each segment, low-pass
        self._draft = np.full(boom.segments, boom.closures.skirt_depth)  # [m], low-pass
        self._swaps = 0
        self.rate = 0.0  # [m3/s] by all closures, at the last look

    def act(self, time: float, fluid: Fluid, containment: Containment, state: BoomState, level: float) -> None:
        """Add up the losses since the last look, and carry out what is due; `state` of the boom at `time` [s], level [m] of still water."""
        before = self._time
        if before is not None and time - before < INTERVAL * (1.0 - 1e-9):
            return
        self._time = time
        standing = containment.standing()
        held = _HeldOil(fluid, self._boom, standing, state.line())
        flow = self._flow(fluid, state, level)
        duration = 0.0 if before is None else time - before
        drivers = self._drivers(fluid, state, level, held, flow, duration)
        if before is None:
            return
        rates = self._rates(drivers, held)
        self.rate = float(rates.sum())
        self._budgets.add(rates * duration, self._resolved(standing, before), duration)
        for segment, way, cause in self._due():
            self._carry_out(time, fluid, containment, state, held, (segment, way, cause))

    def _rates(self, drivers: Drivers, held: _HeldOil) -> Array:
        """Compute the losses by cause and segment (causes, S) [m3/s]; 0 where the boom holds no oil."""
        boom = self._boom
        if not len(held.ids):
            return np.zeros((len(LossCause), boom.segments))
        volumes = np.bincount(held.kind, minlength=len(boom.oils)).astype(np.float64)
        oil = mixed(list(boom.oils.values()), volumes.tolist())
        return np.asarray(boom.closures.rates(drivers, oil) * boom.segment_length)

    def _flow(self, fluid: Fluid, state: BoomState, level: float) -> Array:
        """Return the undisturbed flow (S, 2) [m/s]; NaN where the water ahead tells none."""
        draft, period = self._boom.closures.skirt_depth, self._boom.period
        flow = forced_flow(fluid, state, level - 0.5 * draft, period)
        if flow is not None:
            return flow
        lightest = min(self._boom.oils.values(), key=lambda oil: oil.reduced_gravity)
        below = front_thickness(np.maximum(self._speed, 0.0), lightest) + self._boom.spacing
        position = np.concatenate([fluid.phase_positions(name) for name in self._boom.waters]).astype(np.float64)
        velocity = np.concatenate([fluid.phase_velocities(name) for name in self._boom.waters]).astype(np.float64)
        return flow_ahead(position, velocity, state, draft=draft, level=level, below=below, period=period)

    def _drivers(
        self, fluid: Fluid, state: BoomState, level: float, held: _HeldOil, flow: Array, duration: float
    ) -> Drivers:
        """Bring the drivers up to date, means over the time d / U in which the water passes the draft."""
        boom, normal = self._boom, state.normal()
        relative = flow - state.velocity[:, :2]
        speed = (relative * normal).sum(axis=1)
        top, foot = state.heights(boom.freeboard, boom.closures.skirt_depth)
        ahead = 0.5 * boom.float_width + BEYOND * boom.spacing
        surface = surface_ahead(fluid, state, ahead, level, 2.0 * boom.closures.skirt_depth)
        share = passed_share(self._speed, boom.closures.skirt_depth, duration)
        self._speed += np.where(np.isfinite(speed), share * (speed - self._speed), 0.0)
        self._draft += share * (effective_draft(surface, foot) - self._draft)
        return Drivers(
            speed=np.maximum(self._speed, 0.0),
            draft=self._draft.copy(),
            held=self._held(state, held, np.nan_to_num(relative)),
            lean=state.skirt_angle(),
            freeboard=top - surface,
            sunk=top < level,
        )

    def _held(self, state: BoomState, held: _HeldOil, relative: Array) -> Array:
        """Return the oil held up before each segment, per metre of front (S,) [m2]; assigns the held particles to the segments."""
        boom, normal = self._boom, state.normal()
        mean = relative.mean(axis=0)
        held.segment = segments_ahead(held.position[:, :2], state.line(), mean)
        chosen = held.segment >= 0
        standing = standing_share(
            held.velocity[chosen, :2], held.segment[chosen], normal, state.velocity[:, :2], self._speed
        )
        volume = self._volume * np.bincount(held.segment[chosen], weights=standing, minlength=boom.segments)
        size = float(np.hypot(*mean))
        facing = np.abs(normal @ mean) / size if size > 0.0 else np.ones(boom.segments)
        return np.asarray(volume / (boom.segment_length * np.maximum(facing, LEAST_FRONT)))

    def _fresh(self, standing: Standing, since: float) -> Flags:
        """Return which particles (N,) of `standing` a segment lost by itself from `since` [s] on."""
        return (standing.lost_at >= since) & ~standing.modelled & (standing.segment < self._boom.segments)

    def _resolved(self, standing: Standing, since: float) -> Array:
        """Return the oil [m3] that particles lost by themselves from `since` [s] on, by cause and segment (causes, S)."""
        segments, fresh = self._boom.segments, self._fresh(standing, since)
        place = standing.cause[fresh].astype(np.int64) * segments + standing.segment[fresh]
        count = np.bincount(place, minlength=len(LossCause) * segments)
        return self._volume * count.reshape(len(LossCause), segments).astype(np.float64)

    def _due(self) -> Iterator[tuple[int, int, LossCause]]:
        """Yield segment, way and cause of every particle that is due; one that cannot be carried out stays due until the next look."""
        for segment in range(self._boom.segments):
            for way in range(len(WAYS)):
                for _ in range(int(self._budgets.owed[way, segment] / self._volume) + 1):
                    cause = self._budgets.due(segment, way)
                    if cause is not None:
                        yield segment, way, cause

    def _carry_out(
        self,
        time: float,
        fluid: Fluid,
        containment: Containment,
        state: BoomState,
        held: _HeldOil,
        due: tuple[int, int, LossCause],
    ) -> None:
        """Let a held particle of a segment change places with a water particle behind it, and tell the budget and the boom."""
        segment, way, cause = due
        mine = np.flatnonzero(held.segment == segment)
        place, highest = self._way_out(state, segment, way)
        water = self._water_at(fluid, state, place, (-math.inf, highest), side=-1.0)
        if not len(mine) or water is None:
            return
        distance = ((held.position[mine] - place) ** 2).sum(axis=1)
        chosen = int(mine[int(np.argmin(distance))])
        fluid.swap_particles([held.ids[chosen]], [water])
        containment.lose(time, int(held.ids[chosen]), cause, segment)
        held.segment[chosen] = -1
        self._budgets.pay(segment, way, cause)
        self._swaps += 1

    def _way_out(self, state: BoomState, segment: int, way: int) -> tuple[Array, float]:
        """Return a place (3,) [m] behind a segment where lost oil appears, and the height [m] below which it does."""
        boom, line = self._boom, state.line()
        at = np.random.default_rng([boom.seed, self._swaps]).random()
        top, foot = (height[segment] for height in state.heights(boom.freeboard, boom.closures.skirt_depth))
        beyond = BEYOND * boom.spacing + (0.5 * boom.float_width if way else 0.0)
        plan = line[segment] + at * (line[segment + 1] - line[segment]) + beyond * state.normal()[segment]
        if way:
            return np.array([*plan, min(top, state.position[segment, 2] + state.waterline)]), math.inf
        return np.array([*plan, foot - 0.75 * boom.spacing]), float(foot) + 0.5 * boom.spacing

    def _water_at(
        self, fluid: Fluid, state: BoomState, place: Array, heights: tuple[float, float], side: float
    ) -> int | None:
        """Return the id of the water particle nearest to a place (3,) [m] between two heights [m]; None if none is near.

        side: 1 before the boom, -1 behind it.
        """
        particles, spacing, line = fluid.particles, self._boom.spacing, state.line()
        phases = [fluid.config.phase_index(name) for name in self._boom.waters]
        images = nearest_image(particles.position.T, place, self._boom.period)
        near = np.ones(fluid.particle_count, np.bool_)
        for axis in range(3):
            near &= np.abs(images[:, axis] - place[axis]) < REACH * spacing
        index = np.flatnonzero(near)
        index = index[np.isin(particles.phase[index], phases)]
        position = images[index].astype(np.float64)
        beyond = side * signed_distance(beside(position, line, self._boom.period)[:, :2], line)[0] > 1.01 * spacing
        allowed = beyond & (position[:, 2] > heights[0]) & (position[:, 2] < heights[1])
        if not allowed.any():
            return None
        index, position = index[allowed], position[allowed]
        distance = ((position - place) ** 2).sum(axis=1)
        order = np.lexsort((particles.id[index], distance))
        return int(particles.id[index[order[0]]])


def segments_ahead(points: Array, line: Array, flow: Array) -> Ints:
    """Return, for each point (N, 2) [m], the segment of `line` (S + 1, 2) to which the water carries it; -1 for none.

    flow (2,) [m/s]: of the water relative to the boom. The segment is the first that a straight way along the flow meets. Without flow, and
    where the way meets none, it is the nearest one within a segment's length.
    """
    found = np.empty(len(points), np.int64)
    speed = float(np.hypot(*flow))
    direction = np.asarray(flow, np.float64) / speed if speed > 1e-3 else np.zeros(2)
    _find_segments(np.ascontiguousarray(points), np.ascontiguousarray(line), direction, found)
    return found


@njit(nogil=True, cache=True, error_model="numpy")
def _find_segments(points: Array, line: Array, direction: Array, found: Ints) -> None:
    """Fill found (N,); see `segments_ahead`. direction (2,) is a unit vector or 0."""
    for i in range(len(points)):
        first, nearest, choice, beside = 1e300, 1e300, -1, -1
        for k in range(len(line) - 1):
            ax, ay = line[k, 0] - points[i, 0], line[k, 1] - points[i, 1]
            ex, ey = line[k + 1, 0] - line[k, 0], line[k + 1, 1] - line[k, 1]
            across = direction[0] * ey - direction[1] * ex
            if abs(across) > 1e-12:
                way = (ax * ey - ay * ex) / across
                along = (ax * direction[1] - ay * direction[0]) / across
                if way >= 0.0 and 0.0 <= along <= 1.0 and way < first:
                    first, choice = way, k
            length = ex * ex + ey * ey
            part = min(max(-(ax * ex + ay * ey) / max(length, 1e-30), 0.0), 1.0)
            gap = math.hypot(ax + part * ex, ay + part * ey)
            if gap < nearest and gap * gap <= length:
                nearest, beside = gap, k
        found[i] = choice if choice >= 0 else beside


def standing_share(velocity: Array, segment: Ints, normal: Array, boom_velocity: Array, speed: Array) -> Array:
    """Return how far each particle (N,) is held up, from 0, it moves with the water, to 1, it stands before its segment.

    1 - (v - v_segment) . n / U, within 0 and 1. velocity (N, 2) [m/s]; segment (N,) from 0 on; normal (S, 2) outward; boom_velocity (S, 2)
    and speed U (S,) [m/s] of the water against the segment. A slick that the water carries along is not torn by it.
    """
    drift = ((velocity - boom_velocity[segment]) * normal[segment]).sum(axis=1)
    against = speed[segment]
    share = 1.0 - np.divide(drift, against, out=np.ones_like(drift), where=against > 0.0)
    return np.asarray(np.clip(share, 0.0, 1.0))

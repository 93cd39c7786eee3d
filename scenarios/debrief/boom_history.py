"""The history of each boom over time: the recorded scores and oil ledger, and its shape from the recorded motions of its segments."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from booms.boom_state import BoomState
from booms.containment import PRACTICE_SPEED
from oilsim.backend.arrays import Array, Flags, Ints
from recordings.model.exercise import BoomDescription, ExerciseDescription
from recordings.replay.recording import Replay, Series
from recordings.replay.series import WORST, BodySeries, reached
from scenarios.debrief.order_words import crew_acted

UNDER_WAY = 0.5  # fraction of the highest tow speed through the water from which on the boom counts as under way
START_UP = 0.1  # lengths of the boom that it goes through the water until it has taken its shape


class Losses(NamedTuple):
    """Tow speeds [m/s] at the first loss and at the gross loss; None if it did not come to it."""

    first: float | None
    gross: float | None


@dataclass(frozen=True, kw_only=True, eq=False)
class BoomHistory:
    """The history of one boom at the N recorded instants.

    time          (N,) [s]
    states        the boom's position and motion at each instant
    tension       (N, S) [N] along the boom; NaN if it was not recorded
    tow_tension   (N,) [N] for each end
    tow_peak      (N,) [N] for each end: the highest value since the instant before, as far as the recording has it
    held_speed    (N, S) [m/s] at which water kept running against each segment; held_peak (N,) [m/s]: as `tow_peak`, the largest of all
    oil           (N,) [m3] of each series of the boom's oil, as "contained" and "lost/<cause>", see `oilsim.oil.ledger.BoomOil`
    spilled       (N,) [m3] all oil that was spilled so far
    losses        tow speeds [m/s] at the first loss and at the gross loss
    tow_speed     (N,) [m/s] through the water, mean of the vessels
    current       (N, 2) [m/s]
    water_level   [m]
    series        all series of the recording by name, of several booms those of this one without its name
    crew_acted    False if the exercise needs orders, and nobody gave a vessel, line or skimmer one
    """

    boom: BoomDescription
    time: Array
    states: tuple[BoomState, ...]
    current: Array
    water_level: float
    tension: Array
    tow_tension: Mapping[str, Array]
    tow_peak: Mapping[str, Array]
    held_speed: Array
    held_peak: Array
    oil: Mapping[str, Array]
    spilled: Array
    losses: Losses
    tow_speed: Array
    series: Mapping[str, Series] = field(default_factory=dict)
    crew_acted: bool = True

    @property
    def in_waves(self) -> bool:
        """Tell whether a speed of the water counts as held after a wave's period, and not after the way of a skirt's depth."""
        return self.boom.hold_time > self.boom.skirt_depth / PRACTICE_SPEED * (1.0 + 1e-9)

    @cached_property
    def normal_flow(self) -> Array:
        """Velocity (N, S) [m/s] of each segment through the water along its normal."""
        return np.array([state.normal_flow(now) for state, now in zip(self.states, self.current, strict=True)])

    @cached_property
    def skirt_angle(self) -> Array:
        """Lean (N, S) [rad] of each segment's skirt from the vertical."""
        return np.array([state.skirt_angle() for state in self.states])

    @cached_property
    def effective_draft(self) -> Array:
        """Depth (N, S) [m] of each skirt's foot below the still water."""
        feet = [state.heights(self.boom.freeboard, self.boom.skirt_depth)[1] for state in self.states]
        tide = self.series.get("water_level")
        level = self.water_level if tide is None else np.interp(self.time, tide.time, tide.value)[:, None]
        return np.asarray(level - np.array(feet))

    @cached_property
    def gap_ratio(self) -> Array:
        """Distance between the ends / length of the boom, (N,) [-]."""
        return np.array([state.gap_ratio for state in self.states])

    @cached_property
    def under_way(self) -> Flags:
        """Instants (N,) at which the boom is towed, or held in a current, near its highest speed."""
        return np.asarray(self.tow_speed >= UNDER_WAY * self.tow_speed.max())

    @cached_property
    def settled(self) -> Flags:
        """Instants (N,) under way at which the start-up is over: the boom has taken its shape, and the first jerks are past.

        That takes a way through the water of `START_UP` of the boom's length from when it first was under way, but not more than half of
        the time under way.
        """
        if len(self.time) < 2:
            return self.under_way
        step = np.diff(self.time, prepend=self.time[0])
        way = np.cumsum(np.where(self.under_way, self.tow_speed * step, 0.0))
        longest = 0.5 * float((step * self.under_way).sum())
        begun = np.cumsum(step * self.under_way)
        over = np.maximum(way / (START_UP * self.boom.length), begun / longest if longest else 1.0) >= 1.0 - 1e-9
        return np.asarray(self.under_way & over)

    @cached_property
    def through_water(self) -> tuple[Array, Array]:
        """Speeds (N,) [m/s] through the water of all segments together: across the line between the boom's ends, and in whole."""
        lines = np.array([state.line()[[0, -1]] for state in self.states])
        along = lines[:, 1] - lines[:, 0]
        along /= np.maximum(np.linalg.norm(along, axis=1), 1e-12)[:, None]
        relative = np.array([state.velocity[:, :2].mean(axis=0) for state in self.states]) - self.current
        across = np.abs(along[:, 0] * relative[:, 1] - along[:, 1] * relative[:, 0])
        return across, np.linalg.norm(relative, axis=1)

    @cached_property
    def causes(self) -> dict[str, Array]:
        """Oil (N,) [m3] lost over time to each cause that occurs, the largest loss first."""
        lost = {name.removeprefix("lost/"): volume for name, volume in self.oil.items() if name.startswith("lost/")}
        return dict(sorted(((k, v) for k, v in lost.items() if v.any()), key=lambda item: -float(item[1][-1])))

    @property
    def recovered(self) -> Array | None:
        """Oil (N,) [m3] that skimmers at the boom had taken; None in a recording without them."""
        return self.oil["recovered"] if self.of_skimmers("oil") else None

    def skimmed(self, what: str) -> list[Array]:
        """Return the sum (N,) [m3] of "oil" or "water" of each skimmer at the boom."""
        return [np.interp(self.time, series.time, series.value) for series in self.of_skimmers(what)]

    def of_skimmers(self, what: str) -> list[Series]:
        """Return a series, such as "oil", of each skimmer at the boom that has values; where a recording does not say which, of all."""
        at_boom = self.boom.skimmers
        return [
            series
            for name, series in self.series.items()
            if name.startswith("skimmers/") and name.endswith(f"/{what}") and len(series.value)
            if at_boom is None or name.split("/")[1] in at_boom
        ]


def boom_histories(replay: Replay) -> list[BoomHistory]:
    """Compute the history of every boom whose segments and oil are in the recording."""
    exercise = replay.run.exercise
    if exercise is None:
        return []
    several, acted = len(exercise.booms) > 1, crew_acted(replay)
    found = []
    for boom in exercise.booms:
        prefix = f"{boom.name}/" if several else ""
        clock = replay.scalars.get(f"{prefix}oil_contained")
        if clock is not None and len(clock.index) and all(name in replay.bodies for name in boom.segments):
            found.append(replace(_history(replay, exercise, boom, prefix), crew_acted=acted))
    return found


def _history(replay: Replay, exercise: ExerciseDescription, boom: BoomDescription, prefix: str) -> BoomHistory:
    segments = [replay.bodies[name] for name in boom.segments]
    clock: Series = replay.scalars[f"{prefix}oil_contained"]
    count = min(len(clock.index), *(len(segment.index) for segment in segments))
    series = {
        name.removeprefix(prefix): _on(clock.index[:count], one, name.removeprefix(prefix))
        for name, one in replay.scalars.items()
        if name.startswith(prefix)
    }
    worst = {name: reached(values, series.get(f"{WORST}{name}")) for name, values in series.items()}
    still = np.zeros(count)
    return BoomHistory(
        boom=boom,
        time=clock.time[:count],
        states=tuple(_state(boom, segments, row) for row in range(count)),
        current=np.stack(
            [series.get(f"current/{axis}", still + exercise.current[k]) for k, axis in enumerate("xy")], 1
        ),
        water_level=exercise.water_level,
        tension=np.stack([segment.tension[:count] for segment in segments], axis=1),
        tow_tension=_beginning_with("tow_tension/", series),
        tow_peak=_beginning_with("tow_tension/", worst),
        held_speed=np.stack([segment.held_speed[:count] for segment in segments], axis=1),
        held_peak=worst.get("normal_speed_held", still),
        oil=_beginning_with("oil_", series),
        spilled=_on(clock.index[:count], spilled, "oil_spilled")
        if (spilled := replay.scalars.get("oil/spilled"))
        else still,
        losses=Losses(*(_last_above_zero(series.get(f"{name}_loss_speed", still)) for name in ("first", "gross"))),
        tow_speed=series.get("tow_speed", still),
        series={name.removeprefix(prefix): one for name, one in replay.scalars.items()},
    )


def _on(index: Ints, one: Series, name: str) -> Array:
    """Return a series at the frames `index` (N,); before its first frame, oil is 0 m3: no such oil was there yet. Others are NaN."""
    if np.array_equal(one.index[: len(index)], index):
        return one.value[: len(index)]
    values = np.full(len(index), 0.0 if name.startswith("oil_") else np.nan)
    _, rows, places = np.intersect1d(index, one.index, return_indices=True)
    values[rows] = one.value[places]
    return values


def _last_above_zero(values: Array) -> float | None:
    return float(values[-1]) if values[-1] > 0.0 else None


def _beginning_with(start: str, series: Mapping[str, Array]) -> dict[str, Array]:
    return {name.removeprefix(start): values for name, values in series.items() if name.startswith(start)}


def _state(boom: BoomDescription, segments: list[BodySeries], row: int) -> BoomState:
    pose = np.array([segment.pose[row] for segment in segments])
    return BoomState(
        position=pose[:, :3],
        orientation=pose[:, 3:],
        velocity=np.array([segment.twist[row, :3] for segment in segments]),
        joint_points=np.array(boom.joint_points),
        waterline=boom.waterline,
        flow_share=np.array(boom.flow_shares) if boom.flow_shares else 1.0,
    )

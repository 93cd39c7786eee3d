"""The measures of the criteria of a grade, taken from the history of a boom: oil in %, time, speed, shape of the boom, and pulls."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from oilsim.backend.arrays import Array
from recordings.replay.series import WORST, reached
from scenarios.debrief.boom_history import BoomHistory

# [1] of a boom's length that may do worse than what is measured, and of its length and time together; chosen: one segment swings by itself
PART = 0.05
# [1] waves over which the speed against a boom is averaged; chosen: in an irregular sea the mean over one leaves a third of the swing
WAVES = 10.0
# [m] of the second end from its berth, within which it counts as there; assumed: a boat's length
AT_BERTH = 15.0


def _taken_in(history: BoomHistory) -> float:
    """Return the oil [m3] that the boom has met; oil that floats off again when the stream turns stays among it."""
    return float(history.oil["met"][-1])


def held(history: BoomHistory) -> float | None:
    """Return the share [%] of the oil held at the end, or recovered, of all that the boom has met; None without oil."""
    return 100.0 * float(history.oil["contained_share"][-1]) if _taken_in(history) > 0.0 else None


def recovered(history: BoomHistory) -> float | None:
    """Return the share [%] of the oil that skimmers took, of all that the boom has met; None without a skimmer or oil."""
    recovered, taken_in = history.recovered, _taken_in(history)
    return None if recovered is None or taken_in <= 0.0 else 100.0 * float(recovered[-1]) / taken_in


def skimmer(history: BoomHistory) -> float | None:
    """Return the largest mean distance [m] of a skimmer at the boom from the oil, over the time in which there was oil."""
    return max((float(series.value.mean()) for series in history.of_skimmers("off_oil")), default=None)


def deployed(history: BoomHistory) -> float | None:
    """Return the time [s] from which on the second end lay at its berth; infinity if it did not lie there at the end."""
    series = history.series.get("to_berth")
    if series is None or not len(series.value):
        return None
    away = np.flatnonzero(series.value > AT_BERTH)
    here = int(away[-1]) + 1 if len(away) else 0
    return float(series.time[here]) if here < len(series.time) else math.inf


def connected(history: BoomHistory) -> float | None:
    """Return the time [s] at which the last of the ties that wait at the boom was made fast; infinity if one never was."""
    times = []
    for tie in history.boom.waiting_ties:
        series = history.series.get(f"ties/{tie}/made_fast")
        if series is not None and len(series.value):
            fast = np.flatnonzero(series.value > 0.0)
            times.append(float(series.time[fast[0]]) if len(fast) else math.inf)
    return max(times, default=None)


def strength(history: BoomHistory) -> float | None:
    """Return the largest tension after the start-up as a share [%] of what the boom bears there; None without a strength."""
    series, worst = (history.series.get(f"{prefix}strength_share") for prefix in ("", WORST))
    if series is None or not len(series.value):
        return None
    shares = reached(series.value, None if worst is None else worst.value)
    after = series.time >= history.time[history.settled][0]
    return 100.0 * float(shares[after].max()) if after.any() else None


def met(history: BoomHistory) -> float | None:
    """Return the share [%] of the oil that the boom has met, of that and the oil that it has passed by; None without oil.

    Oil still ahead of its mouth is neither: it could not be met yet. A boom that has met none although there is oil has met 0 %.
    """
    oil, taken_in = {name: float(values[-1]) for name, values in history.oil.items()}, _taken_in(history)
    if taken_in <= 0.0:
        return 0.0 if oil["afloat"] > 0.0 else None
    floated_off = taken_in - (oil["contained"] + oil["lost"] + oil.get("recovered", 0.0))
    passed_by = max(0.0, oil["afloat"] - oil.get("ahead", 0.0) - max(0.0, floated_off))
    return 100.0 * taken_in / (taken_in + passed_by)


def passed_on(history: BoomHistory) -> float | None:
    """Return the share [%] of the oil that has left the boom which went on beyond its free ends; None if none has left it.

    Oil that the boom still leads is on its way.
    """
    left, gone = float(history.oil["lost"][-1]), history.oil.get("lost/around_ends")
    return 100.0 * float(gone[-1] if gone is not None else 0.0) / left if left > 0.0 else None


def fed(history: BoomHistory) -> float | None:
    """Return the share [%] of the oil from the ends of the funnels before it that the boom has met; None without funnels or such oil."""
    funnels = [history.series.get(f"{funnel}/oil_lost/around_ends") for funnel in history.boom.fed_by]
    came = sum(float(series.value[-1]) for series in funnels if series is not None and len(series.value))
    return 100.0 * min(1.0, _taken_in(history) / came) if came > 0.0 else None


def _in_area(history: BoomHistory) -> Array | None:
    """Return the share (N,) [%] of all oil that was in the boom's area; None if it was not recorded, or without oil."""
    all_oil = history.spilled.max()
    return 100.0 * history.oil["in_area"] / all_oil if "in_area" in history.oil and all_oil > 0.0 else None


def most_in_area(history: BoomHistory) -> float | None:
    """Return the largest share [%] of all oil that was in the boom's area; None if it was not recorded."""
    shares = _in_area(history)
    return None if shares is None else float(shares.max())


def led(history: BoomHistory) -> float | None:
    """Return the share [%] of all oil that was in the boom's area at the end or was recovered; None if it was not recorded."""
    shares = _in_area(history)
    if shares is None:
        return None
    recovered = 0.0 if history.recovered is None else 100.0 * float(history.recovered[-1] / history.spilled.max())
    return float(shares[-1]) + recovered


def time_over(history: BoomHistory, speed: float) -> float:
    """Return the share [%] of the time in which water kept running faster than `speed` [m/s] against more than `PART` of the boom."""
    over = (_steady_speed(history) > speed).mean(axis=1)  # [1] of the boom's length
    return 100.0 * float((over > PART).mean())


def over_by_segment(history: BoomHistory, limits: Sequence[float]) -> tuple[Array, Array]:
    """Return the highest speed (S,) [m/s] that lasted against each segment, and the shares of time (S, L) [%] over L limits [m/s].

    Times of start-up do not count.
    """
    speeds = _steady_speed(history)
    shares = [100.0 * (speeds > limit).mean(axis=0) for limit in limits]
    return np.asarray(speeds.max(axis=0)), np.stack(shares, axis=1)


def _steady_speed(history: BoomHistory) -> Array:
    """Return the settled speeds (M, S) [m/s] held against each segment, in waves each the mean over the `WAVES` waves before it.

    An earlier one has no such mean, and is left out of a run that has any.
    """
    if not history.in_waves:
        return history.held_speed[history.settled]
    time = history.time[history.settled]
    whole = time >= time[0] + WAVES * history.boom.hold_time
    return _over_wave(history, history.held_speed, WAVES)[whole if whole.any() else slice(None)]


def gap(history: BoomHistory) -> float:
    """Return the distance [%] of the mean gap ratio from one third."""
    return 100.0 * abs(float(history.gap_ratio[history.settled].mean()) - 1.0 / 3.0)


def lean(history: BoomHistory) -> float:
    """Return the lean [degrees], in waves the mean over a wave, that all but `PART` of the boom's length and time do not exceed."""
    return float(np.degrees(np.percentile(_over_wave(history, history.skirt_angle), 100.0 * (1.0 - PART))))


def draft(history: BoomHistory) -> float:
    """Return the draft, in waves the mean over a wave, that all but `PART` of the boom's length and time keep [%] of the skirt's depth."""
    smallest = np.percentile(_over_wave(history, history.effective_draft), 100.0 * PART)
    return 100.0 * float(smallest) / history.boom.skirt_depth


def _over_wave(history: BoomHistory, values: Array, waves: float = 1.0) -> Array:
    """Return the settled values (M, S) of a quantity (N, S), each the mean over `waves` before it: a boom rides up and down with the sea.

    A wave's time is that over which the speed normal to the boom is averaged, its period at least.
    """
    time = history.time[history.settled]
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values[history.settled], axis=0)])
    first = np.searchsorted(time, time - waves * history.boom.hold_time + 1e-9)
    last = np.arange(1, len(time) + 1)
    return np.asarray((sums[last] - sums[first]) / (last - first)[:, None])


def snatch(history: BoomHistory) -> float | None:
    """Return the largest peak of a tow tension over its mean [-]; an end that was slack throughout does not count, None if all were."""
    means = {end: float(tension[history.settled].mean()) for end, tension in history.tow_tension.items()}
    peaks = {end: float(history.tow_peak[end][history.settled].max()) for end in means}
    return max((peaks[end] / mean for end, mean in means.items() if mean > 0.0), default=None)


def sharing(history: BoomHistory) -> float | None:
    """Return the difference of the mean tensions at the two ends [%] of the larger one; None without two."""
    means = [float(tension[history.settled].mean()) for tension in history.tow_tension.values()]
    return 100.0 * (max(means) - min(means)) / max(means) if len(means) == 2 and max(means) > 0.0 else None

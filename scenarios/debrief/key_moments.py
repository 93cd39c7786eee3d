"""The moments of an exercise worth a picture, and what happened then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from recordings.pictures.scenes import render_moments
from recordings.replay.moments import Moment, read_moments, recorded_steps
from recordings.replay.recording import Replay
from scenarios.debrief.boom_history import BoomHistory

_MOST = 6
_CLOSE = 0.05  # of the run: what happens within shares a picture
_TELL_TIME = 0.05  # [s] off the moment shown: worth saying when
_WIDTH = 930  # pixels
_ORDERS = ("orders", "instructor")  # who gives them
_TECHNICAL = ("master", "oilsim")  # who speaks of the simulation, not of the exercise: that stays in the log


@dataclass(frozen=True, kw_only=True, eq=False)
class KeyMoment:
    """One numbered moment: what happened, where everything was, and its picture (height, width, 3), 0 to 1."""

    number: int
    captions: tuple[str, ...]
    moment: Moment
    image: npt.NDArray[np.float64]

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.moment.time


def key_moments(replay: Replay, histories: Sequence[BoomHistory]) -> list[KeyMoment]:
    """Beginning and end, and up to four things between them: orders, warnings, the highest tension."""
    steps = recorded_steps(replay)
    times = np.array([time for _, time in steps])
    told = _gathered(replay, histories, float(times[0]) if len(times) else 0.0, float(times[-1]) if len(times) else 0.0)
    chosen = [steps[min(int(np.searchsorted(times, time - 1e-9)), len(steps) - 1)] for time, _ in told]
    moments = read_moments(replay, chosen)
    images = render_moments(replay.run, moments, _WIDTH, exercise_only=bool(histories))
    return [
        KeyMoment(number=number, captions=captions, moment=moment, image=image)
        for number, ((_, captions), moment, image) in enumerate(zip(told, moments, images, strict=True), start=1)
    ]


def _gathered(
    replay: Replay, histories: Sequence[BoomHistory], begin: float, end: float
) -> list[tuple[float, tuple[str, ...]]]:
    """Times and captions, in order; what happens close together is one moment, the most pressing ones are kept."""
    happenings = [(begin, 1, "the exercise begins"), (end, 0, "the exercise ends")]
    for event in replay.events:
        if event.source in _TECHNICAL and event.level == "info":
            continue
        text = f"{event.source}: {event.text}" if event.source else event.text
        pressing = event.level != "info" or (event.source in _ORDERS and event.time > begin)
        happenings.append((event.time, 2 if pressing else 1, text))
    for history in histories:
        happenings += _highest_tension(history)
    groups: list[list[tuple[float, int, str]]] = []
    for happening in sorted(happenings, key=lambda entry: (entry[0], entry[1])):
        at_end = happening[0] >= end > groups[-1][0][0] if groups else False
        if groups and not at_end and happening[0] - groups[-1][0][0] <= _CLOSE * (end - begin):
            groups[-1].append(happening)
        else:
            groups.append([happening])
    between = sorted(groups[1:-1], key=lambda group: -max(weight for _, weight, _ in group))[: _MOST - 2]
    kept = [groups[0], *sorted(between), *([groups[-1]] if len(groups) > 1 else [])]
    return [_shown(group, begin) for group in kept]


def _shown(group: list[tuple[float, int, str]], begin: float) -> tuple[float, tuple[str, ...]]:
    """A group is shown as it was at its last happening, when all has had its effect; the beginning at the beginning."""
    at = group[0][0] if group[0][0] == begin else group[-1][0]
    others = [f"{text} ({time:.1f} s)" if abs(time - at) >= _TELL_TIME else text for time, _, text in group]
    return at, tuple(others)


def _highest_tension(history: BoomHistory) -> list[tuple[float, int, str]]:
    if not history.tow_peak:
        return []
    end, tension = max(history.tow_peak.items(), key=lambda item: float(item[1].max()))
    row = int(tension.argmax())
    return [
        (float(history.time[row]), 1, f"boom {history.boom.name}: highest tow tension, {tension[row]:.0f} N at {end}")
    ]

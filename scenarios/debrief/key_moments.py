"""The key moments of an exercise: when to show a picture, and what happened then."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from recordings.model.frame import VHF, Event
from recordings.model.words import force_in_words
from recordings.pictures.scenes import SceneView
from recordings.replay.moments import Moment, read_moments, recorded_steps
from recordings.replay.recording import Replay
from scenarios.debrief.boom_history import BoomHistory
from scenarios.debrief.order_words import order_in_words

_MOST = 6  # moments on the page
_CLOSE = 0.05  # fraction of the run's time; events closer than this share a moment
_TELL_TIME = 0.05  # [s]; an event farther than this from the moment's time is shown with its own time
_WIDTH = 930  # [pixels]
_PLANNED = "orders"  # source of what announces the orders of the scenario's plan
_TECHNICAL = ("master", "oilsim", "fluid", "thin", "leak", "skirt", "blockage")  # sources of talk of the solver


@dataclass(frozen=True, kw_only=True, eq=False)
class KeyMoment:
    """One numbered moment: what happened, where everything was, its picture (height, width, 3), colours from 0 to 1, and a note on it."""

    number: int
    captions: tuple[str, ...]
    moment: Moment
    image: npt.NDArray[np.float64]
    note: str = ""

    @property
    def time(self) -> float:
        """Simulated time [s] of the moment."""
        return self.moment.time


def key_moments(replay: Replay, histories: Sequence[BoomHistory]) -> list[KeyMoment]:
    """Choose beginning and end, and up to four moments between them: what booms warn of, then orders, then the highest tension."""
    steps = recorded_steps(replay)
    times = np.array([time for _, time in steps])
    told = _gathered(replay, histories, float(times[0]) if len(times) else 0.0, float(times[-1]) if len(times) else 0.0)
    chosen = [steps[min(int(np.searchsorted(times, time - 1e-9)), len(steps) - 1)] for time, _ in told]
    moments = [_around_booms(replay, moment) for moment in read_moments(replay, chosen)]
    view = SceneView(replay.run, moments, _WIDTH, exercise_only=bool(histories))
    return [
        KeyMoment(number=number, captions=captions, moment=moment, image=view.draw(moment), note=view.note)
        for number, ((_, captions), moment) in enumerate(zip(told, moments, strict=True), start=1)
    ]


def deck_text(replay: Replay, event: Event) -> str:
    """Return the text of an event in the words of the deck."""
    return order_in_words(event.text, bearing_of(replay)) if event.is_order else event.text


def bearing_of(replay: Replay) -> float:
    """Return the compass bearing [rad] of the x axis: that of the site, else east."""
    return float(np.radians(90.0 if replay.run.site is None else replay.run.site.bearing))


def _around_booms(replay: Replay, moment: Moment) -> Moment:
    """Move the liquid of a sea that repeats by whole periods to where the booms are, which sail on beyond its length."""
    exercise = replay.run.exercise
    if exercise is None or not any(exercise.period):
        return moment
    names = [name for boom in exercise.booms for name in boom.segments if name in moment.bodies]
    line = np.array([moment.bodies[name].position[:2] for name in names])
    if not len(line):
        return moment

    def moved(groups: Mapping[str, npt.NDArray[np.float32]]) -> dict[str, npt.NDArray[np.float32]]:
        middle, period = 0.5 * (line.min(axis=0) + line.max(axis=0)), np.array(exercise.period)
        shifted = {}
        for name, points in groups.items():
            away = (points[:, :2] - middle) / np.where(period > 0.0, period, np.inf)
            shift = np.column_stack([np.round(away) * period, np.zeros(len(points))])
            shifted[name] = (points - shift).astype(np.float32)
        return shifted

    return replace(moment, positions=moved(moment.positions), lost=moved(moment.lost))


def is_technical(event: Event) -> bool:
    """Tell whether an event is talk of the solver, which stays in the instructor's log; how a run failed is for all."""
    return event.source.partition(" ")[0] in _TECHNICAL and event.level != "error"


def _gathered(
    replay: Replay, histories: Sequence[BoomHistory], begin: float, end: float
) -> list[tuple[float, tuple[str, ...]]]:
    """Gather times and captions of the moments, in order; events close together are one. The most urgent are kept, of equals the last."""
    happenings = [(begin, 1, "the exercise begins"), (end, 0, "the exercise ends")]
    for event in replay.events:
        if is_technical(event) or event.source == VHF:  # the page has a log of the radio
            continue
        said = deck_text(replay, event)
        text = f"{event.source}: {said}" if event.source else said
        ordered = 1 if (event.is_order or event.source == _PLANNED) and event.time > begin else 0
        happenings.append((event.time, 1 + max(event.urgency, ordered), text))
    for history in histories:
        happenings += _highest_tension(history)
    groups: list[list[tuple[float, int, str]]] = []
    for happening in sorted(happenings, key=lambda entry: (entry[0], entry[1])):
        at_end = happening[0] >= end > groups[-1][0][0] if groups else False
        if groups and not at_end and happening[0] - groups[-1][0][0] <= _CLOSE * (end - begin):
            groups[-1].append(happening)
        else:
            groups.append([happening])
    between = sorted(groups[1:-1], key=lambda group: (max(weight for _, weight, _ in group), group[0][0]))[2 - _MOST :]
    kept = [groups[0], *sorted(between), *([groups[-1]] if len(groups) > 1 else [])]
    return [_shown(group, begin) for group in kept]


def _shown(group: list[tuple[float, int, str]], begin: float) -> tuple[float, tuple[str, ...]]:
    """Choose the time of a group: that of its last event, when all have had their effect; or the beginning, if it begins there."""
    at = group[0][0] if group[0][0] == begin else group[-1][0]
    others = [f"{text} ({time:.1f} s)" if abs(time - at) >= _TELL_TIME else text for time, _, text in group]
    return at, tuple(others)


def _highest_tension(history: BoomHistory) -> list[tuple[float, int, str]]:
    if not history.tow_peak:
        return []
    peaks = {
        end: np.where(history.settled, peak, 0.0) for end, peak in history.tow_peak.items()
    }  # not the jerks of the start
    end, tension = max(peaks.items(), key=lambda item: float(item[1].max()))
    row = int(tension.argmax())
    return [
        (
            float(history.time[row]),
            1,
            f"boom {history.boom.name}: highest tow tension, {force_in_words(float(tension[row]))} at {end}",
        )
    ]

"""The paper's conclusions as tests: what each says, what the runs measured, and whether it holds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tests.paper.runs import THICK
from tests.paper.scenes import OURS, PAPER, Setting, Track
from tests.paper.timing import Timing

ROUND = 1.15  # [-] largest axis ratio of a slick that counts as a circle
LONG = 1.15  # [-] least axis ratio of a slick that counts as an ellipse
ALONG = 30.0  # [degrees] largest angle between the wind and the longer axis
LAST = 2.0  # [s] over which a shape is averaged
COATED = 0.05  # [-] least share of the rock's dry surface under oil once it has drained
SAVED = 0.05  # [-] least saving of a step's time that counts
DRAINED = 5.0  # [s] after the last oil has left the pipe


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """A conclusion in one setting: the statement, what was measured, and whether it holds; None: it is only reported.

    expected: whether it is known to hold; the page on the paper says why where it does not.
    """

    figure: int
    statement: str
    setting: str
    measured: str
    holds: bool | None
    expected: bool = True

    @property
    def is_surprise(self) -> bool:
        """Tell whether the conclusion holds where it is known not to, or the other way round."""
        return self.holds is not None and self.holds != self.expected


def spreading(tracks: Sequence[Track]) -> Iterator[Verdict]:
    """Judge Fig. 3: a circle until the oil comes near the tank's sides, and less area the thicker the oil."""
    for setting in (PAPER, OURS, THICK):
        own = _of(tracks, "calm-spread", setting)
        ratios = [track.series("axis_ratio")[track.before_walls()] for track in own]
        corners = [track.series("corner_ratio")[track.before_walls()] for track in own]
        times = [track.times[track.before_walls()] for track in own]
        yield Verdict(
            figure=3,
            statement=f"circle before the oil reaches the tank's sides: axis ratio below {ROUND}",
            setting=setting.name,
            measured=f"{_list(ratios, '.3f')} at {_list(times, '.2f')} s; corners {_list(corners, '.2f')} (square: 1.2)",
            holds=max(ratios) < ROUND,
        )
        now = min(times)
        areas = [float(track.series("area")[track.at(now)]) for track in own]
        yield Verdict(
            figure=3,
            statement="the thicker the oil, the smaller the area",
            setting=setting.name,
            measured=f"{_list(areas, '.2f')} m² at {now:.2f} s with {_list([track.scene.viscosity for track in own], 'g')} Pa s",
            holds=None if setting is OURS else bool(np.all(np.diff(areas) < 0.0)),
        )


def drifting(tracks: Sequence[Track]) -> Iterator[Verdict]:
    """Judge Fig. 4: drift with the wind, an ellipse along it, and more drift of thinner oil."""
    for setting in (PAPER, OURS):
        windy, calm = _of(tracks, "wind-drift", setting), _of(tracks, "calm-spread", setting)[0]
        ways = [float(track.drift()[-1]) for track in windy]
        yield Verdict(
            figure=4,
            statement="oil drifts with wind and waves",
            setting=setting.name,
            measured=f"{_list(ways, '.2f')} m in {windy[0].times[-1]:g} s; {calm.drift()[-1]:.2f} m in a calm",
            holds=min(ways) > max(0.1, 3.0 * abs(calm.drift()[-1])),
        )
        ratio, still = (_last_mean(track, "axis_ratio") for track in (windy[0], calm))
        angle = _last_mean(windy[0], "angle")
        yield Verdict(
            figure=4,
            statement=f"ellipse along the wind: axis ratio above {LONG}, within {ALONG:g}° of the wind",
            setting=setting.name,
            measured=f"{ratio:.2f} with {windy[0].scene.viscosity:g} Pa s, mean of the last {LAST:g} s; {still:.2f} in a calm",
            holds=ratio > LONG and abs(angle) < ALONG,
            expected=False,
        )
        yield Verdict(
            figure=4,
            statement="thin oil drifts farther than thick oil",
            setting=setting.name,
            measured=f"{_list(ways, '.2f')} m with {_list([track.scene.viscosity for track in windy], 'g')} Pa s",
            holds=ways[0] > ways[-1] if setting is PAPER else None,
        )


def coating(tracks: Sequence[Track]) -> Iterator[Verdict]:
    """Judge Fig. 5: oil that hangs on the rock after the pipe has ended, where oil is as thick as the paper's."""
    for track in tracks:
        end = track.pouring_end()
        last = track.coatings[track.at(end + DRAINED)]
        yield Verdict(
            figure=5,
            statement="oil coats a rock, and stays on it",
            setting=track.scene.setting.name,
            measured=f"{100.0 * last.covered:.0f} % of its dry surface, {1e3 * last.volume:.2f} l, {DRAINED:g} s after the last oil"
            f" has left the pipe at {end:.1f} s; at most {100.0 * max(one.covered for one in track.coatings):.0f} %",
            holds=last.covered > COATED if track.scene.setting != OURS else None,
        )


def costs(timings: Sequence[Timing]) -> Iterator[Verdict]:
    """Judge Fig. 6: relaxation saves time, and viscosity costs time."""
    means = {(one.name, one.viscosity): float(np.mean(one.milliseconds)) for one in timings}
    middles = {(one.name, one.viscosity): float(np.median(one.milliseconds)) for one in timings}
    names = list(dict.fromkeys(one.name for one in timings))
    oils = sorted({one.viscosity for one in timings})
    plain, relaxed = ([means[name, oil] for oil in oils] for name in names[:2])
    saved = [1.0 - middles[names[1], oil] / middles[names[0], oil] for oil in oils]
    yield Verdict(
        figure=6,
        statement="relaxation makes steps cheaper (the paper: 15 %)",
        setting=PAPER.name,
        measured=f"{_list(plain, '.0f')} ms without, {_list(relaxed, '.0f')} ms with it ({oils[0]:g} and {oils[1]:g} Pa s); of the median"
        f" {100.0 * saved[0]:.0f}, {100.0 * saved[1]:.0f} % are saved",
        holds=min(saved) > SAVED,
        expected=False,
    )
    yield Verdict(
        figure=6,
        statement="a thicker oil costs more (the paper: 4 to 5 %)",
        setting=PAPER.name,
        measured=f"{100.0 * (plain[1] / plain[0] - 1.0):+.0f} % without, {100.0 * (relaxed[1] / relaxed[0] - 1.0):+.0f} % with relaxation",
        holds=None,
    )
    seconds = {name: [one.a_second for one in timings if one.name == name] for name in names}
    yield Verdict(
        figure=6,
        statement="wall seconds a simulated second (the paper: 438 to 539 on eight cores)",
        setting="all",
        measured="; ".join(f"{name}: {_list(values, '.1f')}" for name, values in seconds.items()),
        holds=None,
    )


def _of(tracks: Sequence[Track], scenario: str, setting: Setting) -> list[Track]:
    """Return the runs of a scenario in a setting, the thinnest oil first."""
    own = [track for track in tracks if track.scene.scenario == scenario and track.scene.setting == setting]
    return sorted(own, key=lambda track: track.scene.viscosity)


def _last_mean(track: Track, name: str) -> float:
    """Return the mean of a measure over the last `LAST` seconds of a run."""
    return float(np.mean(track.series(name)[np.array(track.times) > track.times[-1] - LAST]))


def _list(values: Sequence[float], form: str) -> str:
    """Write numbers with commas between them."""
    return ", ".join(f"{value:{form}}" for value in values)

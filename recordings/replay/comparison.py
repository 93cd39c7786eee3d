"""The comparison of two recordings of one exercise: their scores over the time both cover, and both runs in one recording."""

from __future__ import annotations

import math
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

import numpy as np
import numpy.typing as npt
import rerun.blueprint as rrb
from rerun.chunk import Chunk

from oilsim.core.physical_constants import KNOT
from recordings.files.writing import RecordingError
from recordings.model import appearance, entity_paths
from recordings.model.words import cause_in_words
from recordings.replay.recording import Replay
from recordings.replay.series import WORST, reached
from recordings.sink.plots import plots_with_series
from recordings.sink.rerun_sink import open_stream
from recordings.sink.stream_file import StreamFile

SIDES = ("A", "B")
_BACKGROUND = (224, 233, 240)
_KNOTS = 1.0 / KNOT

Values = npt.NDArray[np.float64]
Reduction = Callable[[Values], float]


@dataclass(frozen=True)
class _Measure:
    """A score that is read from a series: the series' pattern, label, unit, factor from SI, and reduction to one number."""

    pattern: str
    label: str
    unit: str
    factor: float
    reduce: Reduction


def _last(values: Values) -> float:
    return float(values[-1])


def _largest(values: Values) -> float:
    return float(values.max())


def _smallest(values: Values) -> float:
    return float(values.min())


def _mean(values: Values) -> float:
    return float(values.mean())


_OF_THE_MACHINE = ("real_time_factor", "coupling/wall_seconds/")  # how series begin that tell nothing of the run
_CAUSES = "oil_lost/*"
_MEASURES = (
    _Measure("oil_contained", "oil held at the end", "litres", 1e3, _last),
    _Measure("oil_lost", "oil lost at the end", "litres", 1e3, _last),
    _Measure("oil_lost_modelled", "of it carried out by closures (modelled)", "litres", 1e3, _last),
    _Measure(_CAUSES, "oil {}", "litres", 1e3, _last),
    _Measure("oil_recontained", "oil re-contained", "litres", 1e3, _last),
    _Measure("oil/recovered", "oil recovered by skimmers", "litres", 1e3, _last),
    _Measure("oil/stranded", "oil stranded", "litres", 1e3, _last),
    _Measure("oil/left_the_domain", "oil that left the simulated water without being lost", "litres", 1e3, _last),
    _Measure("tow_speed", "mean speed through the water", "kn", _KNOTS, _mean),
    _Measure("normal_speed_held", "largest held speed normal to the boom", "kn", _KNOTS, _largest),
    _Measure("tow_tension/*", "mean tow tension, {}", "kN", 1e-3, _mean),
    _Measure("tow_tension/*", "largest tow tension, {}", "kN", 1e-3, _largest),
    _Measure("skirt_angle", "largest lean of the skirt", "deg", 180.0 / math.pi, _largest),
    _Measure("effective_draft", "smallest draft", "m", 1.0, _smallest),
    _Measure("gap_ratio", "gap ratio at the end", "", 1.0, _last),
    _Measure("probes/*", "{} at the end", "SI", 1.0, _last),
)


@dataclass(frozen=True, kw_only=True)
class Score:
    """One score of both runs, with its label and unit."""

    label: str
    unit: str
    first: float
    second: float


def common_time(first: Replay, second: Replay) -> tuple[float, float]:
    """Return begin and end [s] of the time that both recordings cover; RecordingError if there is none."""
    times = [[series.time for series in replay.scalars.values() if len(series.time)] for replay in (first, second)]
    for replay, found in zip((first, second), times, strict=True):
        if not found:
            raise RecordingError(replay.given, "has no series to compare")
    begin = max(min(float(time[0]) for time in found) for found in times)
    end = min(max(float(time[-1]) for time in found) for found in times)
    if not begin <= end:
        raise RecordingError(second.given, f"has no time in common with {first.given}")
    return begin, end


def parting(first: Replay, second: Replay) -> float | None:
    """Return the time [s] of the first frame at which a series of one run differs from that of the other; None if none ever does."""
    begin, end = common_time(first, second)
    apart = []
    for name in first.scalars.keys() & second.scalars.keys():
        if name.startswith(_OF_THE_MACHINE):
            continue
        one, two = first.scalars[name], second.scalars[name]
        _, rows, places = np.intersect1d(one.index, two.index, return_indices=True)
        differ = one.time[rows][~np.equal(one.value[rows], two.value[places]) & ~np.isnan(one.value[rows])]
        apart += [float(time) for time in differ[:1] if begin <= time <= end]
    return min(apart, default=None)


def scores(first: Replay, second: Replay) -> Iterator[Score]:
    """Yield the scores that both runs have, over their common time; causes by which neither run lost oil are left out."""
    window, units = common_time(first, second), _probe_units(first)
    for measure in _MEASURES:
        for name in first.scalars:
            start = _start(name, measure.pattern)
            if start is None or name not in second.scalars:
                continue
            values = [_within(replay, name, start, measure.reduce, *window) for replay in (first, second)]
            if all(len(one) for one in values):
                a, b = (measure.factor * measure.reduce(one) for one in values)
                if measure.pattern == _CAUSES and a == b == 0.0:
                    continue
                unit = units.get(name, measure.unit)
                yield Score(label=_label(name, start, measure), unit=unit, first=a, second=b)


def _start(name: str, pattern: str) -> int | None:
    """Find where in a series' name the pattern begins: behind the boom's name, if there are several booms; None if it does not match."""
    starts = (0, *(place + 1 for place, letter in enumerate(name) if letter == "/"))
    return next((start for start in starts if fnmatch(name[start:], pattern)), None)


def _label(name: str, start: int, measure: _Measure) -> str:
    """Write a score's label, with its boom if there are several."""
    found = name[start:].removeprefix(measure.pattern.removesuffix("*")).removesuffix("_deg")
    label = measure.label.format(cause_in_words(found) if measure.pattern == _CAUSES else found.replace("_", " "))
    return f"boom {name[:start].strip('/')}: {label}" if start else label


def _probe_units(replay: Replay) -> dict[str, str]:
    """Read the units of probes' series from the titles of their diagrams."""
    probes = [name for name in replay.scalars if name.startswith(f"{entity_paths.PROBES}/")]
    plots = plots_with_series(replay.run.plots, probes)
    return {
        name: title[title.rindex("[") + 1 : -1]
        for title, names in plots.items()
        if title.endswith("]")
        for name in names
    }


def _within(replay: Replay, name: str, start: int, reduce: Reduction, begin: float, end: float) -> Values:
    """Return the values of a series in a time; a largest or smallest value includes what was recorded between the frames."""
    series, values = replay.scalars[name], replay.scalars[name].value
    worst = replay.scalars.get(f"{name[:start]}{WORST}{name[start:]}")
    if worst is not None and reduce in (_largest, _smallest):
        values = reached(values, worst.value)
    return values[(series.time >= begin - 1e-9) & (series.time <= end + 1e-9)]


def write_side_by_side(first: Replay, second: Replay, target: Path) -> None:
    """Write one recording with both runs under ``/A`` and ``/B``: two scenes at the same instant, above common diagrams.

    Raises RecordingError if the target cannot be written.
    """
    stream = open_stream(str(uuid.uuid4()))
    file = StreamFile(stream, target)
    stream.send_recording_name(f"{first.path.stem} (A) and {second.path.stem} (B)")
    replays = [first, second]
    for side, replay in zip(SIDES, replays, strict=True):
        for chunk in _moved(replay, side):
            stream.send_chunks(chunk)
            file.write()
        for name in replay.scalars:
            stream.log(f"{side}/{entity_paths.scalar(name)}", appearance.line(name, side), static=True, strict=True)
    stream.send_blueprint(_blueprint(replays))
    file.close()
    stream.disconnect()


def _moved(replay: Replay, side: str) -> Iterator[Chunk]:
    """Yield a run's chunks, each with its entity one level further down; the run's properties are left out."""
    for path, batch in replay.chunks("/**"):
        if not path.strip("/").startswith("__properties"):
            for chunk in Chunk.from_record_batch(batch):
                yield chunk.with_entity_path(f"/{side}/{path.strip('/')}".rstrip("/"))


def _blueprint(replays: list[Replay]) -> rrb.Blueprint:
    """Lay out two scenes side by side, and below them the diagrams of the series that both runs have, and the log."""
    scenes = [_scene(replay, side) for side, replay in zip(SIDES, replays, strict=True)]
    both = sorted(set(replays[0].scalars) & set(replays[1].scalars))
    plots = plots_with_series(replays[0].run.plots, both)
    views = [
        rrb.TimeSeriesView(
            origin="/",
            name=title,
            contents=[f"/{side}/{entity_paths.scalar(name)}" for side in SIDES for name in names],
        )
        for title, names in plots.items()
    ]
    events = rrb.TextLogView(origin="/", contents=[f"/{side}/{entity_paths.EVENTS}" for side in SIDES], name="Events")
    panel = rrb.TimePanel(timeline=entity_paths.TIMELINE_TIME, state="collapsed", playback_speed=1.0)
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(*scenes), rrb.Horizontal(rrb.Tabs(*views), events, column_shares=[2, 1]), row_shares=[3, 2]
        ),
        panel,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )


def _scene(replay: Replay, side: str) -> rrb.Spatial3DView:
    """Show one run from its scenario's camera, without force arrows and without walls, which hide the water."""
    camera = replay.run.camera
    look = {} if camera is None else {"position": camera.eye, "look_target": camera.target, "eye_up": (0.0, 0.0, 1.0)}
    hidden = (entity_paths.BOUNDARY, entity_paths.FORCES)
    return rrb.Spatial3DView(
        origin=f"/{side}",
        name=f"{side}: {replay.path.stem}",
        overrides={f"/{side}/{path}": rrb.EntityBehavior(visible=False) for path in hidden},
        background=_BACKGROUND,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(kind=rrb.Eye3DKind.Orbital, **look) if look else None,
    )

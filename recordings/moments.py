"""Single instants of a recording, chosen and read for pictures."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from recordings.errors import RecordingError
from recordings.frame import BodyFrame
from recordings.replay import BodySeries, Replay, Series


@dataclass(frozen=True, kw_only=True, eq=False)
class Moment:
    """Where everything was at one instant: time [s], particles (N, 3) by phase, bodies by name."""

    time: float
    positions: Mapping[str, npt.NDArray[np.float32]]
    bodies: Mapping[str, BodyFrame]


def recorded_steps(replay: Replay) -> list[tuple[int, float]]:
    """Every recorded communication step and its time [s], in order."""
    steps: dict[int, float] = {}
    series: list[Series | BodySeries] = [*replay.scalars.values(), *replay.bodies.values()]
    if not series:
        series += [replay.phase_times(phase.name) for phase in replay.run.phases]
    for one in series:
        steps |= dict(zip(one.index.tolist(), one.time.tolist(), strict=True))
    return sorted(steps.items())


def key_steps(steps: Sequence[tuple[int, float]], count: int) -> list[tuple[int, float]]:
    """The first step, the last, and others as evenly between them as there are."""
    if not steps:
        return []
    places = np.unique(np.linspace(0, len(steps) - 1, count).round().astype(int))
    return [steps[place] for place in places]


def read_moments(replay: Replay, steps: Sequence[tuple[int, float]]) -> list[Moment]:
    """What the recording knows of the given steps; a phase recorded now and then as it was last seen."""
    if not steps:
        raise RecordingError(replay.path, "holds no frames")
    particles: dict[int, dict[str, npt.NDArray[np.float32]]] = {index: {} for index, _ in steps}
    for phase in replay.run.phases:
        known = replay.phase_times(phase.name).index.tolist()
        source = {index: known[max(bisect_right(known, index) - 1, 0)] for index, _ in steps if known}
        found = {at: frame.position for at, _, frame in replay.phase_frames(phase.name, set(source.values()))}
        for index, at in source.items():
            particles[index][phase.name] = found[at]
    return [Moment(time=time, positions=particles[index], bodies=bodies_at(replay, index)) for index, time in steps]


def bodies_at(replay: Replay, index: int) -> dict[str, BodyFrame]:
    """Every body as it was last seen at a step."""
    bodies = {}
    for name, series in replay.bodies.items():
        row = int(np.searchsorted(series.index, index, side="right")) - 1
        if row >= 0:
            bodies[name] = series.frame(row)
    return bodies


def placed_vertices(vertices: npt.NDArray[np.floating], body: BodyFrame) -> npt.NDArray[np.float64]:
    """Vertices of the body frame (V, 3) in the world frame: x + v + 2 u x (u x v + w v) for a quaternion (u, w)."""
    axis, real = body.orientation[:3], body.orientation[3]
    local = np.asarray(vertices, dtype=np.float64)
    turned = local + 2.0 * np.cross(axis, np.cross(axis, local) + real * local)
    return np.asarray(turned + body.position)

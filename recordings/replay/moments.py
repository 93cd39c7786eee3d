"""Single instants of a recording, chosen and read for pictures."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from recordings import entity_paths
from recordings.errors import RecordingError
from recordings.frame import BodyFrame
from recordings.replay.body_series import BodySeries
from recordings.replay.recording import Replay, Series
from recordings.replay.surface import DrawnSea, seas_at

Positions = npt.NDArray[np.float32]


@dataclass(frozen=True, kw_only=True, eq=False)
class Moment:
    """Positions of everything at one instant: time [s], particles (N, 3) [m] by phase, bodies by name.

    lost: the particles (N, 3) [m] among them that booms had lost, by cause; sea: its surface in a run without particles, None in another.
    """

    time: float
    positions: Mapping[str, Positions]
    bodies: Mapping[str, BodyFrame]
    lost: Mapping[str, npt.NDArray[np.float32]] = field(default_factory=dict)
    sea: DrawnSea | None = None


def recorded_steps(replay: Replay) -> list[tuple[int, float]]:
    """List every recorded communication step with its time [s], in order; RecordingError if there is none."""
    steps: dict[int, float] = {}
    series: list[Series | BodySeries] = [*replay.scalars.values(), *replay.bodies.values()]
    if not series:
        series += [replay.phase_times(phase.name) for phase in replay.run.phases]
    for one in series:
        steps |= dict(zip(one.index.tolist(), one.time.tolist(), strict=True))
    if not steps:
        raise RecordingError(replay.given, "has no frames")
    return sorted(steps.items())


def key_steps(steps: Sequence[tuple[int, float]], count: int) -> list[tuple[int, float]]:
    """Choose the first step, the last, and others as evenly between them as possible."""
    places = np.unique(np.linspace(0, len(steps) - 1, count).round().astype(int))
    return [steps[place] for place in places]


def read_moments(replay: Replay, steps: Sequence[tuple[int, float]]) -> list[Moment]:
    """Read the given steps; a phase that was not recorded at a step is taken from the last recorded step before."""
    indices = [index for index, _ in steps]
    particles: dict[int, dict[str, Positions]] = {index: {} for index in indices}
    lost: dict[int, dict[str, Positions]] = {index: {} for index in indices}
    for phase in replay.run.phases:
        for index, position in _as_last_seen(replay, entity_paths.phase(phase.name), indices).items():
            particles[index][phase.name] = position
    for cause in replay.lost_causes:
        for index, position in _as_last_seen(replay, entity_paths.lost(cause), indices).items():
            lost[index][cause] = position
    seas = seas_at(replay, indices)
    return [
        Moment(
            time=time,
            positions=particles[index],
            bodies=bodies_at(replay, index),
            lost=lost[index],
            sea=seas.get(index),
        )
        for index, time in steps
    ]


def _as_last_seen(replay: Replay, path: str, indices: Sequence[int]) -> dict[int, Positions]:
    """Read the particles at some steps, or at the last recorded step before."""
    known = replay.particle_times(path).index.tolist()
    place = {index: bisect_right(known, index) - 1 for index in indices}
    source = {index: known[at] for index, at in place.items() if at >= 0}
    found = {at: frame.position for at, _, frame in replay.particles(path, set(source.values()))}
    return {index: found[at] for index, at in source.items()}


def bodies_at(replay: Replay, index: int) -> dict[str, BodyFrame]:
    """Return every body as last recorded at or before a step."""
    bodies = {}
    for name, series in replay.bodies.items():
        row = int(np.searchsorted(series.index, index, side="right")) - 1
        if row >= 0:
            bodies[name] = series.frame(row)
    return bodies


def placed_vertices(vertices: npt.NDArray[np.floating], body: BodyFrame) -> npt.NDArray[np.float64]:
    """Transform vertices (V, 3) [m] of the body frame to the world frame: x + v + 2 u x (u x v + w v) for a quaternion (u, w)."""
    axis, real = body.orientation[:3], body.orientation[3]
    local = np.asarray(vertices, dtype=np.float64)
    turned = local + 2.0 * np.cross(axis, np.cross(axis, local) + real * local)
    return np.asarray(turned + body.position)

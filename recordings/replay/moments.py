"""Single moments of a recording: everything that was recorded of one step, with the surface of the sea and the oil on it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from recordings.files.writing import RecordingError
from recordings.model import entity_paths, palette
from recordings.model.exercise import Equipment
from recordings.model.frame import BodyFrame, PhaseFrame
from recordings.model.surface import SurfaceFrame
from recordings.replay.recording import Replay, Series
from recordings.replay.series import BodySeries, read_rows

_KEPT = {"position": "Mesh3D:vertex_positions", "image": "Mesh3D:albedo_texture_buffer", "box": "box"}


@dataclass(frozen=True, kw_only=True, eq=False)
class DrawnSea:
    """The sea at one instant: its surface, and the colours (R, C, 3) of water and oil in the surface's box; None without oil."""

    surface: SurfaceFrame
    image: npt.NDArray[np.uint8] | None


def seas_at(replay: Replay, indices: Sequence[int]) -> dict[int, DrawnSea]:
    """Return the sea at some steps, or as last recorded before them; steps without one are left out."""
    shape: list[int] = []
    is_clear = False
    rows: dict[str, dict[int, npt.NDArray[np.generic]]] = {name: {} for name in _KEPT}
    for _, chunk in replay.chunks(f"/{entity_paths.SURFACE}"):
        if (lines := read_rows(chunk, "shape")) is not None:
            shape = [int(number) for number in lines.values]
        if (clear := read_rows(chunk, "clear")) is not None:
            is_clear = bool(clear.values[0])
        for name, component in _KEPT.items():
            if (found := read_rows(chunk, component)) is not None:
                rows[name] |= dict(zip(found.index.tolist(), found.split(), strict=True))
    seas = {}
    for index in indices if shape else ():
        position, box, image = (_last(rows[name], index) for name in ("position", "box", "image"))
        if position is not None and box is not None:
            seas[index] = DrawnSea(surface=_surface(position, shape, box, is_clear), image=_image(image))
    return seas


def _last(rows: dict[int, npt.NDArray[np.generic]], index: int) -> npt.NDArray[np.generic] | None:
    """Return the last row at a step or before it; None if there is none."""
    known = sorted(rows)
    place = bisect_right(known, index) - 1
    return rows[known[place]] if place >= 0 else None


def _surface(
    position: npt.NDArray[np.generic], shape: Sequence[int], box: npt.NDArray[np.generic], is_clear: bool
) -> SurfaceFrame:
    grid = position.astype(np.float64).reshape(*shape, 3)
    low_x, low_y, high_x, high_y = (float(edge) for edge in box.ravel())
    return SurfaceFrame(
        x=grid[:, 0, 0],
        y=grid[0, :, 1],
        height=grid[..., 2].astype(np.float32),
        box=(low_x, low_y, high_x, high_y),
        is_clear=is_clear,
    )


def _image(buffer: npt.NDArray[np.generic] | None) -> npt.NDArray[np.uint8] | None:
    """Return the square image (R, R, 3) of a buffer of bytes."""
    if buffer is None:
        return None
    flat = np.asarray(buffer.ravel()[0], dtype=np.uint8)  # a row is one blob
    side = int(np.sqrt(len(flat) // 3))
    return flat.reshape(side, side, 3)


Positions = npt.NDArray[np.float32]


@dataclass(frozen=True, kw_only=True, eq=False)
class Moment:
    """Positions of everything at one instant: time [s], particles (N, 3) [m] by phase, bodies by name.

    lost: the particles (N, 3) [m] among them that booms had lost, by cause; radius (N,) [m] of the spots of parcels, which tell their
    volume, by phase and cause; sea: its surface in a run without particles, None in another; wind (x, y) [m/s].
    equipment: skimmers, and lines that pull, each with a line (N, 3) [m] that shows it.
    """

    time: float
    positions: Mapping[str, Positions]
    bodies: Mapping[str, BodyFrame]
    lost: Mapping[str, npt.NDArray[np.float32]] = field(default_factory=dict)
    radius: Mapping[str, npt.NDArray[np.float32]] = field(default_factory=dict)
    sea: DrawnSea | None = None
    wind: tuple[float, float] = (0.0, 0.0)
    equipment: Sequence[tuple[Equipment, npt.NDArray[np.float64]]] = ()


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
    radii: dict[int, dict[str, Positions]] = {index: {} for index in indices}
    for phase in replay.run.phases:
        for index, frame in _as_last_seen(replay, entity_paths.phase(phase.name), indices).items():
            particles[index][phase.name] = frame.position
            if frame.volume is not None:
                radii[index][phase.name] = palette.spot_radius(frame.volume)
    for cause in replay.lost_causes:
        for index, frame in _as_last_seen(replay, entity_paths.lost(cause), indices).items():
            lost[index][cause] = frame.position
            if frame.volume is not None:
                radii[index][cause] = palette.spot_radius(frame.volume)
    seas = seas_at(replay, indices)
    return [
        Moment(
            time=time,
            positions=particles[index],
            bodies=bodies_at(replay, index),
            lost=lost[index],
            radius=radii[index],
            sea=seas.get(index),
            wind=wind_at(replay, index),
            equipment=equipment_at(replay, index, time),
        )
        for index, time in steps
    ]


def wind_at(replay: Replay, index: int) -> tuple[float, float]:
    """Return the wind (x, y) [m/s] as last recorded at or before a step, else that of the start."""
    if "wind/x" not in replay.scalars:
        return replay.run.exercise.wind if replay.run.exercise else (0.0, 0.0)
    x, y = (replay.scalars[f"wind/{axis}"] for axis in "xy")
    row = max(int(np.searchsorted(x.index, index, side="right")) - 1, 0)
    return float(x.value[row]), float(y.value[row])


def equipment_at(replay: Replay, index: int, time: float) -> list[tuple[Equipment, npt.NDArray[np.float64]]]:
    """Return skimmers, and lines that pull, each with a line (N, 3) [m] that shows it, at a step and its time [s]."""
    exercise, found = replay.run.exercise, []
    if exercise is None or not exercise.equipment:
        return []
    motions = {name: body.motion for name, body in bodies_at(replay, index).items()}
    for one in exercise.equipment:
        scalars = {}
        for name in (one.series, *one.places):
            series = replay.scalars.get(name)
            row = -1 if series is None else int(np.searchsorted(series.time, time + 1e-9)) - 1
            if series is not None and row >= 0:
                scalars[name] = float(series.value[row])
        strip = one.strip(motions, scalars, exercise.water_level)
        if strip is not None and exercise.is_seen(one, time, scalars):
            found.append((one, strip))
    return found


def _as_last_seen(replay: Replay, path: str, indices: Sequence[int]) -> dict[int, PhaseFrame]:
    """Read the particles at some steps, or at the last recorded step before."""
    known = replay.particle_times(path).index.tolist()
    place = {index: bisect_right(known, index) - 1 for index in indices}
    source = {index: known[at] for index, at in place.items() if at >= 0}
    found = {at: frame for at, _, frame in replay.particles(path, set(source.values()))}
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

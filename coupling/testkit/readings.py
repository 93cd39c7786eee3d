"""Readings of a run, as checks take them: alike for scenes, pybullet worlds, scenario runs and recordings.

The history of a run in memory: all motions and series, and frames with particles at a low rate.

Sources of readings: live runs, and recordings.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol, TypeGuard, runtime_checkable

import numpy as np
import trimesh
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from coupling.solids.hydrostatics import hydrostatics
from coupling.testkit.verdict import Context
from oilsim import Fluid
from oilsim.backend.arrays import Array
from recordings.model.entity_paths import scalar, scalar_name
from recordings.model.frame import Event, Frame, RunDescription

if TYPE_CHECKING:
    from recordings.replay.recording import Replay

MOST_BYTES = 64e6  # [B] of particles in memory; chosen: as much as a small test's own simulators take
FRAME_RATE = 25.0  # [1/s] of frames with particles; chosen: the usual rate of recordings, see scenarios.schema
_MOTION = slice(1, 20)


@dataclass(frozen=True, kw_only=True, eq=False)
class BodyTrack:
    """A body over time.

    time (N,) [s], pose (N, 7) [m, 1], twist (N, 6) [m/s, rad/s], wrench (N, 6) [N, N m] of the fluid, tension (N,)
    [N].
    """

    time: Array
    pose: Array
    twist: Array
    wrench: Array
    tension: Array


@dataclass(frozen=True, eq=False)
class Track:
    """A series: time (N,) [s], and value (N,) in its own unit."""

    time: Array
    value: Array


class History:
    """An observer that keeps what it is shown.

    Motions and series are kept at every communication point; frames with particles at FRAME_RATE, if `keeps_particles`. If these exceed
    MOST_BYTES, every second one is dropped, and the rate halves.

    run: the run's description, None before its beginning. time [s]: of the last frame.
    """

    def __init__(self, *, keeps_particles: bool = False) -> None:
        self.run: RunDescription | None = None
        self.frames: list[Frame] = []
        self.events: list[Event] = []
        self.ended = ""
        self.time = 0.0
        self._interval = 1.0 / FRAME_RATE if keeps_particles else np.inf
        self._due = -np.inf if keeps_particles else np.inf
        self._bytes = 0
        self._bodies: dict[str, list[Array]] = defaultdict(list)
        self._series: dict[str, list[tuple[float, float]]] = defaultdict(list)

    def initialized(self, run: RunDescription) -> None:
        """Take note of the run's description."""
        self.run = run

    def step_completed(self, frame: Frame) -> None:
        """Keep motions and series of the frame, and the frame itself with its particles if it is due."""
        self.time = frame.time
        for name, body in frame.bodies.items():
            self._bodies[name].append(np.array([frame.time, *body.motion, body.tension]))
        for name, value in frame.scalars.items():
            self._series[scalar_name(scalar(name))].append((frame.time, value))
        if frame.time >= self._due - 1e-9:
            self._due = frame.time + self._interval
            self._keep(frame)

    def event(self, event: Event) -> None:
        """Keep a line of the log."""
        self.events.append(event)

    def terminated(self, reason: str) -> None:
        """Take note of the run's end."""
        self.ended = reason

    def bodies(self) -> dict[str, BodyTrack]:
        """Return the motion of each body so far."""
        tracks = {}
        for name, kept in self._bodies.items():
            rows = np.array(kept)
            pose, twist, wrench = np.split(rows[:, _MOTION], [7, 13], axis=1)
            tracks[name] = BodyTrack(time=rows[:, 0], pose=pose, twist=twist, wrench=wrench, tension=rows[:, 20])
        return tracks

    def series(self) -> dict[str, Track]:
        """Return each series so far."""
        return {name: Track(*np.array(kept, dtype=np.float64).T) for name, kept in self._series.items()}

    def keep_last(self, frame: Frame) -> None:
        """Keep a frame with its particles although it is not due: the moment of a failure."""
        if not self.frames or self.frames[-1].index < frame.index:
            self._keep(frame)

    def _keep(self, frame: Frame) -> None:
        """Read the particles now, since they move on, and thin the frames out if they are too large."""
        self._bytes += sum(phase.position.nbytes + phase.id.nbytes for phase in frame.phases.values())
        self.frames.append(frame)
        if self._bytes > MOST_BYTES and len(self.frames) > 2:
            del self.frames[1:-1:2]
            self._bytes, self._interval = self._bytes // 2, 2.0 * self._interval


@dataclass(frozen=True)
class Basin:
    """An upright tank: area [m2] of its plan, the height [m] of its floor, and the names of bodies that lie outside of it."""

    area: float
    bottom: float
    without: tuple[str, ...] = ()


@runtime_checkable
class Readable(Protocol):
    """Gives readings: a scene, a watched world, a scenario run."""

    def readings(self) -> Readings:
        """Return the readings up to now."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Live:
    """A run that can be asked and stepped.

    step: makes one communication step. momentum (6,) [kg m/s, kg m2/s] about the origin, energy [J]: of free bodies, without the liquid.
    turnover: their sum of m |v| [kg m/s], that of |I omega| [kg m2/s], and the distance [m] of their furthest point from the origin.
    """

    fluid: Fluid
    step: Callable[[], object]
    momentum: Callable[[], Array]
    energy: Callable[[], float]
    turnover: Callable[[], tuple[float, float, float]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Readings:
    """Everything that a check may read of a run.

    run: its description. bodies, series: over time, by name. particles: positions (N, 3) [m] of a phase at the last moment. time [s]: of
    that moment. gravity [m/s2]:
    of free fall. basin: the tank, None if it is unknown. live: None for a recording.
    """

    run: RunDescription
    bodies: Mapping[str, BodyTrack]
    series: Mapping[str, Track]
    particles: Callable[[str], Array]
    time: float = 0.0
    gravity: float = 9.81
    basin: Basin | None = None
    live: Live | None = None
    source: str = "the run"
    _meshes: dict[str, trimesh.Trimesh] = field(default_factory=dict)

    @property
    def spacing(self) -> float:
        """Particle spacing [m]."""
        return self.run.particle_spacing

    def context(self, *bodies: str) -> Context:
        """Return the circumstances of a measurement of these bodies at the last moment."""
        spacing = None if self.run.properties.get("boxes") == "none" else self.spacing  # a run without particles
        return Context(bodies=bodies, time=self.time, spacing=spacing)

    def body(self, name: str) -> BodyTrack:
        """Return a body's motion; ValueError for an unknown name."""
        if name not in self.bodies:
            raise ValueError(f"{self.source} has no body {name!r}, allowed: {', '.join(self.bodies) or 'none'}")
        return self.bodies[name]

    def one_series(self, name: str) -> Track:
        """Return a series; ValueError for an unknown name."""
        if name not in self.series:
            raise ValueError(f"{self.source} has no series {name!r}, allowed: {', '.join(self.series) or 'none'}")
        return self.series[name]

    def alive(self, need: str) -> Live:
        """Return the live run; TypeError if there is none, or no body or fluid, for a check that needs `need`."""
        if self.live is None:
            _refuse(f"{self.source} holds no {need}, allowed: a scene, a watched world or a scenario run")
        return self.live

    def placed(self, name: str) -> trimesh.Trimesh:
        """Return the body's mesh [m] at its last place in the world; ValueError if it has none."""
        return placed(self.mesh(name), self.body(name).pose[-1])

    def mesh(self, name: str) -> trimesh.Trimesh:
        """Return the body's mesh [m] about its centre of mass; ValueError if it has none."""
        if name not in self._meshes:
            if name not in self.run.meshes:
                raise ValueError(
                    f"{self.source} has no mesh of {name!r}, allowed: {', '.join(self.run.meshes) or 'none'}"
                )
            stored = self.run.meshes[name]
            self._meshes[name] = trimesh.Trimesh(stored.vertices.astype(np.float64), stored.faces)
        return self._meshes[name]

    def volume(self, phase: str | None = None) -> float:
        """Return the volume [m3] of a phase, or of all liquid."""
        names = [one.name for one in self.run.phases] if phase is None else [phase]
        return sum(len(self.particles(name)) for name in names) * self.run.particle_volume

    def level(self) -> float:
        """Compute the height [m] of the still water around the bodies as they are; ValueError if the tank is unknown."""
        if self.basin is None:
            raise ValueError(f"{self.source} has no tank, whose level could be told, allowed: to state level=...")
        names = set(self.bodies) & set(self.run.meshes) - set(self.basin.without)
        bodies = [self.placed(name) for name in sorted(names)]
        return still_level(self.basin, self.volume(), bodies)


def placed(mesh: trimesh.Trimesh, pose: Array) -> trimesh.Trimesh:
    """Return the mesh [m] at a pose (7,) [m, 1]."""
    there = mesh.copy()
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]
    there.apply_transform(turn)
    return there


def still_level(basin: Basin, water: float, bodies: list[trimesh.Trimesh]) -> float:
    """Solve A (level - bottom) = V_water + V_displaced(level) for the level [m], between all bodies dry and all submerged.

    water [m3]; bodies: meshes [m] at their places.
    """
    lowest = basin.bottom + water / basin.area
    highest = lowest + sum(float(mesh.volume) for mesh in bodies) / basin.area

    def missing(level: float) -> float:
        return basin.area * (level - basin.bottom) - water - sum(displaced(mesh, level) for mesh in bodies)

    return float(brentq(missing, lowest, highest)) if missing(lowest) < 0.0 else lowest


def displaced(mesh: trimesh.Trimesh, level: float) -> float:
    """Return the volume [m3] of a mesh below a level [m]."""
    return hydrostatics(mesh, level).displaced_volume if level > mesh.bounds[0, 2] else 0.0


def history_readings(history: History, **terms: Any) -> Readings:
    """Return readings of a history; ValueError if its run has not begun."""
    if history.run is None:
        raise ValueError("the run has not begun, allowed: checks after its first step")
    return Readings(run=history.run, time=history.time, bodies=history.bodies(), series=history.series(), **terms)


def _refuse(text: str) -> NoReturn:
    raise TypeError(text)


TANK = "tank"  # the name of a tank's walls in every recording


def readings_of(source: object) -> Readings:
    """Return the readings of a scene, a watched world, a scenario run, a recording or its file; TypeError for anything else."""
    if isinstance(source, Readings):
        return source
    if isinstance(source, str | Path) or _is_replay(source):
        return readings_of_recording(source)
    if not isinstance(source, Readable):
        allowed = "a scene, a watched world (coupling.testkit.watch), a scenario run, a recording or its file"
        raise TypeError(f"a check is given {source!r}, allowed: {allowed}")
    return source.readings()


def _is_replay(source: object) -> TypeGuard[Replay]:
    """Tell whether a source is a recording that has been opened; without one, nothing that reads recordings has been imported."""
    module = sys.modules.get("recordings.replay.recording")
    return module is not None and isinstance(source, module.Replay)


def readings_of_recording(source: str | Path | Replay) -> Readings:
    """Return the readings of a recording; RecordingError if it cannot be read."""
    from recordings.replay.moments import recorded_steps
    from recordings.replay.recording import Replay

    replay = source if isinstance(source, Replay) else Replay(source)
    bodies = {
        name: BodyTrack(time=one.time, pose=one.pose, twist=one.twist, wrench=one.wrench, tension=one.tension)
        for name, one in replay.bodies.items()
    }

    def particles(phase: str) -> Array:
        steps = replay.phase_times(phase).index
        frames = replay.phase_frames(phase, {int(steps[-1])}) if len(steps) else ()
        return next((frame.position.astype(np.float64) for _, _, frame in frames), np.empty((0, 3)))

    return Readings(
        run=replay.run,
        time=recorded_steps(replay)[-1][1],
        bodies=bodies,
        series={name: Track(one.time, one.value) for name, one in replay.scalars.items() if one.value.ndim == 1},
        particles=particles,
        basin=basin_of(replay.run),
        source=f"the recording {replay.path.name}",
    )


def basin_of(run: RunDescription) -> Basin | None:
    """Return the upright tank whose walls are in the description; None without one.

    The first layer of wall particles stands half a spacing behind the surface, so the walls' innermost points tell where the inside ends.
    """
    walls = run.boundaries.get(TANK)
    if walls is None or run.dimension != 3:
        return None
    middle = 0.5 * (walls.min(axis=0) + walls.max(axis=0)).astype(np.float64)
    upper_half = walls[walls[:, 2] > middle[2]].astype(np.float64)  # sides only, without the floor
    if not len(upper_half):
        return None
    inside = []
    for axis in (0, 1):
        below, above = upper_half[:, axis] < middle[axis], upper_half[:, axis] > middle[axis]
        other = np.abs(upper_half[:, 1 - axis] - middle[1 - axis]) < 0.75 * run.particle_spacing  # off the corners
        if not ((below & other).any() and (above & other).any()):
            return None
        inside.append(
            upper_half[above & other, axis].min() - upper_half[below & other, axis].max() - run.particle_spacing
        )
    center = (np.abs(walls[:, :2] - middle[:2]) < 0.75 * run.particle_spacing).all(axis=1)
    if not center.any():
        return None
    return Basin(float(inside[0] * inside[1]), float(walls[center, 2].max()) + 0.5 * run.particle_spacing)

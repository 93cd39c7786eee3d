"""The history of a run in memory: all motions and series, and frames with particles at a low rate."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from recordings.model.entity_paths import scalar, scalar_name
from recordings.model.frame import BodyFrame, Event, Frame, RunDescription

Array = npt.NDArray[np.float64]

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

    def last(self) -> BodyFrame:
        """Return the body at the last instant."""
        return BodyFrame(
            position=self.pose[-1, :3], orientation=self.pose[-1, 3:], linear_velocity=self.twist[-1, :3],
            angular_velocity=self.twist[-1, 3:], wrench=self.wrench[-1], tension=float(self.tension[-1]),
        )  # fmt: skip


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
        self._bytes += sum(ids.nbytes for ids in frame.lost.values())
        self.frames.append(frame)
        if self._bytes > MOST_BYTES and len(self.frames) > 2:
            del self.frames[1:-1:2]
            self._bytes, self._interval = self._bytes // 2, 2.0 * self._interval

"""A check of a run, while it goes on, against a recording of it: frame by frame, bit for bit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fnmatch import fnmatch

import numpy as np
import numpy.typing as npt

from recordings.files.writing import RecordingError
from recordings.model import entity_paths
from recordings.model.frame import Event, Frame, PhaseFrame, RunDescription
from recordings.model.sample import rounded
from recordings.replay.recording import Replay

OF_THE_MACHINE = ("real_time_factor", "coupling/wall_seconds/*")  # series that depend on the machine's speed


def is_of_the_machine(series: str) -> bool:
    """Tell whether a series depends on the machine's speed."""
    return any(fnmatch(series, pattern) for pattern in OF_THE_MACHINE)


class ReplayCheck:
    """An observer that compares frames until the first one that differs.

    Attributes:
        compared: number of recorded frames that were reached and are equal.
        difference: the first difference, in words; empty if there is none so far.
        precision: grid [m] on which particles were recorded and are compared; None compares them bit for bit.
        last_index: step of the last recorded frame.
    """

    def __init__(self, replay: Replay) -> None:
        """Read the recording's small series; its particles are read later. RecordingError if it has no frame."""
        self.compared = 0
        self.difference = ""
        self.precision = replay.precision
        self._particles = {phase.name: _Particles(replay.phase_frames(phase.name)) for phase in replay.run.phases}
        self._bodies = {
            name: _Rows(one.index, np.hstack([one.pose, one.twist, one.wrench])) for name, one in replay.bodies.items()
        }
        self._scalars = {
            name: _Rows(series.index, series.value)
            for name, series in replay.scalars.items()
            if not is_of_the_machine(name)
        }
        indices = [rows.index for rows in (*self._bodies.values(), *self._scalars.values())]
        indices += [replay.phase_times(name).index for name in self._particles]
        self._recorded = frozenset(np.concatenate(indices).tolist()) if indices else frozenset()
        if not self._recorded:
            raise RecordingError(replay.given, "has no frames")
        self.last_index = max(self._recorded)

    def initialized(self, run: RunDescription) -> None:
        """Do nothing when the run begins."""

    def step_completed(self, frame: Frame) -> None:
        """Compare the frame, if the recording has it."""
        if self.difference or frame.index not in self._recorded:
            return
        different = next(self._differences(frame), "")
        if different:
            self.difference = f"frame {frame.index} at {frame.time:g} s: {different}"
        else:
            self.compared += 1

    def event(self, event: Event) -> None:
        """Ignore the log: it also records interruptions, which may differ."""

    def terminated(self, reason: str) -> None:
        """Do nothing when the run ends."""

    def _differences(self, frame: Frame) -> Iterator[str]:
        for name, particles in self._particles.items():
            recorded = particles.at(frame.index)
            if recorded is not None:
                yield from _different_particles(name, recorded, frame.phases[name], self.precision)
        yield from _different_rows(
            "body", self._bodies, frame.index, {n: body.motion for n, body in frame.bodies.items()}
        )
        scalars = {entity_paths.scalar_name(entity_paths.scalar(name)): value for name, value in frame.scalars.items()}
        yield from _different_rows("series", self._scalars, frame.index, scalars)


class _Particles:
    """The recorded frames of a phase, requested in order of time."""

    def __init__(self, frames: Iterator[tuple[int, float, PhaseFrame]]) -> None:
        self._frames = frames
        self._next = next(frames, None)

    def at(self, index: int) -> PhaseFrame | None:
        """Return the particles at a step; None if they were not recorded then."""
        while self._next is not None and self._next[0] < index:
            self._next = next(self._frames, None)
        return self._next[2] if self._next is not None and self._next[0] == index else None


class _Rows:
    """Values by step."""

    def __init__(self, index: npt.NDArray[np.int64], value: npt.NDArray[np.float64]) -> None:
        self.index = index
        self._value = value

    def at(self, index: int) -> npt.NDArray[np.float64] | None:
        """Return the value at a step, if there is one."""
        row = int(np.searchsorted(self.index, index))
        return self._value[row] if row < len(self.index) and self.index[row] == index else None


def _different_particles(name: str, recorded: PhaseFrame, frame: PhaseFrame, precision: float | None) -> Iterator[str]:
    if not np.array_equal(recorded.id, frame.id):
        yield f"{name} has {len(frame.id)} particles, the recording {len(recorded.id)}, or their ids differ"
        return
    now = rounded(frame.position, precision)
    if now.tobytes() != recorded.position.tobytes():
        away = np.linalg.norm(now.astype(np.float64) - recorded.position, axis=1)
        count = np.count_nonzero((now != recorded.position).any(axis=1))
        yield f"{count} of {len(away)} particles of {name} have moved, by up to {away.max():.3g} m"


def _different_rows(
    what: str, recorded: Mapping[str, _Rows], index: int, now: Mapping[str, npt.NDArray[np.float64] | float]
) -> Iterator[str]:
    for name, rows in recorded.items():
        before = rows.at(index)
        if before is None:
            continue
        if name not in now:
            yield f"{what} {name} is missing"
        elif np.asarray(now[name], np.float64).tobytes() != np.asarray(before).tobytes():
            away = np.max(np.abs(np.asarray(now[name]) - before))
            yield f"{what} {name} differs by up to {away:.3g}"

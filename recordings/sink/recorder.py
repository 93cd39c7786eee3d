"""The recorder: the observer that writes a run to a Rerun file."""

from __future__ import annotations

import weakref
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from recordings.files.writing import RecordingError, why_unwritable
from recordings.model.frame import Event, Frame, RunDescription
from recordings.model.sample import Sample, require_power_of_two, take_sample

if TYPE_CHECKING:
    from recordings.sink.live import LiveView
    from recordings.sink.rerun_sink import RerunFile

FILM_RATE = 1.0  # [1/s] at most, of simulated time; a film moves slowly
_TIME_SLACK = 1e-9  # a frame is due at t even if the time is less by a rounding error


class Recorder:
    """An observer that writes a run to the file ``path``; it only reads the run and cannot change it.

    It takes ``frame_rate`` frames per simulated second, and gathers them into blocks of at most half a second of wall time, because Rerun
    writes one column of ten values far faster than ten rows. A killed run therefore loses less than a second, and nothing from before its
    last checkpoint. Call order: `initialized`, any number of `step_completed` and `event`, then `terminated`. As a context manager it
    terminates itself; if it is forgotten, it closes the file when the program ends. Raises RecordingError if the file cannot be written.
    """

    def __init__(
        self,
        path: str | Path,
        frame_rate: float = 30.0,
        *,
        precision: float | None = None,
        every: Mapping[str, int] | None = None,
        surface_rate: float = 2.5,
        live: LiveView | None = None,
    ) -> None:
        """Check the settings, and that ``path`` can be written, before a long run starts; ValueError for a wrong setting.

        Args:
            path: the file; an existing file is overwritten.
            frame_rate: recorded frames per simulated second [1/s].
            precision: grid [m] to which positions are rounded, a power of two, which the file states; None keeps every bit.
            every: for a phase by name, record its particles in the first frame and then in one of so many recorded frames; default 1.
            surface_rate: frames with the surface of the sea, in a simulated second, at most [1/s]; 0 records none.
            live: a viewer that shows the same frames, and drops some if it cannot keep up.
        """
        if not frame_rate > 0.0:
            raise ValueError(f"frame_rate is {frame_rate} 1/s, allowed: above 0 1/s")
        require_power_of_two(precision)
        if not surface_rate >= 0.0:
            raise ValueError(f"surface_rate is {surface_rate} 1/s, allowed: 0 1/s or more")
        for name, count in (every or {}).items():
            if count < 1:
                raise ValueError(f"every[{name!r}] is {count}, allowed: 1 or more")
        self.path = Path(path)
        self.frame_rate = frame_rate
        self.precision = precision
        self.every = dict(every or {})
        self.surface_rate = surface_rate
        self.recorded_frames = 0
        self._live = live
        self._file: RerunFile | None = None
        self._finalizer: weakref.finalize[[RerunFile, LiveView | None], Recorder] | None = None
        self._last_slot = self._surface_slot = self._film_slot = -1
        self._last_index = 0
        self._is_first = True
        self._film_box: tuple[float, ...] = ()
        self._run: RunDescription | None = None
        _require_writable(self.path)

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.terminated("completed" if error is None else f"{type(error).__name__}: {error}")

    def initialized(self, run: RunDescription) -> None:
        """Open the file and write everything that does not change; RecordingError if it is already open."""
        # The import of Rerun takes half a second; a run without a recording should not need it.
        from recordings.sink.rerun_sink import RerunFile

        if self._file is not None:
            raise RecordingError(self.path, "is already open, allowed: one run for each recorder")
        self._run = run
        terms = {"frame_rate": self.frame_rate, "precision": self.precision or 0.0}
        if self.surface_rate:
            terms["surface_rate"] = self.surface_rate
        terms |= {f"every_{name}": float(count) for name, count in self.every.items()}
        self._file = RerunFile(self.path, run, terms)
        self._finalizer = weakref.finalize(self, _close, self._file, self._live)
        if self._live is not None:
            self._live.start(run, self._file.recording_id)

    def step_completed(self, frame: Frame) -> None:
        """Record the frame if it is due; otherwise do nothing, and do not read the particles."""
        file = self._open_file()
        assert self._run is not None
        self._last_index = frame.index
        slot = int(frame.time * self.frame_rate + _TIME_SLACK)
        if slot <= self._last_slot:
            file.write_if_full()
            return
        self._last_slot = slot
        sample = take_sample(frame, precision=self.precision, phases=self._due_phases(frame), run=self._run)
        sample = self._with_surface(frame, sample)
        self.recorded_frames += 1
        self._is_first = False
        file.add(sample)
        if self._live is not None:
            self._live.show(sample)

    def save_state(self) -> dict[str, int]:
        """Return which frames come next, so that the recording of a continued run takes the same frames.

        Waiting frames are written first, so that no checkpoint is ahead of its recording.
        """
        self._open_file().write()
        return {
            "recorded_frames": self.recorded_frames,
            "last_slot": self._last_slot,
            "last_index": self._last_index,
            "surface_slot": self._surface_slot,
        }

    def restore_state(self, saved: Mapping[str, int]) -> None:
        """Continue after the state that `save_state` returned."""
        self.recorded_frames, self._last_slot = saved["recorded_frames"], saved["last_slot"]
        self._last_index = saved["last_index"]
        self._surface_slot = saved.get("surface_slot", -1)  # the film comes with the next surface, which has a new file

    def event(self, event: Event) -> None:
        """Write a line of the log."""
        self._open_file().add_event(event, self._last_index)
        if self._live is not None:
            self._live.tell(event, self._last_index)

    def terminated(self, reason: str) -> None:
        """Write the remaining frames and close the file; a second call does nothing."""
        if self._file is None or self._file.closed:
            return
        self._file.set_end(reason)
        _close(self._file, self._live)

    def _due_phases(self, frame: Frame) -> set[str] | None:
        """Return the phases whose particles this frame records; None stands for all, and then the names need not be read."""
        if not self.every:
            return None
        return {name for name in frame.phases if self._is_first or self.recorded_frames % self.every.get(name, 1) == 0}

    def _with_surface(self, frame: Frame, sample: Sample) -> Sample:
        """Add the surface of the sea if it is due, and the film on it if that is, too, or lies in another box than the last one."""
        slot = int(frame.time * self.surface_rate + _TIME_SLACK)
        if self.surface_rate == 0.0 or slot <= self._surface_slot or frame.surface is None:
            return sample
        film_slot = int(frame.time * FILM_RATE + _TIME_SLACK)
        has_film = film_slot > self._film_slot or frame.surface.box != self._film_box
        self._surface_slot, self._film_slot, self._film_box = slot, film_slot, frame.surface.box
        return replace(sample, surface=frame.surface, film=frame.film if has_film else None)

    def _open_file(self) -> RerunFile:
        if self._file is None:
            raise RecordingError(self.path, "is not open, allowed: after initialized(run)")
        return self._file


def _close(file: RerunFile, live: LiveView | None) -> None:
    """Close the streams, the file first, because the viewer may not answer."""
    try:
        file.close()
    finally:
        if live is not None:
            live.stop()


def _require_writable(path: Path) -> None:
    """Raise RecordingError now, not after an hour, if the file cannot be written."""
    if why := why_unwritable(path):
        raise RecordingError(path, f"cannot be written: {why}")

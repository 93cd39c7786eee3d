"""Writing of runs to Rerun streams: the only place that turns samples into chunks.

It respects five habits of Rerun 0.41. Rerun keeps references to the arrays it gets, so samples are never written to again. Its batcher
holds small series back until the end, so columns are sent block by block. A stream to both a file and a viewer stalls with the viewer,
so a viewer gets its own stream (`live`). A file in Rerun's hands keeps a part of each chunk in memory, so files are written here
(`stream_file`). A partial update keeps static colours and radii, so a frame holds positions only.
"""

from __future__ import annotations

import json
import math
import time
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import rerun as rr

from recordings.model import appearance, entity_paths, palette
from recordings.model.appearance import legend
from recordings.model.exercise import to_json, windows_to_json
from recordings.model.frame import NO_PARTICLES, Event, PhaseFrame, RunDescription
from recordings.model.sample import Block, Sample, id_ranges
from recordings.sink.blueprint import Layout, run_blueprint
from recordings.sink.stream_file import StreamFile
from recordings.sink.writers import BodyWriter, BoomNames, EquipmentWriter, SurfaceWriter

APPLICATION = "oilsim"
FORMAT_VERSION = 3
# [s] from which on no more parts of a block are written after a step; numerical; a block takes some four steps of an exercise
PART_SECONDS = 8e-3
# [s] in which a block is written; numerical; it fills for 0.5 s before, and a killed run loses less than a second
SPREAD_SECONDS = 0.3
_LEVELS = {"info": rr.TextLogLevel.INFO, "warning": rr.TextLogLevel.WARN, "error": rr.TextLogLevel.ERROR}


class RerunWriter:
    """A writer of descriptions, samples and events to one recording stream."""

    def __init__(self, stream: rr.RecordingStream, *, layout: Layout = "recording") -> None:
        """Write to ``stream``, which the caller has connected to a file or a viewer, that shows it in a layout."""
        self._stream = stream
        self._layout: Layout = layout
        self._run: RunDescription | None = None
        self._spacing = 0.0
        self._shown_scalars: set[str] = set()
        self._bodies: BodyWriter | None = None
        self._last_instants: tuple[int, ...] = ()
        self._last_times: list[rr.TimeColumn] = []
        self._last_ids: dict[str, npt.NDArray[np.uint32]] = {}
        self._last_columns: dict[str, npt.NDArray[np.generic]] = {}
        self._places: dict[str, npt.NDArray[np.float64]] = {}
        self._causes: list[str] = []
        self._surface = SurfaceWriter(self._static, self._columns)
        self._boom_names = BoomNames(self._static, self._columns)
        self._equipment = EquipmentWriter(self._static, self._columns)

    def write_run(self, run: RunDescription, terms: Mapping[str, float]) -> None:
        """Write what does not change: properties, colours, boundaries and meshes."""
        self._run, self._spacing = run, run.particle_spacing
        self._write_properties(run, terms)
        self._static("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, appearance.classes(run.phases))
        for index, phase in enumerate(run.phases):
            look = appearance.phase(index, phase, run.particle_spacing, beside_oil=bool(run.oils))
            self._static(entity_paths.phase(phase.name), look, rr.AnyValues(description=json.dumps(asdict(phase))))
        for name, points in run.boundaries.items():
            self._write_boundary(name, np.array(points, dtype=np.float32), run.particle_spacing)
        self._bodies = BodyWriter(run, self._static, self._columns)
        self._boom_names.begin(run.booms)
        self._equipment.begin(run.exercise)
        self._static(entity_paths.LEGEND, rr.TextDocument(legend(run), media_type=rr.MediaType.MARKDOWN))

    def write_samples(self, samples: Sequence[Sample]) -> None:
        """Write a block of samples, one chunk per entity."""
        for _ in self.parts(samples):
            pass

    def parts(self, samples: Sequence[Sample]) -> Iterator[None]:
        """Write a block of samples in parts; each item that is taken writes one, and the end of the items the last."""
        for name in _names(sample.phases for sample in samples):
            having = [sample for sample in samples if name in sample.phases]
            self._write_particles(entity_paths.phase(name), having, [sample.phases[name] for sample in having])
        yield
        self._write_lost(samples)
        if self._bodies is not None:
            self._bodies.write(samples)
        yield
        self._surface.write(samples)
        yield
        self._boom_names.write(samples)
        self._equipment.write(samples)
        self._lay_out(set(_names(sample.scalars for sample in samples)), samples[0])
        for name in _names(sample.scalars for sample in samples):
            yield
            having = [sample for sample in samples if name in sample.scalars]
            values = np.array([sample.scalars[name] for sample in having], dtype=np.float64)
            self._columns(entity_paths.scalar(name), having, rr.Scalars.columns(scalars=values))

    def write_event(self, event: Event, frame_index: int) -> None:
        """Write one line of the log."""
        text = f"{event.source}: {event.text}" if event.source else event.text
        times = [
            rr.TimeColumn(entity_paths.TIMELINE_TIME, duration=[event.time]),
            rr.TimeColumn(entity_paths.TIMELINE_FRAME, sequence=[frame_index]),
        ]
        line = rr.TextLog.columns(text=[text], level=[_LEVELS[event.level]])
        origin = rr.AnyValues.columns(source=[event.source])
        self._stream.send_columns(entity_paths.EVENTS, times, [*line, *origin], strict=True)

    def write_end(self, reason: str) -> None:
        """Write why the run ended."""
        self._stream.send_property("end", rr.AnyValues(reason=reason))

    def _lay_out(self, scalars: set[str], sample: Sample) -> None:
        """Send the viewer its layout as soon as the series are known."""
        fresh = scalars - self._shown_scalars
        if self._run is None or (self._shown_scalars and not fresh):
            return
        self._shown_scalars |= fresh
        for name in sorted(fresh):
            self._static(entity_paths.scalar(name), appearance.line(name))
        if not self._places:
            self._places = {name: motion[:3] for name, motion in sample.bodies.items()}
        shown, surface = sorted(self._shown_scalars), self._surface
        has = {"has_surface": surface.is_begun, "has_film": surface.has_film}
        self._stream.send_blueprint(run_blueprint(self._run, shown, self._places, layout=self._layout, **has))

    def _write_properties(self, run: RunDescription, terms: Mapping[str, float]) -> None:
        """Write scenario, versions and the recording's settings where the viewer and `replay` look for them."""
        self._stream.send_recording_name(run.name)
        camera = json.dumps(asdict(run.camera)) if run.camera else ""
        plots = json.dumps(run.plots)
        exercise, site = to_json(run.exercise), to_json(run.site)
        windows = windows_to_json(run.windows)
        facts = rr.AnyValues(
            name=run.name, text=run.text, camera=camera, plots=plots, exercise=exercise, site=site, windows=windows,
            fates=" ".join(run.fates),
        )  # fmt: skip
        self._stream.send_property("scenario", facts)
        fixed = {"format_version": FORMAT_VERSION, "particle_spacing": run.particle_spacing, "dimension": run.dimension}
        self._stream.send_property("recording", rr.AnyValues(**fixed, **terms))
        if run.properties:
            self._stream.send_property("run", rr.AnyValues(**{key: [value] for key, value in run.properties.items()}))

    def _write_boundary(self, name: str, points: npt.NDArray[np.float32], spacing: float) -> None:
        """Write boundary particles once, and their bounding box as an outline that hides nothing."""
        self._static(entity_paths.boundary(name), appearance.wall(points, spacing))
        if len(points):
            self._static(entity_paths.outline(name), appearance.outline(points, spacing))

    def _write_particles(self, path: str, samples: Sequence[Sample], frames: Sequence[PhaseFrame]) -> None:
        """Write particles, and before them their ids if they have changed."""
        changed, ranges = [], []
        for sample, frame in zip(samples, frames, strict=True):
            before = self._last_ids.get(path)
            if before is None or not np.array_equal(frame.id, before):
                self._last_ids[path] = frame.id
                changed.append(sample)
                ranges.append(id_ranges(frame.id))
        if changed:
            values = rr.AnyValues.columns(ranges=np.concatenate(ranges)).partition([len(item) for item in ranges])
            self._columns(entity_paths.ids(path), changed, values)
        self._write_sizes(path, samples, frames)
        fates = [(one, frame.fate) for one, frame in zip(samples, frames, strict=True) if frame.fate is not None]
        self._write_changed(entity_paths.fates(path), "fates", fates)
        positions = [frame.position for frame in frames]
        together = positions[0] if len(positions) == 1 else np.concatenate(positions)
        column = rr.Points3D.columns(positions=together).partition([len(position) for position in positions])
        self._columns(path, samples, column)

    def _write_sizes(self, path: str, samples: Sequence[Sample], frames: Sequence[PhaseFrame]) -> None:
        """Write volume and width of each parcel (N, 2); particles have none."""
        sizes = [
            (sample, np.column_stack((frame.volume, frame.width)).ravel())
            for sample, frame in zip(samples, frames, strict=True)
            if frame.volume is not None and frame.width is not None
        ]
        self._write_changed(entity_paths.sizes(path), "sizes", sizes)

    def _write_changed(self, path: str, name: str, columns: Sequence[tuple[Sample, npt.NDArray[np.generic]]]) -> None:
        """Write a column of values of particles where it has changed, and has values."""
        changed: list[tuple[Sample, npt.NDArray[np.generic]]] = []
        for sample, column in columns:
            before = self._last_columns.get(path)
            if len(column) and (before is None or not np.array_equal(column, before)):
                self._last_columns[path] = column
                changed.append((sample, column))
        if changed:
            values = rr.AnyValues.columns(**{name: pa.array(np.concatenate([column for _, column in changed]))})
            self._columns(path, [one for one, _ in changed], values.partition([len(column) for _, column in changed]))

    def _write_lost(self, samples: Sequence[Sample]) -> None:
        """Write the oil that booms lost, by cause; once a cause has occurred it is always written, even without particles."""
        lost = [(sample, sample.lost) for sample in samples if sample.lost is not None]
        for cause in dict.fromkeys([*self._causes, *_names(found for _, found in lost)]):
            if cause not in self._causes:
                self._causes.append(cause)
                are_parcels = any(found[cause].volume is not None for _, found in lost if cause in found)
                look = appearance.lost(cause, self._spacing, are_parcels=are_parcels)
                self._static(entity_paths.lost(cause), look)
            frames = [found.get(cause, NO_PARTICLES) for _, found in lost]
            self._write_particles(entity_paths.lost(cause), [sample for sample, _ in lost], frames)
            for (sample, _), frame in zip(lost, frames, strict=True):
                if frame.volume is not None:
                    radii = rr.Points3D.columns(radii=palette.spot_radius(frame.volume))
                    self._columns(entity_paths.lost(cause), [sample], radii.partition([len(frame.volume)]))

    def _static(self, path: str, *components: rr.AsComponents) -> None:
        self._stream.log(path, *components, static=True, strict=True)

    def _columns(self, path: str, samples: Sequence[Sample], columns: Iterable[rr.ComponentColumn]) -> None:
        """Send one chunk, with one row for each sample."""
        instants = tuple(sample.index for sample in samples)
        if instants != self._last_instants:
            self._last_instants = instants
            self._last_times = [
                rr.TimeColumn(entity_paths.TIMELINE_TIME, duration=[sample.time for sample in samples]),
                rr.TimeColumn(entity_paths.TIMELINE_FRAME, sequence=instants),
            ]
        self._stream.send_columns(path, self._last_times, columns, strict=True)


class RerunFile:
    """A recording on disk, written block by block; RecordingError if it cannot be written.

    To write a block takes as long as half a step of an exercise. So the stream gets it in parts, one after each of the next steps. The
    disk gets it as a whole.
    """

    def __init__(self, path: Path, run: RunDescription, terms: Mapping[str, float]) -> None:
        """Create the file with everything that does not change."""
        self.recording_id = str(uuid.uuid4())
        self._block = Block()
        self._parts: Iterator[None] | None = None
        self._last_call, self._due = -math.inf, 0.0
        self._stream = open_stream(self.recording_id)
        self._file = StreamFile(self._stream, path)
        self._writer = RerunWriter(self._stream)
        self._writer.write_run(run, terms)
        self._file.write()

    @property
    def closed(self) -> bool:
        """True if nothing can be written any more."""
        return self._file.closed

    def add(self, sample: Sample) -> None:
        """Add one sample; it reaches the disk with its block."""
        self._block.add(sample)
        self.write_if_full()

    def write_if_full(self) -> None:
        """Begin to write the block if it is full or has waited long enough; else go on with the one that has been begun."""
        begin = time.monotonic()
        between, self._last_call = begin - self._last_call, begin
        if self._block.full:
            self._finish()
            self._begin()
        if begin + between > self._due:  # the next call may come too late
            self._finish()
        for _ in self._parts or ():
            if time.monotonic() - begin > PART_SECONDS:
                return
        self._finish()

    def write(self) -> None:
        """Write the waiting samples to the disk."""
        self._finish()
        self._begin()
        self._finish()

    def _begin(self) -> None:
        if self._block.samples:
            self._file.require(self._block.byte_count)
            self._parts = self._writer.parts(self._block.take())
            self._due = time.monotonic() + SPREAD_SECONDS

    def _finish(self) -> None:
        """Write the rest of the block to the disk."""
        if self._parts is not None:
            parts, self._parts = self._parts, None
            for _ in parts:
                pass
            self._file.write()

    def add_event(self, event: Event, frame_index: int) -> None:
        """Write one line of the log at once, because it is often the last one."""
        self._finish()
        self._writer.write_event(event, frame_index)
        self._file.write()

    def set_end(self, reason: str) -> None:
        """Write into the file's properties why the run ended."""
        self._writer.write_end(reason)

    def close(self) -> None:
        """Write the waiting samples and close the file; a second call does nothing."""
        if not self.closed:
            self.write()
            self._file.close()
            self._stream.disconnect()


def open_stream(recording_id: str) -> rr.RecordingStream:
    """Create a stream that is not connected yet; streams with the same id show as one recording."""
    batching = rr.ChunkBatcherConfig(flush_tick=0.1, flush_num_bytes=1 << 40)
    stream = rr.RecordingStream(APPLICATION, recording_id=recording_id, batcher_config=batching)
    stream.set_log_tick_enabled(False)
    stream.set_log_time_enabled(False)
    return stream


def connect_stream(address: str, recording_id: str) -> rr.RecordingStream:
    """Create a stream to the viewer at ``address``."""
    stream = open_stream(recording_id)
    stream.connect_grpc(address)
    return stream


def _names(mappings: Iterable[Mapping[str, object]]) -> list[str]:
    """List every name in any of the mappings, in order of first appearance."""
    return list(dict.fromkeys(name for mapping in mappings for name in mapping))

"""A recording read back: the run, its events and all motions, bit for bit."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, wraps
from pathlib import Path
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from recordings.files.messages import read_chunk
from recordings.files.writing import RecordingError, absence
from recordings.model import entity_paths
from recordings.model.exercise import exercise_from_json, site_from_json, windows_from_json
from recordings.model.frame import (
    CameraView,
    Color,
    Event,
    EventLevel,
    MeshDescription,
    PhaseDescription,
    PhaseFrame,
    RunDescription,
)
from recordings.model.sample import ids_of_ranges
from recordings.replay.repair import damage_of, repair
from recordings.replay.series import BodySeries, Rows, motions_of_all, read_rows, read_single
from recordings.sink.rerun_sink import FORMAT_VERSION

Terms = ParamSpec("Terms")
Result = TypeVar("Result")


_PROPERTIES = "__properties"
_LEVELS: dict[str, EventLevel] = {"INFO": "info", "WARN": "warning", "ERROR": "error"}


# of values that no recorder has written: a damaged message may decode to others, since there are no checksums
_UNREADABLE = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RuntimeError, MemoryError)


def _told(read: Callable[Concatenate[Replay, Terms], Result]) -> Callable[Concatenate[Replay, Terms], Result]:
    """Wrap a method so that its errors become a RecordingError: the recording does not hold what it should."""

    @wraps(read)
    def told(self: Replay, *arguments: Terms.args, **keywords: Terms.kwargs) -> Result:
        with _telling(self.given):
            return read(self, *arguments, **keywords)

    return told


def _told_on_the_way(
    read: Callable[Concatenate[Replay, Terms], Iterator[Result]],
) -> Callable[Concatenate[Replay, Terms], Iterator[Result]]:
    """Wrap a method that yields in the same way."""

    @wraps(read)
    def told(self: Replay, *arguments: Terms.args, **keywords: Terms.kwargs) -> Iterator[Result]:
        found = read(self, *arguments, **keywords)
        while True:
            with _telling(self.given):
                try:
                    one = next(found)
                except StopIteration:
                    return
            yield one

    return told


@contextmanager
def _telling(path: Path) -> Iterator[None]:
    try:
        yield
    except RecordingError:
        raise
    except _UNREADABLE as error:
        raise RecordingError(
            path, f"is damaged, {' '.join(str(error).split())[:300] or type(error).__name__}"
        ) from error


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """Values over time, in the series' own unit [-].

    Attributes:
        index: (N,) communication steps, increasing.
        time: (N,) simulated time [s].
        value: (N,) or (N, width).
    """

    index: npt.NDArray[np.int64]
    time: npt.NDArray[np.float64]
    value: npt.NDArray[np.float64]


class Replay:
    """One recording; particles are read from the file on request, everything else is small and kept."""

    def __init__(self, path: str | Path, *, mend: bool = True) -> None:
        """Open a recording.

        Args:
            path: the file. One that was cut off in the middle of a write, or damaged, is read from a repaired copy beside it,
                and ``repaired_from`` says so. A copy that turns out to hold no run is deleted.
            mend: allow that; otherwise such a file is an error.

        Raises RecordingError if the file is missing, cannot be read or repaired, or has no run in a format that this program reads.
        """
        source = Path(path)
        why = absence(source)
        if why:
            raise RecordingError(source, why)
        self.repaired_from: Path | None = None
        found = damage_of(source)
        if found.keeps_from_reading and not mend:
            raise RecordingError(source, f"cannot be read: the file {found or 'was cut off'}")
        if found.keeps_from_reading:
            self.repaired_from = source
            source = repair(source)
            found = damage_of(source)
        self.path = source
        self._chunks = found.chunks
        try:
            _require_run(source, self.properties.get("recording", {}))
        except RecordingError as error:
            if self.repaired_from is None:
                raise
            source.unlink(missing_ok=True)
            raise RecordingError(self.repaired_from, error.reason) from error

    @property
    def given(self) -> Path:
        """The file that was named, which is not the one that is read where that is a repaired copy."""
        return self.repaired_from or self.path

    @cached_property
    @_told
    def properties(self) -> Mapping[str, Mapping[str, Any]]:
        """Properties of the file by group: "scenario", "recording" (its settings), "run" (versions and more), "end"."""
        groups: dict[str, dict[str, Any]] = defaultdict(dict)
        for path, chunk in self.chunks(f"/{_PROPERTIES}/**"):
            group = path.strip("/").removeprefix(_PROPERTIES).strip("/")
            groups[group].update(read_single(chunk))
        return dict(groups)

    @property
    def precision(self) -> float | None:
        """Grid [m] to which positions of particles were rounded; None if they were not."""
        return float(self.properties["recording"].get("precision", 0.0)) or None

    @property
    def thinning(self) -> dict[str, int]:
        """Number of frames for one recorded frame, for each phase that was not recorded in every frame."""
        terms = self.properties["recording"]
        every = {phase.name: int(terms.get(f"every_{phase.name}", 1)) for phase in self.run.phases}
        return {name: count for name, count in every.items() if count > 1}

    @property
    def end_reason(self) -> str:
        """Reason why the run ended; empty if the run was interrupted."""
        return str(self.properties.get("end", {}).get("reason", ""))

    @cached_property
    @_told
    def run(self) -> RunDescription:
        """Description of the run, as the recorder got it."""
        scenario = self.properties.get("scenario", {})
        camera = json.loads(scenario.get("camera") or "null")
        plots = json.loads(scenario.get("plots") or "{}")
        return RunDescription(
            name=str(scenario.get("name", "")),
            text=str(scenario.get("text", "")),
            properties=dict(self.properties.get("run", {})),
            particle_spacing=float(self.properties["recording"]["particle_spacing"]),
            dimension=int(self.properties["recording"].get("dimension", 3)),
            phases=self._phase_descriptions(),
            meshes=self._meshes(),
            boundaries=self._boundaries(),
            camera=CameraView(tuple(camera["eye"]), tuple(camera["target"])) if camera else None,
            plots={title: tuple(names) for title, names in plots.items()},
            exercise=exercise_from_json(scenario.get("exercise") or ""),
            site=site_from_json(scenario.get("site") or ""),
            windows=windows_from_json(scenario.get("windows") or ""),
            fates=tuple(str(scenario.get("fates") or "").split()),
        )

    @cached_property
    @_told
    def scalars(self) -> Mapping[str, Series]:
        """Every scalar series by its name."""
        rows = self._rows((f"/{entity_paths.METRICS}/**", f"/{entity_paths.PROBES}/**"), "Scalars:scalars")
        return {entity_paths.scalar_name(path): _series(parts) for path, parts in rows.items()}

    @cached_property
    @_told
    def bodies(self) -> Mapping[str, BodySeries]:
        """Every body's motion by its name."""
        columns = [
            self._rows((f"/{entity_paths.motion_names()}",), "names"),
            *(self._rows((f"/{entity_paths.MOTIONS}",), what) for what in ("motion", "tension", "held_speed")),
        ]
        return motions_of_all(*(next(iter(rows.values()), []) for rows in columns))

    @cached_property
    @_told
    def events(self) -> tuple[Event, ...]:
        """The events of the log, in order of time."""
        found = []
        for _, chunk in self.chunks(f"/{entity_paths.EVENTS}"):
            text, level = read_rows(chunk, "TextLog:text"), read_rows(chunk, "TextLog:level")
            source = read_rows(chunk, "source")
            if text is None or level is None or source is None:
                continue
            for row, line in enumerate(text.values):
                speaker = str(source.values[row])
                said = str(line).removeprefix(f"{speaker}: ") if speaker else str(line)
                found.append(Event(float(text.time[row]), said, _LEVELS[str(level.values[row])], speaker))
        return tuple(sorted(found, key=lambda event: event.time))

    def phase_frames(
        self, name: str, indices: Collection[int] | None = None
    ) -> Iterator[tuple[int, float, PhaseFrame]]:
        """Yield communication step, time [s] and particles of one phase, frame by frame; only at ``indices``, if given."""
        return self.particles(entity_paths.phase(name), indices)

    @cached_property
    @_told
    def lost_causes(self) -> tuple[str, ...]:
        """Every cause by which booms have lost oil during the run."""
        paths = self._rows((f"/{entity_paths.LOST}/**",), "Points3D:positions")
        return tuple(sorted(path.removeprefix(f"{entity_paths.LOST}/") for path in paths))

    @_told_on_the_way
    def particles(self, path: str, indices: Collection[int] | None = None) -> Iterator[tuple[int, float, PhaseFrame]]:
        """Yield step, time [s] and particles at an entity path, frame by frame; only at ``indices``, if given."""
        ids = self._ids(path)
        changes = [index for index, _ in ids]
        sizes, fates = (
            self._changing(entity_paths.sizes(path), "sizes"),
            self._changing(entity_paths.fates(path), "fates"),
        )
        for _, chunk in self.chunks(f"/{path}"):
            rows = read_rows(chunk, "Points3D:positions")
            if rows is None:
                continue
            for index, time, position in zip(rows.index.tolist(), rows.time.tolist(), rows.split(), strict=True):
                if indices is None or index in indices:
                    known = bisect_right(changes, index) - 1
                    size, fate = (_holding(column, index) if len(position) else None for column in (sizes, fates))
                    volume, width = (None, None) if size is None else size.astype(np.float32).reshape(-1, 2).T
                    code = None if fate is None else fate.astype(np.uint8)
                    place = position.astype(np.float32, copy=False)
                    yield index, time, PhaseFrame(place, ids[known][1], volume, width, code)

    def phase_times(self, name: str) -> Series:
        """Return the steps and times at which a phase's particles were recorded, with their number as value."""
        return self.particle_times(entity_paths.phase(name))

    @_told
    def particle_times(self, path: str) -> Series:
        """Return the steps and times at which the particles at an entity path were recorded, with their number as value."""
        parts = self._rows((f"/{path}",), "Points3D:positions").get(path, [])
        counted = [Rows(index=p.index, time=p.time, lengths=np.ones_like(p.lengths), values=p.lengths) for p in parts]
        return _series(counted)

    def _ids(self, particles: str) -> list[tuple[int, npt.NDArray[np.uint32]]]:
        """Return the ids of the particles at a path; each array holds from its step until the next."""
        path = entity_paths.ids(particles)
        changes: list[tuple[int, npt.NDArray[np.uint32]]] = []
        for part in self._rows((f"/{path}",), "ranges").get(path, []):
            rows = zip(part.index.tolist(), part.split(), strict=True)
            changes += [(index, ids_of_ranges(ranges.astype(np.uint32))) for index, ranges in rows]
        return sorted(changes, key=lambda change: change[0])

    def _changing(self, path: str, component: str) -> list[tuple[int, npt.NDArray[np.generic]]]:
        """Return a column of values of particles that is at a path; each holds from its step until the next."""
        found = []
        for part in self._rows((f"/{path}",), component).get(path, []):
            found += list(zip(part.index.tolist(), part.split(), strict=True))
        return sorted(found, key=lambda change: change[0])

    def _phase_descriptions(self) -> tuple[PhaseDescription, ...]:
        """Read the fluids in the order in which they were described."""
        found = []
        for _, chunk in self.chunks(f"/{entity_paths.FLUID}/**", static=True):
            values = read_single(chunk)
            if "description" in values:
                stored = json.loads(str(values["description"]))
                color = tuple(stored.pop("color")) if stored.get("color") else None
                order = int(str(values["Points3D:class_ids"]))
                found.append((order, PhaseDescription(**(stored | {"color": color}))))
        return tuple(phase for _, phase in sorted(found, key=lambda pair: pair[0]))

    def _meshes(self) -> dict[str, MeshDescription]:
        """Read the triangles of every body that has some."""
        found: dict[str, MeshDescription] = {}
        for _, chunk in self.chunks(*_body_paths(), static=True):
            vertices, faces = read_rows(chunk, "vertices"), read_rows(chunk, "faces")
            factor = read_rows(chunk, "Mesh3D:albedo_factor")
            if vertices is not None and faces is not None:
                color = _unpacked(int(factor.values[0])) if factor is not None and len(factor.values) else None
                corners = vertices.values.astype(np.float32).reshape(-1, 3)
                triangles = faces.values.astype(np.uint32).reshape(-1, 3)
                painted = read_rows(chunk, "face_colors")
                colors = None if painted is None else painted.values.astype(np.uint8).reshape(-1, 4)
                mesh = MeshDescription(vertices=corners, faces=triangles, color=color, face_colors=colors)
                names = read_rows(chunk, "names")
                found |= dict.fromkeys([] if names is None else names.values.tolist(), mesh)
        return dict(sorted(found.items()))

    def _boundaries(self) -> dict[str, npt.NDArray[np.float32]]:
        """Read the static boundary particles."""
        rows = self._rows((f"/{entity_paths.BOUNDARY}/**",), "Points3D:positions")
        return {
            path.removeprefix(f"{entity_paths.BOUNDARY}/"): parts[0].values.astype(np.float32, copy=False)
            for path, parts in rows.items()
        }

    def _rows(self, contents: tuple[str, ...], component: str) -> dict[str, list[Rows]]:
        """Read the rows of one component, by entity path."""
        found: dict[str, list[Rows]] = defaultdict(list)
        for path, chunk in self.chunks(*contents):
            rows = read_rows(chunk, component)
            if rows is not None:
                found[path.strip("/")].append(rows)
        return dict(found)

    def chunks(self, *contents: str, static: bool | None = None) -> Iterator[tuple[str, pa.RecordBatch]]:
        """Read the rows of some entities, chunk by chunk, each with its entity; `/**` at the end stands for all that is below a path.

        Rerun's own index of a file takes 3 to 9 kB of memory for each chunk, this one 0.2 kB.
        """
        with self.path.open("rb") as file:
            for place in self._chunks:
                if static in (None, place.is_static) and any(_is_within(place.entity_path, one) for one in contents):
                    yield place.entity_path, read_chunk(file, place)


def _holding(column: list[tuple[int, npt.NDArray[np.generic]]], index: int) -> npt.NDArray[np.generic] | None:
    """Return the values that hold at a step; None if there are none."""
    at = bisect_right(column, index, key=lambda change: change[0]) - 1
    return column[at][1] if at >= 0 else None


def _is_within(path: str, content: str) -> bool:
    """Tell whether an entity path is the one given, or that or one below it if `/**` follows."""
    root = content.removesuffix("/**")
    return path == root or (content != root and path.startswith(f"{root}/"))


def _require_run(path: Path, terms: Mapping[str, Any]) -> None:
    """Raise RecordingError unless the file holds a run in a format that this program reads."""
    if "particle_spacing" not in terms:
        raise RecordingError(path, "has no run of oilsim, or was cut off before a run began")
    version = terms.get("format_version")
    if version != FORMAT_VERSION:
        raise RecordingError(path, f"has format version {version}, allowed: {FORMAT_VERSION}, which this program reads")


def _unpacked(color: int) -> Color:
    """Split a colour in one number into red, green, blue and opacity."""
    return (color >> 24) & 255, (color >> 16) & 255, (color >> 8) & 255, color & 255


def _body_paths() -> tuple[str, ...]:
    return tuple(f"/{group}/**" for group in entity_paths.BODY_GROUPS)


def _series(parts: list[Rows]) -> Series:
    """Join the chunks of one series and put them in order."""
    if not parts:
        return Series(index=np.empty(0, np.int64), time=np.empty(0), value=np.empty(0))
    index = np.concatenate([part.index for part in parts])
    order = np.argsort(index, kind="stable")
    return Series(
        index=index[order],
        time=np.concatenate([part.time for part in parts])[order],
        value=np.concatenate([part.values for part in parts]).astype(np.float64)[order],
    )

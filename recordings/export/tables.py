"""CSV or Parquet tables of a recording: every series, the log, and particle tracks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from recordings.export.chosen import every, fates
from recordings.files.writing import RecordingError
from recordings.model.frame import PhaseFrame
from recordings.replay.recording import Replay

Format = Literal["csv", "parquet"]
_MOTION = (
    "x", "y", "z", "qx", "qy", "qz", "qw", "vx", "vy", "vz", "wx", "wy", "wz", "fx", "fy", "fz", "tx", "ty", "tz", "tension",
    "held_speed",
)  # fmt: skip


def write_tables(
    replay: Replay,
    folder: Path,
    kind: Format,
    *,
    tracks: Sequence[str] = (),
    ids: Sequence[int] = (),
    interval: float | None = None,
) -> list[Path]:
    """Write tables of series, bodies, events and the particles of ``tracks`` (only ``ids``, if given); return the files.

    Every table has the columns ``step`` and ``time`` [s] first. Series have a row for each instant, bodies and particles a row for each
    instant and body or particle, events a row each. Units are SI; the columns of bodies are pose, twist, wrench, tension and held speed,
    particles of oil have their volume and fate. Series named ``oil/...`` are the rows of the oil ledger. Raises
    RecordingError for a phase or a particle that the recording does not have.
    """
    known = [phase.name for phase in replay.run.phases]
    for name in tracks:
        if name not in known:
            raise RecordingError(replay.given, f"has no particles of {name!r}, allowed: {', '.join(known)}")
    if ids:
        _require_there(replay, tracks, ids)
    folder.mkdir(parents=True, exist_ok=True)
    tables = {"series": _series_table(replay), "bodies": _body_table(replay), "events": _event_table(replay)}
    written = [_write(folder / f"{name}.{kind}", table, kind) for name, table in tables.items() if table.num_rows]
    for name in tracks:
        path = folder / f"particles-{name}.{kind}"
        _write_parts(path, _particle_parts(replay, name, ids, interval), kind)
        written.append(path)
    return written


def _series_table(replay: Replay) -> pa.Table:
    """Build the table of all scalar series; a cell is empty if its series has no value at that instant."""
    times: dict[int, float] = {}
    for series in replay.scalars.values():
        times |= dict(zip(series.index.tolist(), series.time.tolist(), strict=True))
    steps = np.array(sorted(times), dtype=np.int64)
    columns: dict[str, pa.Array] = {"step": pa.array(steps), "time": pa.array([times[step] for step in steps.tolist()])}
    for name, series in sorted(replay.scalars.items()):
        values, known = np.zeros(len(steps)), np.zeros(len(steps), dtype=bool)
        place = np.searchsorted(steps, series.index)
        values[place], known[place] = series.value, True
        columns[name] = pa.array(values, mask=~known)
    return pa.table(columns)


def _body_table(replay: Replay) -> pa.Table:
    parts = []
    for name, series in replay.bodies.items():
        motion = np.column_stack([series.pose, series.twist, series.wrench, series.tension, series.held_speed])
        heads = {"step": series.index, "time": series.time, "body": pa.array([name] * len(series.index))}
        parts.append(pa.table(heads | dict(zip(_MOTION, motion.T, strict=True))))
    return pa.concat_tables(parts) if parts else pa.table({"step": pa.array([], pa.int64())})


def _event_table(replay: Replay) -> pa.Table:
    rows = [{"time": e.time, "level": e.level, "source": e.source, "text": e.text} for e in replay.events]
    return pa.Table.from_pylist(rows)


def _particle_parts(replay: Replay, name: str, ids: Sequence[int], interval: float | None) -> Iterator[pa.Table]:
    """Yield a table for each instant."""
    clock = replay.phase_times(name)
    kept = set(every(clock.index.tolist(), interval, clock.time.tolist()))
    for index, time, frame in replay.phase_frames(name, kept):
        chosen = np.isin(frame.id, np.array(ids, dtype=np.uint32)) if ids else slice(None)
        position = frame.position[chosen]
        columns = {"step": np.full(len(position), index), "time": np.full(len(position), time), "id": frame.id[chosen]}
        columns |= dict(zip("xyz", np.ascontiguousarray(position.T), strict=True))
        yield pa.table(columns | (_of_oil(replay, frame, chosen) if name in replay.run.oils else {}))


def _of_oil(replay: Replay, frame: PhaseFrame, chosen: npt.NDArray[np.bool_] | slice) -> dict[str, pa.Array]:
    """Return the volume [m3] and the fate of each particle of oil, by its code and in words."""
    alike = np.full(len(frame.id), replay.run.particle_volume)
    fate = np.zeros(len(frame.id), np.uint8) if frame.fate is None else frame.fate
    return {
        "volume": (alike if frame.volume is None else frame.volume.astype(np.float64))[chosen],
        "fate_code": fate[chosen],
        "fate": pa.array(np.array(fates(replay))[fate[chosen]].tolist(), pa.string()),
    }


def _require_there(replay: Replay, tracks: Sequence[str], ids: Sequence[int]) -> None:
    """Raise RecordingError for an id of no particle of the `tracks`."""
    frames = (frame.id for name in tracks for _, _, frame in replay.phase_frames(name))
    there = set[int]().union(*(numbers.tolist() for numbers in frames))
    strange = [number for number in ids if number not in there]
    if strange:
        known = f"{min(there)} to {max(there)}" if there else "none is recorded"
        text = f"has no particle {strange[0]} of {', '.join(map(repr, tracks))}, allowed: {known}"
        raise RecordingError(replay.given, text)


def _write(path: Path, table: pa.Table, kind: Format) -> Path:
    if kind == "csv":
        pyarrow.csv.write_csv(table, path)
    else:
        pyarrow.parquet.write_table(table, path)
    return path


def _write_parts(path: Path, parts: Iterator[pa.Table], kind: Format) -> None:
    """Write tables of one schema one after another, so that memory never holds them all."""
    writer = None
    for part in parts:
        if writer is None:
            opened = pyarrow.csv.CSVWriter if kind == "csv" else pyarrow.parquet.ParquetWriter
            writer = opened(path, part.schema)
        writer.write_table(part)
    if writer is not None:
        writer.close()

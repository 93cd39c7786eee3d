"""Read columns of a recording, and the motion of each body over time.

Running extremes: what a series reached between recorded frames, from a second series of its extreme values since the start.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from recordings.model import entity_paths
from recordings.model.frame import BodyFrame

Values = npt.NDArray[np.float64]
WORST = "worst_"
"""Prefix of a series of extreme values, as in ``worst_tow_tension/port``; with several booms, ``main/worst_skirt_angle``."""


def reached(sampled: Values, worst: Values | None) -> Values:
    """Compute the extreme value (N,) [-] of a series, in its own unit, from the frame before to each frame.

    sampled (N,) are the recorded values, worst (M,) the extremes since the run began. If the extreme has changed since
    the frame before, the result is the new extreme; elsewhere, and in the first frame, only the sample is known. None means that no
    extremes were recorded. In a recording that was cut off, M may be less than N.
    """
    values = sampled.copy()
    if worst is not None:
        known = worst[: len(values)]
        changed = np.flatnonzero(np.diff(known, prepend=known[:1]))
        values[changed] = known[changed]
    return values


_NANOSECONDS_PER_SECOND = 1e9


@dataclass(frozen=True, kw_only=True, eq=False)
class Rows:
    """The rows of one chunk that have a value of one component.

    Attributes:
        index: (R,) communication steps.
        time: (R,) simulated time [s].
        lengths: (R,) number of values of each row.
        values: all values one after another, (sum of lengths, ...).
    """

    index: npt.NDArray[np.int64]
    time: npt.NDArray[np.float64]
    lengths: npt.NDArray[np.int64]
    values: npt.NDArray[np.generic]

    def split(self) -> list[npt.NDArray[np.generic]]:
        """Split the values by rows."""
        return np.split(self.values, np.cumsum(self.lengths)[:-1])


def read_rows(batch: pa.RecordBatch, component: str) -> Rows | None:
    """Read the rows of ``batch``, a chunk's, for ``component`` (for example "Points3D:positions"); None if it has none."""
    if component not in batch.schema.names:
        return None
    column = batch.column(component)
    keep = column.is_valid()
    column = column.filter(keep)
    static = entity_paths.TIMELINE_FRAME not in batch.schema.names
    count = len(column)
    zeros = np.zeros(count)
    return Rows(
        index=zeros.astype(np.int64) if static else _integers(batch.column(entity_paths.TIMELINE_FRAME).filter(keep)),
        time=zeros if static else _seconds(batch.column(entity_paths.TIMELINE_TIME).filter(keep)),
        lengths=np.diff(column.offsets.to_numpy()).astype(np.int64),
        values=_values(column.flatten()),
    )


def rows_between(batch: pa.RecordBatch, begin: int, end: int) -> pa.RecordBatch:
    """Return the rows of a chunk from communication step ``begin`` on and before ``end``; the chunk must not be static."""
    steps = _integers(batch.column(entity_paths.TIMELINE_FRAME))
    return batch.filter(pa.array((steps >= begin) & (steps < end)))


def read_single(batch: pa.RecordBatch) -> dict[str, object]:
    """Read the components of a chunk of one row as plain values; a list of one value counts as the value."""
    values: dict[str, object] = {}
    for name in batch.schema.names:
        if pa.types.is_list(batch.schema.field(name).type):
            entry = batch.column(name).to_pylist()[0]
            values[name] = entry[0] if entry is not None and len(entry) == 1 else entry
    return values


def _integers(column: pa.Array) -> npt.NDArray[np.int64]:
    """Read a time column as whole numbers: steps or nanoseconds."""
    return np.asarray(column.cast(pa.int64()).to_numpy(zero_copy_only=False), dtype=np.int64)


def _seconds(column: pa.Array) -> npt.NDArray[np.float64]:
    """Read a column of durations in seconds."""
    return np.asarray(_integers(column) / _NANOSECONDS_PER_SECOND, dtype=np.float64)


def _values(column: pa.Array) -> npt.NDArray[np.generic]:
    """Flatten the values; fixed-size lists such as vectors keep one more dimension."""
    if pa.types.is_fixed_size_list(column.type):
        width = column.type.list_size
        return np.asarray(column.flatten().to_numpy(zero_copy_only=False)).reshape(-1, width)
    return np.asarray(column.to_numpy(zero_copy_only=False))


MOTION = 19  # numbers of a body's motion, see `BodyFrame.motion`


@dataclass(frozen=True, kw_only=True, eq=False)
class BodySeries:
    """A body at N instants.

    index (N,), time (N,) [s], pose (N, 7) [m, 1], twist (N, 6) [m/s, rad/s], wrench (N, 6) [N, N m], tension (N,) [N] and held speed (N,)
    [m/s], NaN of bodies without one.
    """

    index: npt.NDArray[np.int64]
    time: npt.NDArray[np.float64]
    pose: npt.NDArray[np.float64]
    twist: npt.NDArray[np.float64]
    wrench: npt.NDArray[np.float64]
    tension: npt.NDArray[np.float64]
    held_speed: npt.NDArray[np.float64]

    def frame(self, row: int) -> BodyFrame:
        """Return the body at one instant."""
        return BodyFrame(
            position=self.pose[row, :3],
            orientation=self.pose[row, 3:],
            linear_velocity=self.twist[row, :3],
            angular_velocity=self.twist[row, 3:],
            wrench=self.wrench[row],
            tension=float(self.tension[row]),
            held_speed=float(self.held_speed[row]),
        )


def motions_of_all(
    names: Sequence[Rows], motions: Sequence[Rows], tensions: Sequence[Rows], speeds: Sequence[Rows]
) -> Mapping[str, BodySeries]:
    """Read the motions that one entity has of all bodies; each row of `names` holds until the next."""
    if not motions:
        return {}
    named = [(at, some.tolist()) for part in names for at, some in zip(part.index.tolist(), part.split(), strict=True)]
    named.sort(key=lambda change: change[0])
    changes = [at for at, _ in named]
    index, time, motion = _joined(motions)
    tension, speed = _joined(tensions)[2], _joined(speeds)[2]
    order = np.argsort(index, kind="stable")
    holding = np.searchsorted(changes, index[order], side="right") - 1
    pieces: dict[str, list[BodySeries]] = defaultdict(list)
    for change in np.unique(holding).tolist():
        rows, bodies = order[holding == change], named[change][1]
        moved = np.stack([motion[row] for row in rows]).reshape(len(rows), len(bodies), MOTION)
        pulled, held = (np.stack([values[row] for row in rows]) for values in (tension, speed))
        for place, name in enumerate(bodies):
            one = moved[:, place]
            pieces[name].append(
                BodySeries(
                    index=index[rows], time=time[rows], pose=one[:, :7], twist=one[:, 7:13], wrench=one[:, 13:],
                    tension=pulled[:, place], held_speed=held[:, place],
                )
            )  # fmt: skip
    return {name: _end_to_end(parts) for name, parts in pieces.items()}


def _joined(
    parts: Sequence[Rows],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], list[npt.NDArray[np.float64]]]:
    """Join chunks: steps (R,), times (R,) [s], and the values of each row."""
    values = [row.astype(np.float64) for part in parts for row in part.split()]
    return np.concatenate([part.index for part in parts]), np.concatenate([part.time for part in parts]), values


def _end_to_end(parts: Sequence[BodySeries]) -> BodySeries:
    """Join series that follow one another."""
    if len(parts) == 1:
        return parts[0]
    return BodySeries(
        **{one.name: np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(BodySeries)}
    )

"""Rerun chunks as numpy arrays, bit for bit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from recordings import entity_paths

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

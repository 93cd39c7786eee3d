"""The part of a frame that is recorded; it is copied and rounded once for all streams."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from recordings.model.frame import Frame, PhaseFrame, RunDescription
from recordings.model.surface import FilmFrame, SurfaceFrame

MAXIMUM_BLOCK_SECONDS = 0.5  # [s] of wall time that a killed run may lose
MAXIMUM_BLOCK_BYTES = 8 << 20


@dataclass(frozen=True, kw_only=True, eq=False)
class Sample:
    """One recorded frame; its arrays are never written to again.

    bodies: motions (19,), see `BodyFrame.motion` [m, 1, m/s, rad/s, N, N m]; tensions [N] and held speeds [m/s] of bodies that have some;
    lost: particles by the cause of their loss, which are also in their phases; None in a frame that records no oil; surface, film: the sea
    and the oil on it, None in a frame that records none.
    """

    index: int
    time: float
    phases: Mapping[str, PhaseFrame]
    bodies: Mapping[str, npt.NDArray[np.float64]]
    tensions: Mapping[str, float]
    held_speeds: Mapping[str, float]
    lost: Mapping[str, PhaseFrame] | None
    scalars: Mapping[str, float]
    surface: SurfaceFrame | None = None
    film: FilmFrame | None = None

    @property
    def byte_count(self) -> int:
        """Size [bytes] of the particle arrays, which is nearly the whole size."""
        return sum(phase.position.nbytes for phase in self.phases.values())


class Block:
    """Samples that wait to be written; a block is full when it holds enough bytes or wall time.

    Rerun keeps two kilobytes for each part of a block until the file is closed. Blocks of ten frames would more than double the file of a
    small scene and the memory of a long run. Frames that come more slowly than a block's wall time do not wait for others.
    """

    def __init__(self) -> None:
        self.samples: list[Sample] = []
        self._byte_count = 0
        self._started = 0.0
        self._last_added = -math.inf
        self._slow = False

    def add(self, sample: Sample) -> None:
        """Add a sample to the block."""
        now = time.monotonic()
        if not self.samples:
            self._started = now
        self._slow = now - self._last_added >= MAXIMUM_BLOCK_SECONDS
        self._last_added = now
        self.samples.append(sample)
        self._byte_count += sample.byte_count

    @property
    def byte_count(self) -> int:
        """Size [bytes] of the particles in the block."""
        return self._byte_count

    @property
    def full(self) -> bool:
        """True if it is time to write the block."""
        return (
            self._slow
            or self._byte_count >= MAXIMUM_BLOCK_BYTES
            or (bool(self.samples) and time.monotonic() - self._started >= MAXIMUM_BLOCK_SECONDS)
        )

    def take(self) -> list[Sample]:
        """Return the samples and empty the block."""
        samples, self.samples, self._byte_count = self.samples, [], 0
        return samples


def take_sample(
    frame: Frame, *, precision: float | None, phases: Collection[str] | None, run: RunDescription
) -> Sample:
    """Copy the part of a ``frame`` of ``run`` that is recorded; only particles of ``phases`` (None: of all).

    A sample waits for its block, and Rerun then keeps its arrays without copying them. Therefore everything is copied here; a megabyte
    takes a tenth of a millisecond.
    """
    names = [name for name in frame.phases if name in phases] if phases is not None else list(frame.phases)
    taken = {name: _taken(frame.phases[name], precision) for name in names}
    return Sample(
        index=frame.index,
        time=frame.time,
        phases=taken,
        bodies={name: body.motion.copy() for name, body in frame.bodies.items()},
        tensions={name: body.tension for name, body in frame.bodies.items() if not math.isnan(body.tension)},
        held_speeds={name: body.held_speed for name, body in frame.bodies.items() if not math.isnan(body.held_speed)},
        lost=_lost([taken[name] for name in run.oils if name in taken], run.causes),
        scalars=dict(frame.scalars),
    )


def _taken(phase: PhaseFrame, precision: float | None) -> PhaseFrame:
    columns = (None if column is None else column.copy() for column in (phase.volume, phase.width, phase.fate))
    return PhaseFrame(rounded(phase.position, precision), phase.id.copy(), *columns)  # type: ignore[arg-type]


def _lost(oils: Sequence[PhaseFrame], causes: Mapping[str, int]) -> Mapping[str, PhaseFrame] | None:
    """Select the lost oil of the sample, by cause; None if the sample has no oil."""
    if not oils:
        return None
    position, ids = np.concatenate([oil.position for oil in oils]), np.concatenate([oil.id for oil in oils])
    fate = np.concatenate([np.zeros(len(oil.id), np.uint8) if oil.fate is None else oil.fate for oil in oils])
    there = {cause: fate == code for cause, code in causes.items()}
    sizes = [(oil.volume, oil.width) for oil in oils if oil.volume is not None and oil.width is not None]
    columns = [np.concatenate(column) for column in zip(*sizes, strict=True)] if len(sizes) == len(oils) else []
    return {
        cause: PhaseFrame(position[mask], ids[mask], *(column[mask] for column in columns))
        for cause, mask in there.items()
        if mask.any()
    }


def rounded(position: npt.NDArray[np.float32], precision: float | None) -> npt.NDArray[np.float32]:
    """Round a copy of positions (N, 3) [m] to a grid of spacing ``precision`` [m], a power of two; None only copies.

    Scaling by a power of two is exact in binary floating point, so the only error is the rounding, at most half of ``precision``. The
    zero bits at the end of each number help the file's compression.
    """
    if precision is None:
        return position.copy()
    scaled = position * np.float32(1.0 / precision)
    np.rint(scaled, out=scaled)
    scaled *= np.float32(precision)
    return scaled


def grid_within(precision: float) -> float:
    """Return the coarsest grid [m] of a power of two that is not coarser than ``precision`` [m]."""
    return math.ldexp(0.5, math.frexp(precision)[1])


def require_power_of_two(precision: float | None) -> None:
    """Raise ValueError unless the precision [m] is a power of two, which binary numbers hold exactly, or None."""
    if precision is None:
        return
    if not (math.isfinite(precision) and precision > 0.0 and math.frexp(precision)[0] == 0.5):
        raise ValueError(f"the recording's precision is {precision} m, allowed: a power of two such as 1/1024, or None")


def id_ranges(ids: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Encode increasing ids (N,) as runs (2 R,): first id, count, first id, count, ...

    A few numbers stand for a million particles. No ids are one run of length 0: Rerun cannot store a column of empty rows.
    """
    if len(ids) == 0:
        return np.zeros(2, dtype=np.uint32)
    starts = np.concatenate(([0], np.flatnonzero(np.diff(ids.astype(np.int64)) != 1) + 1))
    counts = np.diff(np.concatenate((starts, [len(ids)])))
    return np.column_stack((ids[starts], counts)).astype(np.uint32).ravel()


def ids_of_ranges(ranges: npt.NDArray[np.uint32]) -> npt.NDArray[np.uint32]:
    """Decode the ids (N,) from the runs (2 R,) of `id_ranges`."""
    pairs = np.asarray(ranges, dtype=np.uint32).reshape(-1, 2)
    return np.concatenate([np.arange(first, first + count, dtype=np.uint32) for first, count in pairs.tolist()])

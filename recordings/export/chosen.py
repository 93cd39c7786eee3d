"""The frames and the oil that an export takes from a recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from recordings.files.errors import RecordingError
from recordings.model import entity_paths
from recordings.model.frame import PhaseFrame, RunDescription
from recordings.replay.recording import Replay

AFLOAT = "afloat"  # oil that no boom has lost


@dataclass(frozen=True, kw_only=True, eq=False)
class OilFrame:
    """All oil at one recorded instant.

    position  (N, 3) [m]; id (N,); phase (N,) index into `oil_names`
    cause     (N,) index into ("afloat", *lost_causes)
    volume    (N,) [m3]; width (N,) [m] of the square that a parcel covers, the spacing of particles
    """

    index: int
    time: float
    position: npt.NDArray[np.float32]
    id: npt.NDArray[np.uint32]
    phase: npt.NDArray[np.int32]
    cause: npt.NDArray[np.int32]
    volume: npt.NDArray[np.float64]
    width: npt.NDArray[np.float64]


def oil_names(replay: Replay) -> list[str]:
    """List the phases that are oil; RecordingError if there is none."""
    if not replay.run.oils:
        known = ", ".join(phase.name for phase in replay.run.phases)
        raise RecordingError(replay.given, f"has no oil; its phases are {known}")
    return list(replay.run.oils)


def causes(replay: Replay) -> tuple[str, ...]:
    """List the states that oil may be in, in the order of `OilFrame.cause`."""
    return (AFLOAT, *replay.lost_causes)


def every(indices: list[int], interval: float | None, times: list[float]) -> list[int]:
    """Choose the steps that are at least ``interval`` [s] apart, always with the first and the last; all steps for None."""
    if interval is None or not indices:
        return indices
    kept, last = [], -np.inf
    for index, time in zip(indices, times, strict=True):
        if time - last >= interval * (1.0 - 1e-9):
            kept.append(index)
            last = time
    return kept if kept[-1] == indices[-1] else [*kept, indices[-1]]


def oil_frames(replay: Replay, interval: float | None = None, *, lost_only: bool = False) -> Iterator[OilFrame]:
    """Yield all oil, or only the oil that booms have lost, in frames ``interval`` [s] apart; RecordingError without frames."""
    names = oil_names(replay)
    clock = replay.phase_times(names[0])
    if not len(clock.index):
        raise RecordingError(replay.given, "has no frames")
    indices = every(clock.index.tolist(), interval, clock.time.tolist())
    wanted = set(indices)
    phases = [_by_index(replay, entity_paths.phase(name), wanted) for name in names]
    lost = [_by_index(replay, entity_paths.lost(cause), wanted) for cause in replay.lost_causes]
    times = dict(zip(clock.index.tolist(), clock.time.tolist(), strict=True))
    for index in indices:
        frame = _joined(index, times[index], phases, lost, replay.run)
        if lost_only:
            frame = _where(frame, frame.cause > 0)
        yield frame


def _by_index(replay: Replay, path: str, wanted: set[int]) -> dict[int, PhaseFrame]:
    return {index: frame for index, _, frame in replay.particles(path, wanted)}


def _joined(
    index: int, time: float, phases: list[dict[int, PhaseFrame]], lost: list[dict[int, PhaseFrame]], run: RunDescription
) -> OilFrame:
    """Join the phases of one frame, with the cause of each particle's loss."""
    present = [(number, frames[index]) for number, frames in enumerate(phases) if index in frames]
    ids = np.concatenate([frame.id for _, frame in present])
    cause = np.zeros(len(ids), dtype=np.int32)
    for number, frames in enumerate(lost, start=1):
        if index in frames:
            cause[np.isin(ids, frames[index].id)] = number
    return OilFrame(
        index=index,
        time=time,
        position=np.concatenate([frame.position for _, frame in present]),
        id=ids,
        phase=np.concatenate([np.full(len(frame.id), number, dtype=np.int32) for number, frame in present]),
        cause=cause,
        volume=_of_each([(frame.volume, len(frame.id)) for _, frame in present], run.particle_volume),
        width=_of_each([(frame.width, len(frame.id)) for _, frame in present], run.particle_spacing),
    )


def _of_each(sizes: list[tuple[npt.NDArray[np.float32] | None, int]], alike: float) -> npt.NDArray[np.float64]:
    """Join the sizes (N,) of all parcels; those of particles are `alike`."""
    return np.concatenate([np.full(count, alike) if size is None else size.astype(np.float64) for size, count in sizes])


def _where(frame: OilFrame, chosen: npt.NDArray[np.bool_]) -> OilFrame:
    columns = ("position", "id", "phase", "cause", "volume", "width")
    return replace(frame, **{name: getattr(frame, name)[chosen] for name in columns})

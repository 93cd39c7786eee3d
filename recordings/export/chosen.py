"""The frames, the oil and the oil ledger that an export takes from a recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from recordings.files.writing import RecordingError
from recordings.model import entity_paths
from recordings.model.frame import LOST_BY, PhaseFrame, RunDescription
from recordings.replay.recording import Replay

LEDGER = "oil/"  # beginning of the series of the run's oil ledger


@dataclass(frozen=True, kw_only=True, eq=False)
class OilFrame:
    """All oil on the water and ashore at one recorded instant, and the rows of the ledger, which also has the oil that is gone.

    position  (N, 3) [m]; id (N,); phase (N,) index into `oil_names`
    fate      (N,) codes, places in `fates`
    volume    (N,) [m3]; width (N,) [m] of the square that a parcel covers, the spacing of particles
    ledger    [m3] by the name of the row; empty if the recording has none
    """

    index: int
    time: float
    position: npt.NDArray[np.float32]
    id: npt.NDArray[np.uint32]
    phase: npt.NDArray[np.int32]
    fate: npt.NDArray[np.uint8]
    volume: npt.NDArray[np.float64]
    width: npt.NDArray[np.float64]
    ledger: dict[str, float]


def oil_names(replay: Replay) -> list[str]:
    """List the phases that are oil; RecordingError if there is none."""
    if not replay.run.oils:
        known = ", ".join(phase.name for phase in replay.run.phases)
        raise RecordingError(replay.given, f"has no oil; its phases are {known}")
    return list(replay.run.oils)


def fates(replay: Replay) -> tuple[str, ...]:
    """List the fates that oil may have, in the order of their codes."""
    return replay.run.fates or ("afloat",)


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
    phases = [
        {index: frame for index, _, frame in replay.particles(entity_paths.phase(name), wanted)} for name in names
    ]
    times = dict(zip(clock.index.tolist(), clock.time.tolist(), strict=True))
    ledger = {name.removeprefix(LEDGER): one for name, one in replay.scalars.items() if name.startswith(LEDGER)}
    by_index = {name: dict(zip(one.index.tolist(), one.value.tolist(), strict=True)) for name, one in ledger.items()}
    lost = [code for code, name in enumerate(fates(replay)) if name.startswith(LOST_BY)]
    for index in indices:
        rows = {name: values[index] for name, values in by_index.items() if index in values}
        frame = _joined(index, times[index], phases, replay.run, rows)
        yield _where(frame, np.isin(frame.fate, lost)) if lost_only else frame


def _joined(
    index: int, time: float, phases: list[dict[int, PhaseFrame]], run: RunDescription, ledger: dict[str, float]
) -> OilFrame:
    """Join the phases of one frame."""
    present = [(number, frames[index]) for number, frames in enumerate(phases) if index in frames]
    return OilFrame(
        index=index,
        time=time,
        position=np.concatenate([frame.position for _, frame in present]),
        id=np.concatenate([frame.id for _, frame in present]),
        phase=np.concatenate([np.full(len(frame.id), number, dtype=np.int32) for number, frame in present]),
        fate=_of_each([(frame.fate, len(frame.id)) for _, frame in present], 0.0).astype(np.uint8),
        volume=_of_each([(frame.volume, len(frame.id)) for _, frame in present], run.particle_volume),
        width=_of_each([(frame.width, len(frame.id)) for _, frame in present], run.particle_spacing),
        ledger=ledger,
    )


def _of_each(columns: list[tuple[npt.NDArray[np.generic] | None, int]], alike: float) -> npt.NDArray[np.float64]:
    """Join values (N,) of all parcels; those of particles are `alike`."""
    return np.concatenate([np.full(count, alike) if one is None else one.astype(np.float64) for one, count in columns])


def _where(frame: OilFrame, chosen: npt.NDArray[np.bool_]) -> OilFrame:
    columns = ("position", "id", "phase", "fate", "volume", "width")
    return replace(frame, **{name: getattr(frame, name)[chosen] for name in columns})

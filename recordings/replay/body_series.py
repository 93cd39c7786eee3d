"""The motions of bodies over time, from the rows of a recording."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from recordings import entity_paths
from recordings.frame import BodyFrame
from recordings.replay.columns import Rows

MOTION = 19  # numbers of a body's motion, see `BodyFrame.motion`


@dataclass(frozen=True, kw_only=True, eq=False)
class BodySeries:
    """A body at N instants.

    index (N,), time (N,) [s], pose (N, 7) [m, 1], twist (N, 6) [m/s, rad/s], wrench (N, 6) [N, N m] and tension (N,) [N], NaN without one.
    """

    index: npt.NDArray[np.int64]
    time: npt.NDArray[np.float64]
    pose: npt.NDArray[np.float64]
    twist: npt.NDArray[np.float64]
    wrench: npt.NDArray[np.float64]
    tension: npt.NDArray[np.float64]

    def frame(self, row: int) -> BodyFrame:
        """Return the body at one instant."""
        return BodyFrame(
            position=self.pose[row, :3],
            orientation=self.pose[row, 3:],
            linear_velocity=self.twist[row, :3],
            angular_velocity=self.twist[row, 3:],
            wrench=self.wrench[row],
            tension=float(self.tension[row]),
        )


def motions_of_all(
    names: Sequence[Rows], motions: Sequence[Rows], tensions: Sequence[Rows]
) -> Mapping[str, BodySeries]:
    """Read the motions that one entity has of all bodies; each row of `names` holds until the next."""
    if not motions:
        return {}
    named = [(at, some.tolist()) for part in names for at, some in zip(part.index.tolist(), part.split(), strict=True)]
    named.sort(key=lambda change: change[0])
    changes = [at for at, _ in named]
    index, time, motion = _joined(motions)
    tension = _joined(tensions)[2]
    order = np.argsort(index, kind="stable")
    holding = np.searchsorted(changes, index[order], side="right") - 1
    pieces: dict[str, list[BodySeries]] = defaultdict(list)
    for change in np.unique(holding).tolist():
        rows, bodies = order[holding == change], named[change][1]
        moved = np.stack([motion[row] for row in rows]).reshape(len(rows), len(bodies), MOTION)
        pulled = np.stack([tension[row] for row in rows])
        for place, name in enumerate(bodies):
            pieces[name].append(_series(index[rows], time[rows], moved[:, place], pulled[:, place]))
    return {name: _end_to_end(parts) for name, parts in pieces.items()}


def motions_of_each(
    motions: Mapping[str, Sequence[Rows]], tensions: Mapping[str, Sequence[Rows]]
) -> Mapping[str, BodySeries]:
    """Read the motions of recordings of format 1, which have an entity for each body, by its path."""
    return dict(_each(motions, tensions))


def _each(
    motions: Mapping[str, Sequence[Rows]], tensions: Mapping[str, Sequence[Rows]]
) -> Iterator[tuple[str, BodySeries]]:
    for path, parts in motions.items():
        index, time, motion = _joined(parts)
        pulled = np.concatenate(_joined(tensions[path])[2]) if path in tensions else np.full(len(index), np.nan)
        order = np.argsort(index, kind="stable")
        series = _series(index[order], time[order], np.array(motion)[order], pulled[order])
        yield entity_paths.body_name(path), series


def _joined(
    parts: Sequence[Rows],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], list[npt.NDArray[np.float64]]]:
    """Join chunks: steps (R,), times (R,) [s], and the values of each row."""
    values = [row.astype(np.float64) for part in parts for row in part.split()]
    return np.concatenate([part.index for part in parts]), np.concatenate([part.time for part in parts]), values


def _series(
    index: npt.NDArray[np.int64],
    time: npt.NDArray[np.float64],
    motion: npt.NDArray[np.float64],
    tension: npt.NDArray[np.float64],
) -> BodySeries:
    return BodySeries(
        index=index, time=time, pose=motion[:, :7], twist=motion[:, 7:13], wrench=motion[:, 13:], tension=tension
    )


def _end_to_end(parts: Sequence[BodySeries]) -> BodySeries:
    """Join series that follow one another."""
    if len(parts) == 1:
        return parts[0]
    return BodySeries(
        **{one.name: np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(BodySeries)}
    )

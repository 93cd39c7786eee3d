"""A run that was continued, in several recordings, read as one: each piece up to where the next one branches off."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from recordings.errors import RecordingError
from recordings.frame import Event, PhaseFrame
from recordings.replay.body_series import BodySeries
from recordings.replay.recording import Replay, Series

CONTINUES = "continues"
"""Property of a recording that goes on from another one: JSON of a `Branch`."""
# entries of a scenario that the course of a run does not depend on, and that may differ from piece to piece
_TERMS = ("title", "text", "recording", "camera", "criteria", "demo")
_RUN_TERMS = ("duration", "threads")
Piece = TypeVar("Piece", Series, BodySeries)


@dataclass(frozen=True, kw_only=True)
class Branch:
    """The place from which a run goes on: `recording`, seen from the folder of the later one, communication step and time [s]."""

    recording: str
    index: int
    time: float

    def as_json(self) -> str:
        """Return the text for a recording's property."""
        return json.dumps(vars(self))


def branch_of(replay: Replay) -> Branch | None:
    """Return the place from which a recording goes on; None for one that begins at the start of its run."""
    text = replay.properties.get("run", {}).get(CONTINUES)
    return Branch(**json.loads(str(text))) if text else None


class JoinedReplay(Replay):
    """A recording and those that it goes on from, with the interface of one recording; description and end are those of the last."""

    def __init__(self, path: str | Path) -> None:
        """Open a recording, and all before it that are still there.

        `branches` are the places at which it was continued, in order of time; `missing` says why a piece before these could not be read,
        and is empty if the run is whole.
        """
        super().__init__(path)
        self._last = Replay(self.path)  # its own series, beside the joined ones
        self.branches: list[Branch] = []
        self.missing = ""
        self._earlier: list[tuple[Replay, int]] = []  # with the step from which on the next piece holds
        folder, piece = Path(path).parent, _Opened(self._last, None)
        while piece.branch is not None:
            source = folder / piece.branch.recording
            self.branches.insert(0, piece.branch)
            try:
                piece = _Opened(Replay(source), piece)
            except RecordingError as error:
                self.missing = f"{source.name} {error.reason}"
                return
            if not piece.leads_to_next():
                self.missing = f"{source.name} holds another run by now"
                return
            self._earlier.insert(0, (piece.replay, piece.end))
            folder = source.parent

    @cached_property
    def scalars(self) -> Mapping[str, Series]:
        """Every scalar series of all pieces by its name."""
        return _joined([(dict(one.scalars), end) for one, end in self._earlier], dict(self._last.scalars))

    @cached_property
    def bodies(self) -> Mapping[str, BodySeries]:
        """Every body's motion in all pieces by its name."""
        return _joined([(dict(one.bodies), end) for one, end in self._earlier], dict(self._last.bodies))

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """The events of all pieces, each up to the branch from it; those that a later piece repeats there count once."""
        kept: list[Event] = []
        for (one, _), branch in zip(self._earlier, self.branches[-len(self._earlier) :], strict=False):
            kept += [event for event in one.events if event.time <= branch.time * (1.0 + 1e-9)]
            kept = [event for event in kept if event.time <= branch.time * (1.0 + 1e-9)]
        return tuple(sorted(dict.fromkeys([*kept, *self._last.events]), key=lambda event: event.time))

    @cached_property
    def lost_causes(self) -> tuple[str, ...]:
        """Every cause by which booms have lost oil in any piece."""
        return tuple(
            sorted({cause for one, _ in self._earlier for cause in one.lost_causes} | set(self._last.lost_causes))
        )

    def particles(self, path: str, indices: Collection[int] | None = None) -> Iterator[tuple[int, float, PhaseFrame]]:
        """Yield step, time [s] and particles at an entity path, frame by frame through all pieces; only at ``indices``, if given."""
        begin = 0
        for one, end in self._earlier:
            for index, time, frame in one.particles(path, indices):
                if begin <= index < end:
                    yield index, time, frame
            begin = end
        yield from self._last.particles(path, indices)

    def particle_times(self, path: str) -> Series:
        """Return the steps and times at which the particles at an entity path were recorded, with their number as value."""
        series, last = [(one.particle_times(path), end) for one, end in self._earlier], self._last.particle_times(path)
        return _joined([({path: one}, end) for one, end in series], {path: last})[path]


class _Opened:
    """A piece that has been opened, and the piece after it, if any."""

    def __init__(self, replay: Replay, after: _Opened | None) -> None:
        self.replay, self._after = replay, after
        self.branch = branch_of(replay)
        self._plan: dict[str, Any] = json.loads(str(replay.properties.get("run", {}).get("plan") or "{}"))

    @property
    def end(self) -> int:
        """The step from which on the next piece holds: its first recorded one, at the latest the one after the branch."""
        assert self._after is not None and self._after.branch is not None
        first = [int(one.index[0]) for one in self._after.replay.scalars.values() if len(one.index)]
        return min([*first, self._after.branch.index + 1])

    def leads_to_next(self) -> bool:
        """Tell whether the next piece goes on from this run: the same scenario but for its terms, and the same orders until the branch."""
        assert self._after is not None and self._after.branch is not None
        return self._course(self._after.branch.index) == self._after._course(self._after.branch.index)

    def _course(self, index: int) -> tuple[Any, ...]:
        scenario: dict[str, Any] = self._plan.get("scenario", {})
        course = {key: value for key, value in scenario.items() if key not in (*_TERMS, "run")}
        run = {key: value for key, value in scenario.get("run", {}).items() if key not in _RUN_TERMS}
        return course, run, [action for action in self._plan.get("actions", []) if action["index"] < index]


def _joined(earlier: list[tuple[dict[str, Piece], int]], last: dict[str, Piece]) -> dict[str, Piece]:
    """Join the series of pieces by name, each up to the step at which the next one begins."""
    parts, begin = defaultdict[str, list[Piece]](list), 0
    whole = list(earlier)
    whole.append((last, np.iinfo(np.int64).max))
    for pieces, end in whole:
        for name, piece in pieces.items():
            parts[name].append(_between(piece, begin, end))
        begin = end
    return {name: _one_after_another(found) for name, found in parts.items()}


def _between(piece: Piece, begin: int, end: int) -> Piece:
    rows = (piece.index >= begin) & (piece.index < end)
    return replace(piece, **{item.name: getattr(piece, item.name)[rows] for item in fields(piece)})


def _one_after_another(parts: list[Piece]) -> Piece:
    """Put the rows of one series' parts after one another; an empty part may have no width."""
    filled = [part for part in parts if len(part.index)] or parts[:1]
    return replace(
        filled[0],
        **{item.name: np.concatenate([getattr(part, item.name) for part in filled]) for item in fields(filled[0])},
    )

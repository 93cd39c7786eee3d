"""A run that was continued, in several recordings, read as one: each piece up to where the next one branches off."""

from __future__ import annotations

import json
import shlex
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pyarrow as pa

from recordings.files.writing import RecordingError
from recordings.model.frame import Event
from recordings.replay.recording import Replay
from recordings.replay.series import rows_between

CONTINUES = "continues"
"""Property of a recording that goes on from another one: JSON of a `Branch`."""
# entries of a scenario that the course of a run does not depend on, and that may differ from piece to piece
_TERMS = ("title", "text", "recording", "camera", "criteria", "demo")
_RUN_TERMS = ("duration", "threads")


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
        and is empty if the run is whole. Raises RecordingError as `Replay` does, for the recording itself.
        """
        self._earlier: list[_Piece] = []
        self._own = Replay(path)
        vars(self).update(vars(self._own))  # a file is read through once, to see whether it is whole
        self.branches: list[Branch] = []
        self.missing = ""
        read = {Path(path).resolve()}
        folder, piece = Path(path).parent, _Opened(self._own, None)
        while piece.branch is not None:
            source = folder / piece.branch.recording
            self.branches.insert(0, piece.branch)
            if source.resolve() in read:  # a later piece was renamed to an earlier one's name
                self.missing = f"{source.name} goes on from itself"
                return
            read.add(source.resolve())
            try:
                piece = _Opened(Replay(source), piece)
            except RecordingError as error:
                self.missing = f"{source.name} {error.reason}"
                return
            if not piece.leads_to_next():
                self.missing = f"{source.name} holds another run by now"
                return
            self._earlier.insert(0, _Piece(piece.replay, piece.end, self.branches[0]))
            folder = source.parent

    def chunks(self, *contents: str, static: bool | None = None) -> Iterator[tuple[str, pa.RecordBatch]]:
        """Read the rows of some entities, chunk by chunk: those of each piece until the next one begins, static ones of the last."""
        begin = 0
        for piece in self._earlier if static is not True else ():
            for path, chunk in piece.replay.chunks(*contents, static=False):
                kept = rows_between(chunk, begin, piece.end)
                if kept.num_rows:
                    yield path, kept
            begin = piece.end
        yield from super().chunks(*contents, static=static)

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """The events of all pieces, each up to the branch from it; those that a later piece repeats there count once."""
        kept: list[Event] = []
        for piece in self._earlier:
            kept += piece.replay.events
            kept = [event for event in kept if event.time <= piece.branch.time * (1.0 + 1e-9)]
        return tuple(sorted(dict.fromkeys([*kept, *self._own.events]), key=lambda event: event.time))


@dataclass(frozen=True, eq=False)
class _Piece:
    """A recording that was gone on from: the step from which on the next piece holds, and where that branches off."""

    replay: Replay
    end: int
    branch: Branch


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
        return course, run, [order for order in self._orders() if order[0] < index]

    def _orders(self) -> list[tuple[int, str]]:
        """Return all orders, with their steps, in order: those of the plan as the run began, and those that came while it went on."""
        step = self._plan.get("scenario", {}).get("run", {}).get("communication_step", 1.0)
        planned = [(one["index"], f"orders {shlex.join(one['set'])}") for one in self._plan.get("actions", [])]
        told = [
            (round(event.time / step), event.text)
            for event in self.replay.events
            if event.is_order and event.text.startswith("orders ")
        ]
        came = Counter(told) - Counter(planned)
        return sorted([*planned, *came.elements()])

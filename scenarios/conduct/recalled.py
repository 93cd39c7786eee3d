"""Recall a recording that a console resumes: the pieces of that run, so that marks and branches reach back, and its log."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from recordings.replay.joined import JoinedReplay
from scenarios.conduct.conducted_run import Errand, line_of


def end_and_names(recording: Path) -> tuple[float, list[str]]:
    """Return the last recorded time [s] of a run, and the names of its recordings; RecordingError for what is no recording."""
    replay = JoinedReplay(recording)
    end = max((float(one.time[-1]) for one in replay.scalars.values() if len(one.time)), default=0.0)
    return end, [recording.name, *(Path(branch.recording).name for branch in replay.branches)]


def recalled(errand: Errand) -> tuple[list[Errand], list[dict[str, Any]]]:
    """Return the pieces of the run that `errand` resumes, from its start, and its log up to there, each mark with its recording's name."""
    assert errand.source is not None
    replay, pieces = JoinedReplay(errand.source), list[Errand]()
    began = 0.0
    for branch in replay.branches:
        record = errand.source.with_name(Path(branch.recording).name)
        pieces.append(Errand(scenario=errand.scenario, record=record, source=_last(pieces), at=began))
        began = branch.time
    pieces.append(Errand(scenario=errand.scenario, record=errand.source, source=_last(pieces), at=began))
    events = [event for event in replay.events if event.time <= errand.at + 1e-9]
    held_by = [max((piece for piece in pieces if piece.at <= event.time), key=lambda one: one.at) for event in events]
    lines = [line_of(event) | {"recording": piece.record.name} for event, piece in zip(events, held_by, strict=True)]
    return pieces, lines


def _last(pieces: list[Errand]) -> Path | None:
    return pieces[-1].record if pieces else None

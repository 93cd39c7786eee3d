"""Remarks on what a scenario plans for a time after its run's end, and what so never comes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from scenarios.schema.exercise import TowSettings
from scenarios.schema.injects import InjectSettings
from scenarios.schema.liquid import PipeEmitterSettings


def never_comes(
    end: float, tow: TowSettings | None, pipes: Mapping[str, PipeEmitterSettings], injects: Mapping[str, InjectSettings]
) -> Iterator[str]:
    """Say in words what never comes of a tow, pipes and injects in a run that ends at `end` [s]."""
    after = f"the run ends at {end:g} s (run.duration)"
    if tow is not None and tow.start >= end:
        yield f"tow.start is {tow.start:g} s: the vessels never get under way, as {after}"
    for name, emitter in pipes.items():
        if emitter.start >= end:
            yield f"emitters.{name}.start is {emitter.start:g} s: nothing flows, as {after}"
    for name, inject in injects.items():
        if inject.at is not None and inject.at - inject.spread >= end:
            yield f"injects.{name}.at is {inject.at:g} s: it never comes, as {after}"

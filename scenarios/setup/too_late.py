"""Remarks on what a scenario plans for a time after its run's end, and what so never comes."""

from __future__ import annotations

from collections.abc import Iterator

from scenarios.spec.resolve import RunSpec


def never_comes(scenario: RunSpec) -> tuple[str, ...]:
    """Say in words what never comes of a tow, pipes and injects."""
    return tuple(_told(scenario))


def _told(scenario: RunSpec) -> Iterator[str]:
    end = scenario.run.duration
    after = f"the run ends at {end:g} s (run.duration)"
    if scenario.tow is not None and scenario.tow.start >= end:
        yield f"tow.start is {scenario.tow.start:g} s: the vessels never get under way, as {after}"
    for name, emitter in {**scenario.emitters, **scenario.sources}.items():
        if emitter.start >= end:
            yield f"emitters.{name}.start is {emitter.start:g} s: nothing flows, as {after}"
    for name, inject in scenario.injects.items():
        if inject.at is not None and inject.at - inject.spread >= end:
            yield f"injects.{name}.at is {inject.at:g} s: it never comes, as {after}"

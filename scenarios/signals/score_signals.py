"""The scores of a run's booms as signals, for the conditions of injects and the master of an exported exercise."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

from booms.containment import ContainmentReport
from oilsim.slick.loss_cause import LossCause
from scenarios.signals.signal_table import RunParts, ScoredBoom, Signal, SignalTables

VOLUMES = ("inside", "outside", "retained", "free", "lost", "passed", "removed", "recovered")
SHAPE = (("gap_ratio", "1"), ("normal_speed", "m/s"), ("effective_draft", "m"), ("skirt_angle", "rad"))


def scores_of(exercise: SignalTables) -> dict[str, Signal]:
    """List the scores of all booms by name; 0 before the first communication point."""
    return {signal.name: signal for boom in exercise.booms for signal in _scores(boom)}


def _scores(boom: str) -> Iterator[Signal]:
    """Yield volumes of oil, also of lost oil by cause and by closures; the boom's shape; speeds at first and gross loss, 0 until then."""
    prefix = f"booms.{boom}"
    for name in VOLUMES:
        yield Signal(name=f"{prefix}.oil_{name}", unit="m3", read=partial(_reported, boom, partial(_field, name)))
    for cause in LossCause:
        name = cause.name.lower()
        yield Signal(
            name=f"{prefix}.oil_lost.{name}", unit="m3", read=partial(_reported, boom, partial(_lost_by, name))
        )
    yield Signal(name=f"{prefix}.oil_lost_modelled", unit="m3", read=partial(_reported, boom, _lost_modelled))
    for name, unit in SHAPE:
        yield Signal(name=f"{prefix}.{name}", unit=unit, read=partial(_reported, boom, partial(_field, name)))
    yield Signal(name=f"{prefix}.retained_share", unit="1", read=partial(_retained_share, boom))
    yield Signal(name=f"{prefix}.normal_speed_held", unit="m/s", read=partial(_held_speed, boom))
    for name in ("first_loss_speed", "gross_loss_speed"):
        yield Signal(name=f"{prefix}.{name}", unit="m/s", read=partial(_loss_speed, boom, name))


def _reported(boom: str, of: Callable[[ContainmentReport], float], parts: RunParts) -> float:
    report = _score(boom, parts).report
    return 0.0 if report is None else of(report)


def _field(name: str, report: ContainmentReport) -> float:
    return float(getattr(report, name))


def _lost_by(cause: str, report: ContainmentReport) -> float:
    return report.lost_by_cause.get(cause, 0.0)


def _lost_modelled(report: ContainmentReport) -> float:
    """Return the part of the lost oil that closures carried out; the rest is resolved."""
    return math.fsum(report.lost_modelled.values())


def _retained_share(boom: str, parts: RunParts) -> float:
    """Return the share of all oil that the boom has met that it has not lost; 1 before it has met any."""
    share = _score(boom, parts).retained_share
    return 1.0 if share is None else share


def _loss_speed(boom: str, name: str, parts: RunParts) -> float:
    return getattr(_score(boom, parts), name)() or 0.0


def _held_speed(boom: str, parts: RunParts) -> float:
    return _score(boom, parts).held_speed


def _score(boom: str, parts: RunParts) -> ScoredBoom:
    return next(score for score in parts.scoring.booms if score.name == boom)

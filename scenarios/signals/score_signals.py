"""The scores of a run's booms, and its oil ledger, as signals, for the conditions of injects and the master of an exported exercise."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from oilsim.oil.ledger import BoomOil, OilRows
from scenarios.signals.signal_table import RunParts, Signal, SignalTables

SHAPE = {"gap_ratio": "1", "normal_speed": "m/s", "effective_draft": "m", "skirt_angle": "rad"}
SPEEDS = ("normal_speed_held", "first_loss_speed", "gross_loss_speed")


def scores_of(exercise: SignalTables) -> dict[str, Signal]:
    """List the ledger and the scores of all booms by name; 0 before the first communication point."""
    return {signal.name: signal for boom in exercise.booms for signal in _scores(boom)} | {
        (name := series.replace("/", ".")): Signal(name=name, unit="m3", read=partial(_row, series))
        for series in (OilRows().series() if exercise.booms else ())
    }


def _scores(boom: str) -> Iterator[Signal]:
    """Yield volumes of oil, also by cause, and in all by closures; the boom's shape; speeds, of first and gross loss 0 until then."""
    volumes = [series for series in BoomOil().series() if not series.startswith("oil_lost_modelled/")]
    units = dict.fromkeys(volumes, "m3") | {"oil_contained_share": "1"} | SHAPE | dict.fromkeys(SPEEDS, "m/s")
    for series, unit in units.items():
        start = 1.0 if series == "oil_contained_share" else 0.0
        name = f"booms.{boom}.{series.replace('/', '.')}"
        yield Signal(name=name, unit=unit, read=partial(_value, boom, series, start))


def _value(boom: str, series: str, start: float, parts: RunParts) -> float:
    score = next(score for score in parts.scoring.booms if score.name == boom)
    return score.values.get(series, start)


def _row(series: str, parts: RunParts) -> float:
    return parts.scoring.ledger.rows.series()[series]

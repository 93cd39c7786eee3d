"""The results of the runs of a sweep, laid side by side."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from scenarios.sweeps.variants import Variant

COMPARED_PARTS = ("oil_m3", "scores", "skimmers")  # parts of a summary that a sweep compares
RUN = ("ended", "simulated_s", "wall_s", "density_error")  # what its table on disk holds besides


@dataclass(frozen=True)
class Outcome:
    """A variant of the scenario and the summary of its run."""

    variant: Variant
    summary: Mapping[str, Any]

    def figures(self) -> dict[str, float]:
        """Return the compared figures, by keys as in ``scores.main.first_loss_speed_kn``; those not measured are left out.

        Probes give their last reading.
        """
        found = {key: value for part in COMPARED_PARTS for key, value in _leaves(self.summary.get(part, {}), part)}
        found |= {
            f"probes.{name}": series["value"][-1] for name, series in self.summary["probes"].items() if series["value"]
        }
        return {key: value for key, value in found.items() if isinstance(value, int | float)}


def read_summary(path: Path) -> Mapping[str, Any] | None:
    """Read the summary of a run; None if there is none, or no whole one: half written by a program that was killed, or damaged."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError, RecursionError):
        return None
    if not (isinstance(content, dict) and {*RUN, "probes"} <= content.keys() and isinstance(content["probes"], dict)):
        return None
    numbers = all(
        isinstance(content[key], int | float) and abs(content[key]) < math.inf for key in ("simulated_s", "wall_s")
    )
    series = [one.get("value") if isinstance(one, dict) else None for one in content["probes"].values()]
    is_whole = numbers and isinstance(content["ended"], str) and all(isinstance(values, list) for values in series)
    return content if is_whole else None


def table(outcomes: Sequence[Outcome]) -> Table:
    """Build the table of the runs, one column each: the varied entries, and the figures that differ."""
    figures = [outcome.figures() for outcome in outcomes]
    shown = Table("run", title="figures that differ between the runs", title_justify="left")
    shown.columns[0].no_wrap = True
    for number in range(len(outcomes)):
        shown.add_column(f"{number + 1}", justify="right")
    for key in outcomes[0].variant.values:
        shown.add_row(key, *(outcome.variant.values[key] for outcome in outcomes), style="bold")
    for key in differing(figures):
        shown.add_row(key, *(f"{own[key]:.4g}" if key in own else "-" for own in figures))
    return shown


def differing(figures: Sequence[Mapping[str, float]]) -> list[str]:
    """List the keys of figures that are not equal in all runs, in the order of the summaries."""
    keys = dict.fromkeys(key for own in figures for key in own)
    return [key for key in keys if len({own.get(key) for own in figures}) > 1]


def write_table(outcomes: Sequence[Outcome], path: Path) -> None:
    """Write one row for each run: the varied entries, how the run ended, and every figure."""
    rows = _rows(outcomes)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, dict.fromkeys(key for row in rows for key in row))
        writer.writeheader()
        writer.writerows(rows)


def write_parquet(outcomes: Sequence[Outcome], path: Path) -> None:
    """Write the same rows as a Parquet file, columns of numbers as numbers; what a run has not is null."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = _rows(outcomes)
    columns = {
        key: _column([row.get(key) for row in rows]) for key in dict.fromkeys(key for row in rows for key in row)
    }
    pq.write_table(pa.table(columns), path)


def _column(values: Sequence[Any]) -> list[Any]:
    """Turn the values of a column into numbers if all of them are; else into texts."""
    try:
        return [None if value is None else float(value) for value in values]
    except (ValueError, TypeError, OverflowError):
        return [None if value is None else str(value) for value in values]


def _rows(outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    return [
        {"run": outcome.variant.name}
        | outcome.variant.values
        | {key: value for part in RUN for key, value in _leaves(outcome.summary[part], part)}
        | outcome.figures()
        for outcome in outcomes
    ]


def _leaves(entry: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(entry, Mapping):
        for key, value in entry.items():
            yield from _leaves(value, f"{path}.{key}")
    else:
        yield path, entry

"""Runs a scenario once for every combination of some of its entries' values, and lays out side by side what came of it."""

from __future__ import annotations

import csv
import json
import time as wall_clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from scenarios.exit_codes import DONE, FAILED
from scenarios.problems import Problem, ScenarioError
from scenarios.progress import clock
from scenarios.run import RunOptions, run_scenario
from scenarios.terminal import terminal
from scenarios.variants import Variant

SHOWN = ("oil_m3", "scores")  # parts of a summary that a sweep compares
RUN = ("ended", "simulated_s", "wall_s", "density_error")  # what its table on disk holds besides


@dataclass(frozen=True)
class Outcome:
    """A variant and the summary of its run."""

    variant: Variant
    summary: Mapping[str, Any]

    def figures(self) -> dict[str, float]:
        """What is compared, by keys as in ``scores.main.first_loss_speed_kn``; what was not measured is left out.

        Of probes, what they read last.
        """
        found = {key: value for part in SHOWN for key, value in _leaves(self.summary[part], part)}
        found |= {
            f"probes.{name}": series["value"][-1] for name, series in self.summary["probes"].items() if series["value"]
        }
        return {key: value for key, value in found.items() if isinstance(value, int | float)}


def run_sweep(
    chosen: Sequence[Variant], folder: Path, *, recorded: bool = False, console: Console | None = None
) -> int:
    """Run what has not been run yet, with a summary and, if `recorded`, a recording each, and write sweep.csv and sweep.png.

    Returns the exit code of the `oilsim` command: that of the first failed run, or of the signal that stopped the sweep. A later
    call with the same folder goes on: complete runs of the same scenario are not repeated.
    """
    console = console or terminal(stderr=True)
    _make(folder)
    outcomes: list[Outcome] = []
    spent: list[float] = []
    code = DONE
    for number, variant in enumerate(chosen, 1):
        summary = folder / f"{variant.name}.json"
        head = f"{number} of {len(chosen)}: {variant.title}"
        if _is_complete(summary, variant):
            console.print(f"{head}, is there already", highlight=False)
        else:
            left = sum(spent) / len(spent) * (len(chosen) - number + 1) if spent else None
            console.print(head if left is None else f"{head}, about {clock(left)} left", style="bold", highlight=False)
            begin = wall_clock.perf_counter()
            ended = _run(variant, folder, recorded, console)
            spent.append(wall_clock.perf_counter() - begin)
            code = code or ended
            if ended not in (DONE, FAILED):
                break
        if summary.is_file():
            outcomes.append(Outcome(variant, json.loads(summary.read_text(encoding="utf-8"))))
    _leave(outcomes, folder, console)
    return code


def table(outcomes: Sequence[Outcome]) -> Table:
    """A column a run: what was varied, and the figures that differ."""
    figures = [outcome.figures() for outcome in outcomes]
    shown = Table("run", title="what differs between the runs", title_justify="left")
    shown.columns[0].no_wrap = True
    for number in range(len(outcomes)):
        shown.add_column(f"{number + 1}", justify="right")
    for key in outcomes[0].variant.values:
        shown.add_row(key, *(outcome.variant.values[key] for outcome in outcomes), style="bold")
    for key in differing(figures):
        shown.add_row(key, *(f"{own[key]:.4g}" if key in own else "-" for own in figures))
    return shown


def differing(figures: Sequence[Mapping[str, float]]) -> list[str]:
    """The keys of figures that are not the same in all runs, in the order of the summaries."""
    keys = dict.fromkeys(key for own in figures for key in own)
    return [key for key in keys if len({own.get(key) for own in figures}) > 1]


def _run(variant: Variant, folder: Path, recorded: bool, console: Console) -> int:
    plan = variant.plan
    options = RunOptions(
        record=folder / f"{variant.name}.rrd" if recorded else None,
        summary=folder / f"{variant.name}.json",
        source=variant.source,
    )
    return run_scenario(plan.scenario, text=plan.text, overrides=plan.overrides, options=options, console=console)


def _leave(outcomes: Sequence[Outcome], folder: Path, console: Console) -> None:
    """Print and write what the runs came to."""
    if not outcomes:
        return
    _write_table(outcomes, folder / "sweep.csv")
    told = f"all figures: {folder / 'sweep.csv'}"
    if differing([outcome.figures() for outcome in outcomes]):
        from scenarios.sweep_chart import draw_sweep

        draw_sweep(outcomes, folder / "sweep.png")
        console.print(table(outcomes))
        told += f", picture: {folder / 'sweep.png'}"
    console.print(told, highlight=False)


def _write_table(outcomes: Sequence[Outcome], path: Path) -> None:
    """One row a run: what was varied, how it ended, every figure."""
    rows = [
        {"run": outcome.variant.name}
        | outcome.variant.values
        | {key: value for part in RUN for key, value in _leaves(outcome.summary[part], part)}
        | outcome.figures()
        for outcome in outcomes
    ]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, dict.fromkeys(key for row in rows for key in row))
        writer.writeheader()
        writer.writerows(rows)


def _is_complete(summary: Path, variant: Variant) -> bool:
    """Whether the variant has been run to its end."""
    try:
        content = json.loads(summary.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):  # of a program that was killed while it wrote half is there
        return False
    return bool(content["ended"] == "completed" and content["simulated_s"] >= variant.plan.scenario.run.duration - 1e-9)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        text = f"is {str(folder)!r}, which cannot be made: {error.strerror or error}, allowed: a new folder, or that of an earlier sweep"
        raise ScenarioError([Problem("--to", text)], "oilsim") from error


def _leaves(entry: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(entry, Mapping):
        for key, value in entry.items():
            yield from _leaves(value, f"{path}.{key}")
    else:
        yield path, entry

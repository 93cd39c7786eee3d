"""The report: how errors and gates become rows, the Markdown table, the JSON file and one picture a case."""

from __future__ import annotations

import json
import math
import os
import platform
import subprocess
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from coupling.testkit.body_checks import order_of_convergence
from tests.validation.case import Case, Outcome, Panel, Quantity, Trace

COLORS = ("#9ecae1", "#4292c6", "#08306b")  # coarse, middle, reference
STYLES = ("-", "--", "-.", ":")
NOT_RUN = Outcome(values={})


@dataclass(frozen=True, kw_only=True)
class Level:
    """One run of a case: resolution, what it measured, its cost; `failure` is the error that ended it."""

    resolution: int
    outcome: Outcome = NOT_RUN
    wall_seconds: float = 0.0
    particle_steps: int = 0
    advance_seconds: float = 0.0
    failure: str = ""

    @property
    def rate(self) -> float:
        """Particle-steps per second of wall time spent in advances."""
        return self.particle_steps / self.advance_seconds if self.advance_seconds > 0.0 else 0.0


@dataclass(frozen=True)
class CaseResult:
    """A case and its runs, coarse to fine."""

    case: Case
    levels: list[Level] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether the reference spacing has been run."""
        return bool(self.levels) and self.levels[-1].resolution == self.case.resolutions[-1]

    @property
    def failed(self) -> bool:
        """Whether a run could not be finished."""
        return any(level.failure for level in self.levels)

    def values(self, quantity: Quantity) -> list[float]:
        """The measured values, NaN where there is none."""
        return [level.outcome.values.get(quantity.name, math.nan) for level in self.levels]

    def order(self, quantity: Quantity) -> float:
        """Measured order of convergence of the error."""
        spacings = [self.case.length / level.resolution for level in self.levels]
        return order_of_convergence(spacings, [quantity.error(value) for value in self.values(quantity)])

    def verdict(self, quantity: Quantity) -> str:
        """pass, MISSED, CANNOT RUN, or a dash for what has no gate; in brackets before the reference spacing is run."""
        if self.levels[-1].failure:
            return "CANNOT RUN"
        passed = quantity.passes(self.values(quantity))
        if passed is None:
            return "-"
        word = "pass" if passed else "MISSED"
        return word if self.complete else f"({word})"


def unexpected(results: list[CaseResult], known: frozenset[tuple[str, str]]) -> tuple[list[str], list[str]]:
    """The gates that are missed though they are no `known` misses, and the known misses that are met, each as case and quantity.

    Only the reference spacing counts.
    """
    found: dict[str, list[str]] = {"MISSED": [], "pass": []}
    for result in results:
        for quantity in result.case.quantities:
            verdict, is_known = result.verdict(quantity), (result.case.name, quantity.name) in known
            if verdict == ("pass" if is_known else "MISSED"):
                found[verdict].append(f"{result.case.name}, {quantity.name}")
    return found["MISSED"], found["pass"]


def hardware() -> str:
    """Processor, cores in use, and the versions that matter for speed."""
    model = platform.processor() or platform.machine()
    information = Path("/proc/cpuinfo")
    if information.exists():
        names = [line.split(":", 1)[1].strip() for line in information.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    return (
        f"{model}, {os.cpu_count()} cores; Python {platform.python_version()}, numba {version('numba')}, "
        f"numpy {version('numpy')}"
    )


def revision() -> str:
    """The revision of the checkout, or "unknown"."""
    try:
        command = ["git", "describe", "--always", "--dirty"]
        return subprocess.run(
            command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def number(value: float) -> str:
    """Five significant figures, or a dash."""
    return f"{value:.5g}" if math.isfinite(value) else "-"


def gate_text(quantity: Quantity) -> str:
    """The gate in words."""
    parts = []
    if quantity.gate is not None:
        parts.append(f"{quantity.gate:g}" if quantity.scale is not None else f"{100 * quantity.gate:g} %")
    if quantity.change is not None:
        parts.append(f"within {100 * quantity.change:g} % of the finest")
    return ", ".join(parts) or "-"


def error_text(quantity: Quantity, value: float) -> str:
    """The error, in percent where it is relative to the reference."""
    error = quantity.error(value)
    if not math.isfinite(error):
        return "-"
    return f"{error:.3g}" if quantity.scale is not None else f"{100 * error:.3g} %"


HEADER = (
    "| # | case | quantity | reference | coarse | middle | finest | error | order | gate | verdict | wall time [s] | particle-steps / s |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n"
)


def rows(result: CaseResult) -> list[str]:
    """A case's rows of the table."""
    case, lines = result.case, []
    for index, quantity in enumerate(case.quantities):
        values = result.values(quantity)
        cells = [number(value) for value in values] + [""] * (3 - len(values))
        wall = f"{sum(level.wall_seconds for level in result.levels):.0f}" if index == 0 else ""
        rate = f"{result.levels[-1].rate:.3g}" if index == 0 else ""
        link = f"[{case.name}]({case.name}.png)" if case.panels else case.name
        name = link if index == 0 else ""
        unit = "" if quantity.unit == "1" else f" [{quantity.unit}]"
        lines.append(
            f"| {case.number if index == 0 else ''} | {name} | {quantity.name}{unit} | {number(quantity.reference)} | "
            + " | ".join(cells)
            + f" | {error_text(quantity, values[-1])} | {number(result.order(quantity))} | {gate_text(quantity)} | "
            + f"{result.verdict(quantity)} | {wall} | {rate} |"
        )
    return lines


def markdown(results: list[CaseResult], threads: int | None) -> str:
    """The whole report."""
    gates = [result.verdict(quantity) for result in results for quantity in result.case.quantities]
    wall = sum(level.wall_seconds for result in results for level in result.levels)
    text = "# Validation\n\n"
    text += f"{hardware()}; {threads or 'all'} threads; revision {revision()}; {wall / 60:.1f} minutes.\n\n"
    text += f"{gates.count('pass')} gates passed, {gates.count('MISSED')} missed, {gates.count('CANNOT RUN')} could not run.\n"
    text += (
        "Errors, orders and gates are those of the finest run; in brackets where the reference spacing was not run.\n\n"
    )
    text += HEADER + "\n".join(line for result in results for line in rows(result)) + "\n"
    for result in results:
        text += _section(result)
    return text


def _section(result: CaseResult) -> str:
    """Set-up, source, spacings, costs, notes and picture of a case."""
    case = result.case
    text = f"\n## {case.number}. {case.title}\n\n{case.setup[0].upper()}{case.setup[1:]}. Reference: {case.source}.\n"
    for level in result.levels:
        text += f"- d = {case.length_symbol}/{level.resolution} = {case.length / level.resolution:.4g} m: "
        text += (
            f"failed: {level.failure}\n"
            if level.failure
            else f"{level.wall_seconds:.1f} s, {level.rate:.3g} particle-steps/s\n"
        )
    note = f"\nNote: {case.note}\n" if case.note else ""
    picture = f"\n![{case.title}]({case.name}.png)\n" if case.panels else ""
    return text + note + picture


def document(results: list[CaseResult], threads: int | None) -> dict[str, Any]:
    """The report as plain data, for a program."""
    return {
        "hardware": hardware(),
        "threads": threads,
        "revision": revision(),
        "cases": [_case_document(result) for result in results],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _case_document(result: CaseResult) -> dict[str, Any]:
    levels = [
        {
            "resolution": level.resolution,
            "particle_spacing": result.case.length / level.resolution,
            "wall_s": level.wall_seconds,
            "particle_steps": level.particle_steps,
            "particle_steps_per_s": level.rate,
            "failure": level.failure,
            "curves": [
                {
                    "panel": each.panel,
                    "label": each.label,
                    "reference": each.reference,
                    "x": each.x.tolist(),
                    "y": each.y.tolist(),
                }
                for each in level.outcome.traces
            ],
        }
        for level in result.levels
    ]
    quantities = [
        {
            "name": quantity.name,
            "unit": quantity.unit,
            "reference": quantity.reference,
            "values": [_finite(value) for value in result.values(quantity)],
            "errors": [_finite(quantity.error(value)) for value in result.values(quantity)],
            "order": _finite(result.order(quantity)),
            "gate": quantity.gate,
            "change_gate": quantity.change,
            "verdict": result.verdict(quantity),
        }
        for quantity in result.case.quantities
    ]
    return {"number": result.case.number, "name": result.case.name, "levels": levels, "quantities": quantities}


def _draw_trace(axes: Axes, each: Trace, color: str, style: str, label: str, width: float) -> None:
    marker = "o" if each.markers else ""
    axes.plot(each.x, each.y, color=color, linestyle="" if marker and each.reference else style, linewidth=width,
              marker=marker, markersize=4, label=label)  # fmt: skip


def draw_panel(axes: Axes, panel: Panel, result: CaseResult) -> None:
    """Every level's curves in blues, dark is fine; theory and experiment in black and orange."""
    chosen = [[each for each in level.outcome.traces if each.panel == panel.name] for level in result.levels]
    kinds = list(dict.fromkeys(each.label for level in chosen for each in level if not each.reference))
    used: set[str] = set()
    first = 3 - len(chosen) if result.complete else 0
    for index, (level, traces) in enumerate(zip(result.levels, chosen, strict=True)):
        spacing = f"d = {result.case.length_symbol}/{level.resolution}"
        for each in (each for each in traces if not each.reference):
            label = f"{each.label}, {spacing}" if each.label else spacing
            label = "_nolegend_" if label in used else label
            used.add(label)
            style = STYLES[kinds.index(each.label) % len(STYLES)]
            _draw_trace(axes, each, COLORS[first + index], style, label, 1.4)
    named: set[str] = set()
    markers = ("#d94801", "#238b45", "#6a51a3")
    for each in (each for each in (chosen[-1] if chosen else []) if each.reference):
        color = markers[len(named) % 3] if each.markers else "black"
        _draw_trace(axes, each, color, "--", "_nolegend_" if each.label in named else each.label, 1.2)
        named.add(each.label)
    if panel.band:
        begin, end, name = panel.band
        axes.axvspan(begin, end, color="#dfe8d8", label=name, zorder=0)
    axes.set(xlabel=panel.x_label, ylabel=panel.y_label)
    if panel.log_x:
        axes.set_xscale("log")
    if panel.log_y:
        axes.set_yscale("log")
    if panel.y_range:
        axes.set_ylim(panel.y_range)
    axes.grid(color="0.9")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=7, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncol=3)


def draw(result: CaseResult, path: Path) -> None:
    """Write a case's picture."""
    panels = result.case.panels
    columns = 2 if len(panels) == 4 else len(panels)
    rows = len(panels) // columns
    figure, axes = plt.subplots(rows, columns, figsize=(6.4 * columns, 5.0 * rows), squeeze=False, layout="constrained")
    for panel, each in zip(panels, axes.ravel(), strict=True):
        draw_panel(each, panel, result)
    figure.suptitle(f"{result.case.number}. {result.case.title}", fontsize=12)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def write(results: list[CaseResult], folder: Path, threads: int | None) -> None:
    """Write validation.md, validation.json and the pictures into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for result in results:
        if result.case.panels:
            draw(result, folder / f"{result.case.name}.png")
    (folder / "validation.md").write_text(markdown(results, threads), encoding="utf-8")
    (folder / "validation.json").write_text(json.dumps(document(results, threads), indent=1), encoding="utf-8")

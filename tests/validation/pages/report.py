"""The page of the validation and its figures, from the records in `docs/validation/`: every number comes from a run that is on record."""

from __future__ import annotations

import math
import sys
import textwrap
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.figure import FigureBase

from coupling.testkit.body_checks import order_of_convergence
from tests.validation.case import Case, Panel, Quantity, Trace, trace
from tests.validation.cases import CASES, select
from tests.validation.jobs import ROOT, Record, record_file, records

COLORS = ("#9ecae1", "#4292c6", "#08306b")  # coarse, middle, reference
STYLES = ("-", "--", "-.", ":")
TITLE = 0.3  # [inches] height of a map's title
PAGE = ROOT / "docs" / "validation.md"
PICTURES = ROOT / "docs" / "pictures" / "validation"
INTRODUCTION = """# Validation

**What came of every case when it was last run?** `make validate` runs the cases whose code has changed and writes this page from their
records, `docs/validation/*.json`. A gate is judged at the finest spacing; in brackets where that was not run.
"""


@dataclass(frozen=True)
class CaseResult:
    """A case and its records at the default step, coarse to fine, and at half the step."""

    case: Case
    levels: list[Record] = field(default_factory=list)
    halves: list[Record] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether the reference spacing has been run."""
        return bool(self.levels) and self.levels[-1]["resolution"] == self.case.resolutions[-1]

    @property
    def failed(self) -> bool:
        """Whether a run could not be finished."""
        return any(level["failure"] for level in (*self.levels, *self.halves))

    def values(self, quantity: Quantity) -> list[float]:
        """The measured values, NaN where there is none."""
        return [value_of(level, quantity) for level in self.levels]

    def order(self, quantity: Quantity) -> float:
        """Measured order of convergence of the error."""
        spacings = [self.case.length / level["resolution"] for level in self.levels]
        return order_of_convergence(spacings, [quantity.error(value) for value in self.values(quantity)])

    def verdict(self, quantity: Quantity) -> str:
        """pass, MISSED, CANNOT RUN, or a dash for what has no gate; in brackets before the reference spacing is run."""
        if self.levels[-1]["failure"]:
            return "CANNOT RUN"
        passed = quantity.passes(self.values(quantity))
        if passed is None:
            return "-"
        word = "pass" if passed else "MISSED"
        return word if self.complete else f"({word})"

    def at_half_step(self, quantity: Quantity) -> str:
        """The value at half the step, in bold where it differs from that at the same spacing by more than half the gate."""
        for half in self.halves:
            whole = next((level for level in self.levels if level["resolution"] == half["resolution"]), None)
            if whole is not None:
                value = value_of(half, quantity)
                hangs = change_over_gate(quantity, value_of(whole, quantity), value) > 0.5
                return f"**{number(value)}**" if hangs else number(value)
        return ""


def result_of(case: Case) -> CaseResult:
    """Read what is on record of a case."""
    found = records(case)
    return CaseResult(case, [one for one in found if one["step"] == 1.0], [one for one in found if one["step"] != 1.0])


def value_of(record: Record, quantity: Quantity) -> float:
    """Return what a run measured, NaN where it could not."""
    value = record["values"].get(quantity.name)
    return math.nan if value is None else float(value)


def change_over_gate(quantity: Quantity, whole: float, half: float) -> float:
    """Change of a value from the default to half the step, over its gate; NaN without a gate, infinite where a gate of 0 allows none."""
    if quantity.gate is None:
        return math.nan
    scale = abs(quantity.reference) if quantity.scale is None else quantity.scale
    allowed, change = scale * quantity.gate, abs(whole - half)
    return change / allowed if allowed > 0.0 else math.inf if change > 0.0 else 0.0


def unexpected(results: Iterable[CaseResult], known: frozenset[tuple[str, str]]) -> tuple[list[str], list[str]]:
    """The gates that are missed though they are no `known` misses, and the known misses that are met, each as case and quantity.

    Only the reference spacing counts.
    """
    found: dict[str, list[str]] = {"MISSED": [], "pass": []}
    for result in results:
        for quantity in result.case.quantities if result.levels else ():
            verdict, is_known = result.verdict(quantity), (result.case.name, quantity.name) in known
            if verdict == ("pass" if is_known else "MISSED"):
                found[verdict].append(f"{result.case.name}, {quantity.name}")
    return found["MISSED"], found["pass"]


def number(value: float) -> str:
    """Four significant figures, or a dash."""
    return f"{value:.4g}" if math.isfinite(value) else "-"


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


def page(results: Iterable[CaseResult]) -> str:
    """Write the whole page of Markdown."""
    results = [result for result in results if result.levels]
    gates = [
        (result, quantity, verdict)
        for result in results
        for quantity in result.case.quantities
        if (verdict := result.verdict(quantity)) != "-"
    ]
    met, missed = ([gate for gate in gates if gate[2].strip("()") == word] for word in ("pass", "MISSED"))
    text = (
        INTRODUCTION + f"\n{len(results)} of {len(CASES)} cases are on record. Of {len(gates)} gates {len(met)} are met"
    )
    text += f", {len(missed)} missed:\n\n" if missed else ".\n"
    text += "".join(
        f"- [{result.case.name}](#{anchor(result.case)}): {quantity.name}, {error_text(quantity, result.values(quantity)[-1])}"
        f"{'' if result.complete else ', at ' + str(result.case.resolutions[len(result.levels) - 1]) + ' spacings'}\n"
        for result, quantity, _ in missed
    )
    never = [case.name for case in CASES if case.name not in {result.case.name for result in results}]
    text += f"\nWithout a record: {', '.join(never)}.\n" if never else ""
    return text + "".join(section(result) for result in results)


def section(result: CaseResult) -> str:
    """Write what a case is, the table of its quantities, its costs, note and figure."""
    case, step = result.case, bool(result.halves)
    heads = [f"{case.length_symbol}/{level['resolution']}" for level in result.levels]
    columns = [
        "quantity",
        "reference",
        *heads,
        "error",
        "order",
        "gate",
        "verdict",
        *(["half the step"] if step else []),
    ]
    text = f"\n## {case.number}. {case.title}\n\n{case.setup[0].upper()}{case.setup[1:].rstrip('.')}. Reference: {case.source}.\n\n"
    text += f"| {' | '.join(columns)} |\n{'|---' * len(columns)}|\n"
    for quantity in case.quantities:
        values, unit = result.values(quantity), "" if quantity.unit == "1" else f" [{quantity.unit}]"
        cells = [
            quantity.name + unit, number(quantity.reference), *map(number, values), error_text(quantity, values[-1]),
            number(result.order(quantity)), gate_text(quantity), result.verdict(quantity),
            *([result.at_half_step(quantity)] if step else []),
        ]  # fmt: skip
        text += f"| {' | '.join(cells)} |\n"
    text += f"\n`{case.name}`: " + "; ".join(map(_cost, (*result.levels, *result.halves))) + ".\n"
    text += f"\n{case.note[0].upper()}{case.note[1:].rstrip('.')}.\n" if case.note else ""
    return text + f"\n![{case.title}](pictures/validation/{case.name}.png)\n"


def anchor(case: Case) -> str:
    """The anchor that the site gives a case's heading."""
    kept = "".join(sign for sign in f"{case.number}. {case.title}".lower() if sign.isalnum() or sign in " -_")
    return "-".join(kept.split())


def _cost(level: Record) -> str:
    """What a run cost, of which code."""
    name = f"{level['resolution']}" + ("" if level["step"] == 1.0 else f", {level['step']:g} of the step")
    what = level["failure"] or f"{level['particles']} particles, {level['cpu_s']:.3g} s of processor time"
    return f"{name}: {what}, {level['revision']}, {level['date']}"


def traces_of(record: Record, panel: str) -> list[Trace]:
    """Return a record's curves of one panel."""
    chosen = [one for one in record["curves"] if one["panel"] == panel]
    values = [[[math.nan if each is None else each for each in one[axis]] for axis in ("x", "y")] for one in chosen]
    return [
        trace(panel, x, y, one["label"], one["reference"], one["markers"])
        for one, (x, y) in zip(chosen, values, strict=True)
    ]


def _draw_trace(axes: Axes, each: Trace, color: str, style: str, label: str, width: float) -> None:
    marker = "o" if each.markers else ""
    axes.plot(each.x, each.y, color=color, linestyle="" if marker and each.reference else style, linewidth=width,
              marker=marker, markersize=4, label=label)  # fmt: skip


def draw_panel(axes: Axes, panel: Panel, result: CaseResult) -> None:
    """Draw every level in blues, dark is fine, a single level in colours; theory in black, experiments and several theories in colours."""
    chosen = [traces_of(level, panel.name) for level in result.levels]
    kinds = list(dict.fromkeys(each.label for level in chosen for each in level if not each.reference))
    used: set[str] = set()
    first = 3 - len(chosen) if result.complete else 0
    for index, (level, traces) in enumerate(zip(result.levels, chosen, strict=True)):
        spacing = f"d = {result.case.length_symbol}/{level['resolution']}"
        for each in (each for each in traces if not each.reference):
            label = f"{each.label}, {spacing}" if each.label else spacing
            label = "_nolegend_" if label in used else label
            used.add(label)
            kind = kinds.index(each.label)
            color = COLORS[first + index] if len(chosen) > 1 else f"C{kind}"
            _draw_trace(axes, each, color, STYLES[kind % len(STYLES)], label, 1.4)
    named: set[str] = set()
    markers = ("#d94801", "#238b45", "#6a51a3", "black")
    references = [each for each in (chosen[-1] if chosen else []) if each.reference]
    lone = len({each.label for each in references if not each.markers}) == 1
    for each in references:
        color = "black" if lone and not each.markers else markers[len(named) % 4]
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


def draw_errors(axes: Axes, result: CaseResult) -> None:
    """Draw the errors of all quantities over the spacing."""
    spacings = [result.case.length / level["resolution"] for level in result.levels]
    for quantity in result.case.quantities:
        axes.loglog(spacings, [quantity.error(value) for value in result.values(quantity)], "o-", label=quantity.name)
    axes.set(xlabel="spacing [m]", ylabel="error")
    axes.grid(color="0.9")
    axes.legend(fontsize=6, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncol=2)


def orders(result: CaseResult) -> str:
    """Name the observed orders of the quantities with gates, six at most."""
    found = [(one.name, result.order(one)) for one in result.case.quantities if one.gate is not None]
    named = [f"{name}: {order:.1f}" for name, order in found if math.isfinite(order)]
    return "observed order: " + "; ".join(named[:6]) if named else ""


def draw_maps(figure: FigureBase, maps: list[list[Record]], label: str) -> None:
    """Draw rows of maps on one scale of colours, which ends where a hundredth of what holds anything is thicker."""
    grid = figure.subplots(len(maps), len(maps[0]), squeeze=False)
    values = np.concatenate([np.ravel(one["values"]) for row in maps for one in row])
    top = float(np.quantile(values[values > 0.0], 0.99)) if values.any() else 1.0
    for axes, one in zip(grid.ravel(), (one for row in maps for one in row), strict=True):
        axes.fill(*np.reshape(one["outline"], (-1, 2)).T, color="0.75", zorder=-1)
        shown = np.ma.masked_less(one["values"], 0.01 * top)
        image = axes.imshow(shown, origin="lower", extent=one["extent"], cmap="YlOrBr", norm=PowerNorm(0.5, 0.0, top))
        axes.set_title(one["title"], fontsize=7)
        axes.set(xticks=[], yticks=[])
    figure.colorbar(image, ax=grid, label=label, extend="max", shrink=0.8, pad=0.01)


def draw(result: CaseResult, path: Path) -> None:
    """Write a case's picture: the maps of its finest run, its curves, or its errors where it has none, with the observed orders."""
    panels = result.case.panels
    columns = 2 if len(panels) == 4 else max(1, len(panels))
    rows = max(1, len(panels) // columns)
    maps = next((level["maps"] for level in reversed(result.levels) if "maps" in level), [])
    width, height, above = 6.4 * columns, 5.0 * rows, 0.0
    if maps:
        width = max(width, 2.4 * len(maps[0]))
        x0, x1, y0, y1 = maps[0][0]["extent"]
        above = len(maps) * (0.9 * width / len(maps[0]) * (y1 - y0) / (x1 - x0) + TITLE)
    figure = plt.figure(figsize=(width, above + height), layout="constrained")
    parts = figure.subfigures(2, 1, height_ratios=(above, height)) if maps else [figure]
    if maps:
        draw_maps(parts[0], maps, result.case.map_label)
    axes = parts[-1].subplots(rows, columns, squeeze=False)
    for panel, each in zip(panels, axes.ravel(), strict=False):
        draw_panel(each, panel, result)
    if not panels:
        draw_errors(axes[0, 0], result)
    title = textwrap.fill(orders(result), 60 * columns)
    figure.suptitle(f"{result.case.number}. {result.case.title}\n{title}", fontsize=10)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def draw_all(cases: Iterable[Case] = CASES) -> None:
    """Draw the figure of each case whose records are newer than it."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for result in map(result_of, cases):
        picture = PICTURES / f"{result.case.name}.png"
        if result.levels and not is_newer(picture, record_file(result.case)):
            draw(result, picture)


def is_newer(one: Path, other: Path) -> bool:
    """Tell whether a file is there and was written after another."""
    return one.exists() and one.stat().st_mtime > other.stat().st_mtime


if __name__ == "__main__":
    draw_all(select(",".join(sys.argv[1:])))

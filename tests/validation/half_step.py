"""Run validation cases again at half their time step: which results hang on the step?

    python -m tests.validation.half_step [CASE[,CASE...]] [--level 1-3] [--threads N] [--output FILE]

Half the step is half the longest time step and half the CFL number. A quantity hangs on the step if it changes by more than half its
gate. Cases that build their fluid from a scenario keep their step; their steps ratio tells.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from rich.console import Console

from tests.validation.__main__ import run_level, warm_up
from tests.validation.case import Bench, Case, Quantity
from tests.validation.cases import CASES, select
from tests.validation.report import Level, number

HEADER = (
    "| # | case | quantity | default step | half the step | change / gate | hangs on the step | work at half the step |\n"
    "|---|---|---|---|---|---|---|---|\n"
)


def change_over_gate(quantity: Quantity, whole: float, half: float) -> float:
    """Change of a value from the default to half the step, over its gate; NaN without a gate, infinite where a gate of 0 allows none."""
    if quantity.gate is None:
        return math.nan
    scale = abs(quantity.reference) if quantity.scale is None else quantity.scale
    allowed, change = scale * quantity.gate, abs(whole - half)
    return change / allowed if allowed > 0.0 else math.inf if change > 0.0 else 0.0


def rows(case: Case, whole: Level, half: Level) -> str:
    """Write the rows of a case, one a quantity."""
    text, work = "", half.particle_steps / whole.particle_steps if whole.particle_steps else math.nan
    for quantity in case.quantities:
        first, second = (level.outcome.values.get(quantity.name, math.nan) for level in (whole, half))
        change = change_over_gate(quantity, first, second)
        verdict = "-" if math.isnan(change) else "YES" if change > 0.5 else "no"
        text += (
            f"| {case.number} | {case.name} | {quantity.name} | {number(first)} | {number(second)} | {number(change)} | {verdict} "
            f"| {number(work)} |\n"
        )
    return text


def main(arguments: list[str] | None = None) -> int:
    """Run the cases twice and print the table; returns 1 if a run fails, 2 for an unknown case."""
    parser = argparse.ArgumentParser(
        prog="half_step", description="Compare validation cases with themselves at half the step."
    )
    parser.add_argument(
        "cases", nargs="?", default="", help=f"comma-separated: {', '.join(case.name for case in CASES)}"
    )
    parser.add_argument("--level", type=int, choices=(1, 2, 3), default=1, help="which spacing: 1 coarse to 3 fine")
    parser.add_argument("--threads", type=int, default=None, help="threads of a fluid; default all cores")
    parser.add_argument("--output", type=Path, default=Path("validation-report/half-step.md"), help="file of the table")
    options = parser.parse_args(arguments)
    try:
        cases = select(options.cases)
    except ValueError as problem:
        print(problem, file=sys.stderr)
        return 2
    warm_up(options.threads)
    console, table, failed = Console(), HEADER, False
    options.output.parent.mkdir(parents=True, exist_ok=True)
    for case in cases:
        resolution = case.resolutions[options.level - 1]
        whole, half = (
            run_level(case, resolution, Bench(threads=options.threads, step_share=share)) for share in (1.0, 0.5)
        )
        failed = failed or bool(whole.failure or half.failure)
        lines = rows(case, whole, half)
        console.print(lines + (whole.failure or half.failure), highlight=False, markup=False, soft_wrap=True)
        table += lines
        options.output.write_text(table, encoding="utf-8")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

"""Pages whose numbers come from the records: each part `<!-- made: WHAT -->...<!-- / -->` of a page is written anew.

WHAT is `CASE: QUANTITY` for what each spacing measured, the same with `: error`, `: gate` or `: half the step` behind it, a name of `PARTS`
below, or one of `ANSWERS` of `practice.py`.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.benchmarks import history
from tests.validation.case import Quantity
from tests.validation.cases import CASES, select
from tests.validation.jobs import ROOT
from tests.validation.pages import report
from tests.validation.pages.practice import ANSWERS
from tests.validation.pages.report import (
    CaseResult,
    change_over_gate,
    error_text,
    gate_text,
    number,
    result_of,
    value_of,
)

PAGES = [ROOT / "README.md", *sorted(one for one in (ROOT / "docs").rglob("*.md") if one != report.PAGE)]
PART = re.compile(r"(<!-- made: (.+?) -->).*?(<!-- / -->)", re.DOTALL)
NOT_RUN = "not run"
STEPS = 10**7  # particles times steps of a run from which on its cost is that of its steps


def filled(text: str) -> str:
    """Write the made parts of a page anew."""
    return PART.sub(lambda part: f"{part[1]}{made(part[2])}{part[3]}", text)


def made(what: str) -> str:
    """Write one part; ValueError for a case, quantity or name that does not exist."""
    if what in PARTS or what in ANSWERS:
        return (PARTS.get(what) or ANSWERS[what])()
    case, name, *form = what.split(": ")
    result = result_of(select(case)[0])
    quantity = next((one for one in result.case.quantities if one.name == name), None)
    if quantity is None or form not in ([], ["error"], ["gate"], ["half the step"]):
        raise ValueError(
            f"{what!r} is no part of a page, allowed: CASE: QUANTITY, with error, gate or half the step behind it"
        )
    return told(result, quantity, *form)


def told(result: CaseResult, quantity: Quantity, form: str = "") -> str:
    """Write what a case's spacings measured of a quantity, with the spacings, or its gate."""
    if form == "gate":
        return gate_text(quantity)
    if form == "half the step":
        return result.at_half_step(quantity).strip("*") or NOT_RUN
    if not result.levels:
        return NOT_RUN
    values = result.values(quantity)
    relative = form == "error" and quantity.scale is None
    texts = [
        "none" if math.isnan(one) else error_text(quantity, one).removesuffix(" %") if form == "error" else f"{one:.3g}"
        for one in values
    ]
    unit = " %" if relative else "" if quantity.unit == "1" or texts[-1] == "none" else f" {quantity.unit}"
    return f"{', '.join(texts)}{unit} at {result.case.length_symbol}/{', '.join(str(one['resolution']) for one in result.levels)}"


@functools.cache
def _on_record() -> list[CaseResult]:
    return [result for result in map(result_of, CASES) if result.levels]


def _gates() -> list[tuple[CaseResult, Quantity, str]]:
    return [
        (result, one, result.verdict(one))
        for result in _on_record()
        for one in result.case.quantities
        if result.verdict(one) != "-"
    ]


def gates() -> str:
    """Say how many gates are met, of how many cases."""
    words = [verdict.strip("()") for _, _, verdict in _gates()]
    early = sum(not result.complete for result in _on_record())
    text = f"{len(_on_record())} of {len(CASES)} cases are on record; of their {len(words)} gates {words.count('pass')} are met"
    return text + (f" (judged before the finest spacing in {early} of the cases)" if early else "")


def share_of_gate(result: CaseResult, quantity: Quantity) -> float:
    """Error of the finest run over the gate; infinite where there is no value, or an error where none is allowed."""
    if quantity.gate is None:
        return 0.0
    error = quantity.error(result.values(quantity)[-1])
    return (
        math.inf if not math.isfinite(error) else error / quantity.gate if quantity.gate else math.inf if error else 0.0
    )


def table(heads: str, rows: list[str]) -> str:
    """Write a table whose rows are ready, between empty lines."""
    columns = heads.count("|") + 1
    return f"\n\n| {heads} |\n{'|---' * columns}|\n" + "".join(f"| {row} |\n" for row in rows) + "\n"


def cases() -> str:
    """Write a table of the cases on record: gates met, and the quantity that is farthest out in its gate."""
    rows = []
    for result in _on_record():
        judged = [(one, verdict.strip("()")) for of, one, verdict in _gates() if of is result]
        met = f"{sum(word == 'pass' for _, word in judged)} of {len(judged)}" if judged else "-"
        farthest = max((one for one, _ in judged), key=lambda one: share_of_gate(result, one), default=None)
        text = ""
        if farthest is not None:
            error = error_text(farthest, result.values(farthest)[-1])
            text = f"{farthest.name}: {error} (gate {gate_text(farthest)}), order {number(result.order(farthest))}"
        where = ", ".join(str(one["resolution"]) for one in result.levels)
        title = f"[{result.case.title}](validation.md#{report.anchor(result.case)})"
        rows.append(f"{title} | {result.case.length_symbol}/{where} | {met} | {text}")
    return table("case | spacings | gates met | farthest out in its gate, finest spacing", rows)


def steps() -> str:
    """Write a table of the quantities that change by more than half their gate in half the step."""
    rows, asked = [], 0
    for result in _on_record():
        for half in result.halves:
            whole = next((one for one in result.levels if one["resolution"] == half["resolution"]), None)
            for quantity in result.case.quantities if whole else ():
                values = [value_of(one, quantity) for one in (whole, half)]
                asked += quantity.gate is not None
                if change_over_gate(quantity, *values) > 0.5:
                    where = f"`{result.case.name}`, {result.case.length_symbol}/{half['resolution']}"
                    rows.append(
                        f"{where} | {quantity.name} | {number(values[0])} | {number(values[1])} | {gate_text(quantity)}"
                    )
    told = table("case | quantity | default step | half the step | gate", rows) if rows else "\n\n"
    return f"{len(rows)} of {asked} gated quantities hang on the step:{told}"


def cost() -> str:
    """Say what a particle and step cost on one thread."""
    found = [
        1e6 * one["cpu_s"] / one["particle_steps"]
        for result in _on_record()
        for one in result.levels
        if one["particle_steps"] >= STEPS and one["threads"] == 1
    ]
    if not found:
        return NOT_RUN
    low, middle, high = np.quantile(found, (0.1, 0.5, 0.9))
    return f"{middle:.2g} µs of processor time (a tenth of {len(found)} runs below {low:.2g}, a tenth above {high:.2g})"


def missed() -> str:
    """Write the gates that are missed, as a list."""
    return (
        "; ".join(
            f"[{result.case.name}](validation.md#{report.anchor(result.case)}), {quantity.name}"
            for result, quantity, verdict in _gates()
            if verdict.strip("()") == "MISSED"
        )
        or "none"
    )


def speed() -> str:
    """Write a table of the latest benchmarks, beside the first value on record of each."""
    rows = list(history.rows())
    return table("benchmark | figure | now | first on record | commit", rows) if rows else NOT_RUN


PARTS: dict[str, Callable[[], str]] = {
    "gates": gates,
    "missed gates": missed,
    "cases": cases,
    "steps": steps,
    "cost": cost,
    "speed": speed,
}


def contents() -> dict[Path, str]:
    """Return what each page should say."""
    _on_record.cache_clear()
    pages = {page: filled(page.read_text(encoding="utf-8")) for page in PAGES}
    return {report.PAGE: report.page(map(result_of, CASES)), **pages}


def write() -> None:
    """Write the pages that differ from what is on record."""
    for page, text in contents().items():
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")


def on_pre_build(**_: object) -> None:
    """Write the pages and draw the figures before the site is built, as a hook of mkdocs."""
    write()
    report.draw_all()
    history.draw()


if __name__ == "__main__":
    write()

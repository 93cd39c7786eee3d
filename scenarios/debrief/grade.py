"""The grade of a boom exercise: stated criteria, what was measured for each, and the verdict.

The page shows everything that enters the grade. Each criterion has two limits and a weight. It is met (1), partly met (1/2) or missed
(0), and the grade is the weighted mean. A file can set a trainer's own limits and weights (`read_criteria`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from booms.containment import PRACTICE_SPEED
from oilsim.quantity import Quantity, is_number
from scenarios.debrief.boom_history import BoomHistory
from scenarios.problems import Problem, ScenarioError
from scenarios.text.toml import read_toml

Verdict = Literal["met", "partly met", "missed"]
_POINTS: Mapping[Verdict, float] = {"met": 1.0, "partly met": 0.5, "missed": 0.0}
LETTERS = (("A", 0.9), ("B", 0.75), ("C", 0.6), ("D", 0.4), ("E", 0.0))
CAP = "D"  # the best grade if a decisive criterion is missed
_ENTRIES = ("good", "acceptable", "weight")


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """A criterion by which an exercise is judged.

    good, acceptable  limits: met up to the first, partly met up to the second; their order tells whether more or less is better
    what              text for the trainer: the quantity that is measured, and why it matters
    measure           computes the value from an history, in the unit shown; None if it cannot be computed
    decisive          if this criterion is missed, the grade is capped
    """

    key: str
    title: str
    unit: str
    good: float
    acceptable: float
    weight: float
    what: str
    measure: Callable[[BoomHistory], float | None]
    decisive: bool = False

    @property
    def more_is_better(self) -> bool:
        """True if a larger value is better."""
        return self.good > self.acceptable

    def verdict(self, value: float) -> Verdict:
        """Judge a measured value by the limits."""
        sign = 1.0 if self.more_is_better else -1.0
        if sign * value >= sign * self.good:
            return "met"
        return "partly met" if sign * value >= sign * self.acceptable else "missed"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A criterion, its measured value and the verdict; a finding with the verdict None does not count."""

    criterion: Criterion
    value: float | None
    verdict: Verdict | None


@dataclass(frozen=True, kw_only=True)
class Grade:
    """The letter, its share of the points, the reason if the letter was capped, and all findings."""

    letter: str
    share: float
    capped_by: str
    findings: tuple[Finding, ...]


def _held(history: BoomHistory) -> float | None:
    taken_in = history.oil["retained"][-1] + history.oil["lost"][-1]
    return 100.0 * float(history.oil["retained"][-1] / taken_in) if taken_in > 0.0 else None


def _met(history: BoomHistory) -> float | None:
    taken_in = history.oil["retained"][-1] + history.oil["lost"][-1]
    there = taken_in + history.oil["free"][-1]
    return 100.0 * float(taken_in / there) if there > 0.0 else None


def _time_too_fast(history: BoomHistory) -> float:
    return 100.0 * float((history.held_speed.max(axis=1) > PRACTICE_SPEED).mean())


def _gap(history: BoomHistory) -> float:
    return 100.0 * abs(float(history.gap_ratio[history.under_way].mean()) - 1.0 / 3.0)


def _lean(history: BoomHistory) -> float:
    return float(np.degrees(np.percentile(history.skirt_angle.max(axis=1), 95.0)))


def _draft(history: BoomHistory) -> float:
    smallest = np.percentile(history.effective_draft.min(axis=1), 5.0)
    return 100.0 * float(smallest) / history.boom.skirt_depth


def _snatch(history: BoomHistory) -> float | None:
    means = {end: float(tension[history.under_way].mean()) for end, tension in history.tow_tension.items()}
    if not means or not all(means.values()):
        return None
    return max(float(history.tow_peak[end][history.under_way].max()) / mean for end, mean in means.items())


def _sharing(history: BoomHistory) -> float | None:
    means = [float(tension[history.under_way].mean()) for tension in history.tow_tension.values()]
    return 100.0 * (max(means) - min(means)) / max(means) if len(means) == 2 and max(means) > 0.0 else None


CRITERIA = (
    Criterion(
        key="held", title="Oil held", unit="%", good=95.0, acceptable=80.0, weight=3.0, measure=_held, decisive=True,
        what="Share of the oil held at the end, of all oil that was ever in the boom. Holding oil is the boom's "
        "purpose. Lost oil counts until it is taken back.",
    ),
    Criterion(
        key="encountered", title="Oil met", unit="%", good=90.0, acceptable=60.0, weight=2.0, measure=_met,
        what="Share of the oil that got into the boom, of all oil in the water. A sweep must meet the slick: "
        "check position, heading and opening of the U.",
    ),
    Criterion(
        key="speed", title="Time over 0.7 kn", unit="%", good=0.0, acceptable=10.0, weight=2.0, measure=_time_too_fast,
        what="Share of the time in which water kept running against some part of the boom at more than 0.7 knots "
        "normal to it. Above this speed booms "
        "lose oil. The speed is averaged over the time in which the water passes the skirt's depth, because "
        "a shorter swing draws no oil under.",
    ),
    Criterion(
        key="gap", title="Gap ratio, distance from 1:3", unit="%", good=8.0, acceptable=15.0, weight=1.0, measure=_gap,
        what="Distance of the mean gap ratio under way from one third. A wider gap raises speed and tension in "
        "the apex; a narrower gap sweeps less.",
    ),
    Criterion(
        key="lean", title="Lean of the skirt", unit="deg", good=20.0, acceptable=35.0, weight=1.0, measure=_lean,
        what="Lean of the most leaning segment, not exceeded for 95 % of the time. A leaning skirt has less "
        "draft, and the water slips under it.",
    ),
    Criterion(
        key="draft", title="Draft of the skirt", unit="%", good=80.0, acceptable=60.0, weight=1.0, measure=_draft,
        what="Draft of the shallowest segment, as a share of the skirt's depth, kept for 95 % of the time. Lean, "
        "heave and lift all reduce it.",
    ),
    Criterion(
        key="snatch", title="Snatch loads", unit="times", good=2.0, acceptable=3.0, weight=1.0, measure=_snatch,
        what="Peak of the tow tension over its mean, under way. Jerks break lines and shake oil out of the boom. "
        "Change speed slowly.",
    ),
    Criterion(
        key="sharing", title="Uneven pull", unit="%", good=15.0, acceptable=30.0, weight=1.0, measure=_sharing,
        what="Difference of the mean tension at the two ends, under way. Vessels that are abreast and on station "
        "pull equally.",
    ),
)  # fmt: skip


def grade(history: BoomHistory, criteria: tuple[Criterion, ...] = CRITERIA) -> Grade:
    """Judge one boom's exercise; criteria that cannot be measured do not count."""
    findings = []
    for criterion in criteria:
        value = criterion.measure(history)
        verdict = None if value is None else criterion.verdict(value)
        findings.append(Finding(criterion=criterion, value=value, verdict=verdict))
    judged = [(finding.criterion.weight, finding.verdict) for finding in findings if finding.verdict is not None]
    total = sum(weight for weight, _ in judged)
    share = sum(weight * _POINTS[verdict] for weight, verdict in judged) / total if total else 0.0
    letter = next(letter for letter, least in LETTERS if share >= least)
    missed = [f.criterion.title for f in findings if f.criterion.decisive and f.verdict == "missed"]
    capped = bool(missed) and letter < CAP
    return Grade(
        letter=CAP if capped else letter,
        share=share,
        capped_by=missed[0] if capped else "",
        findings=tuple(findings),
    )


def read_criteria(path: Path) -> tuple[Criterion, ...]:
    """Read limits and weights from a TOML file with a table for each criterion: [held] good = 90, acceptable = 70, weight = 2.

    Raises ScenarioError with everything that is wrong in the file.
    """
    try:
        tables = read_toml(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ScenarioError([Problem("file", f"cannot be read: {error.strerror or error}")], str(path)) from error
    except (ValueError, UnicodeDecodeError) as error:
        raise ScenarioError([Problem("file", f"is not valid TOML: {error}")], str(path)) from error
    known = {criterion.key for criterion in CRITERIA}
    problems = [Problem(key, f"is unknown, allowed: {', '.join(sorted(known))}") for key in tables if key not in known]
    changed = []
    for criterion in CRITERIA:
        table = tables.get(criterion.key, {})
        problems += _problems(criterion.key, table)
        if not problems:
            good, acceptable, weight = (float(table.get(entry, getattr(criterion, entry))) for entry in _ENTRIES)
            changed.append(replace(criterion, good=good, acceptable=acceptable, weight=weight))
    if not problems:
        problems += [
            Problem(criterion.key, "has equal limits `good` and `acceptable`, allowed: two different limits")
            for criterion in changed
            if criterion.good == criterion.acceptable
        ]
    if problems:
        raise ScenarioError(problems, str(path))
    return tuple(changed)


def _problems(key: str, table: Any) -> list[Problem]:
    if not isinstance(table, dict):
        return [Problem(key, f"is {table!r}, allowed: a table with {', '.join(_ENTRIES)}")]
    found = []
    for entry, value in table.items():
        if entry not in _ENTRIES:
            found.append(Problem(f"{key}.{entry}", f"is unknown, allowed: {', '.join(_ENTRIES)}"))
            continue
        limits = Quantity(at_least=0.0) if entry == "weight" else Quantity()
        fault = limits.fault(value) if is_number(value) else f"is {value!r}, allowed: a number, {limits.allowed}"
        if fault:
            found.append(Problem(f"{key}.{entry}", fault))
    return found

"""The grade of a boom exercise: stated criteria, what was measured for each, and what follows.

Nothing is hidden in the grade: each criterion has two limits and a weight, is met (1), partly met (1/2) or missed (0), and
the grade is the weighted mean. A trainer's own limits and weights come from a file (`read_criteria`).
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from booms.containment import PRACTICE_SPEED
from scenarios.debrief.boom_history import BoomHistory
from scenarios.problems import Problem, ScenarioError

Verdict = Literal["met", "partly met", "missed"]
_POINTS: Mapping[Verdict, float] = {"met": 1.0, "partly met": 0.5, "missed": 0.0}
LETTERS = (("A", 0.9), ("B", 0.75), ("C", 0.6), ("D", 0.4), ("E", 0.0))
CAP = "D"  # the best grade when a decisive criterion is missed
_ENTRIES = ("good", "acceptable", "weight")


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """A measure that an exercise is judged by.

    good, acceptable  limits: met up to the first, partly met up to the second; whichever way is better follows from them
    what              is measured, and why it matters
    measure           of an history, in the unit shown; None: it cannot be told
    decisive          missed, it caps the grade
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
        """Whether a larger value is the better one."""
        return self.good > self.acceptable

    def verdict(self, value: float) -> Verdict:
        """Judge a measured value."""
        sign = 1.0 if self.more_is_better else -1.0
        if sign * value >= sign * self.good:
            return "met"
        return "partly met" if sign * value >= sign * self.acceptable else "missed"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """A criterion and what was measured; a verdict of None is left out of the grade."""

    criterion: Criterion
    value: float | None
    verdict: Verdict | None


@dataclass(frozen=True, kw_only=True)
class Grade:
    """The letter, the share of the points it stands for, why it was capped if it was, and all findings."""

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
        what="Held at the end, of all oil that was ever in the boom. This is what the boom is for; lost oil counts until it is taken back.",
    ),
    Criterion(
        key="encountered", title="Oil met", unit="%", good=90.0, acceptable=60.0, weight=2.0, measure=_met,
        what="Oil that got into the boom, of all in the water. A sweep must meet the slick: position, heading, opening of the U.",
    ),
    Criterion(
        key="speed", title="Time over 0.7 kn", unit="%", good=0.0, acceptable=10.0, weight=2.0, measure=_time_too_fast,
        what="Time during which water kept running against some part of the boom at more than 0.7 knots along its normal, from where on "
        "oil is lost: the mean over the time in which it passes the skirt's depth, since a shorter wobble draws no oil under.",
    ),
    Criterion(
        key="gap", title="Gap ratio off 1:3", unit="%", good=8.0, acceptable=15.0, weight=1.0, measure=_gap,
        what="Gap over length of boom under way, off a third. Wider raises speed and tension in the apex, narrower sweeps less.",
    ),
    Criterion(
        key="lean", title="Lean of the skirt", unit="deg", good=20.0, acceptable=35.0, weight=1.0, measure=_lean,
        what="Of the most leaning segment, not passed for 95 % of the time. A leaning skirt draws less, and lets the flow slip under.",
    ),
    Criterion(
        key="draft", title="Draft kept", unit="%", good=80.0, acceptable=60.0, weight=1.0, measure=_draft,
        what="Draft of the shallowest segment over the skirt's depth, kept for 95 % of the time: lean, heave and lift together.",
    ),
    Criterion(
        key="snatch", title="Snatch loads", unit="times", good=2.0, acceptable=3.0, weight=1.0, measure=_snatch,
        what="Peak tow tension over its mean, under way. Jerks part lines and shake oil out; speed is changed slowly.",
    ),
    Criterion(
        key="sharing", title="Uneven pull", unit="%", good=15.0, acceptable=30.0, weight=1.0, measure=_sharing,
        what="Difference of the two ends' mean tension, under way. Vessels that are abreast and on station pull alike.",
    ),
)  # fmt: skip


def grade(history: BoomHistory, criteria: tuple[Criterion, ...] = CRITERIA) -> Grade:
    """Judge one boom's exercise; criteria that nothing can be told of are left out."""
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
    """The criteria with limits and weights from a TOML file, a table each: [held] good = 90, acceptable = 70, weight = 2."""
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ScenarioError([Problem("file", f"cannot be read: {error.strerror or error}")], str(path)) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError([Problem("file", f"is no TOML: {error}")], str(path)) from error
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
            Problem(criterion.key, "has good equal to acceptable, allowed: two limits")
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
        elif isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            found.append(Problem(f"{key}.{entry}", f"is {value!r}, allowed: a finite number"))
        elif entry == "weight" and value < 0.0:
            found.append(Problem(f"{key}.weight", f"is {value!r}, allowed: 0 or more"))
    return found

"""The grade of a boom exercise: stated criteria, what was measured for each, and the verdict.

The page shows everything that enters the grade. Each criterion has two limits and a weight. It is met (1), partly met (1/2) or missed
(0), and the grade is the weighted mean. Which criteria count follows from the kind of deployment; the scenario and a trainer's own file
(`read_criteria`) change, add and weigh them. Start-up transients do not count (`BoomHistory.settled`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from booms.containment import PRACTICE_SPEED
from oilsim.backend.arrays import Array
from recordings.replay.recording import Replay
from scenarios.debrief import measures
from scenarios.debrief.boom_history import BoomHistory, boom_histories
from scenarios.schema.criteria import CRITERIA_OF, LIMITS, CriterionSettings, Statistic, criteria_problems, limits_of
from scenarios.schema.parsing.structuring import structure
from scenarios.text.problems import Problem, ScenarioError
from scenarios.text.toml import read_toml_file

Verdict = Literal["met", "partly met", "missed"]
_POINTS: Mapping[Verdict, float] = {"met": 1.0, "partly met": 0.5, "missed": 0.0}
LETTERS = (("A", 0.9), ("B", 0.75), ("C", 0.6), ("D", 0.4), ("E", 0.0))
# [m/s] normal to a boom: design limit (JWPCOE 118(6), 1992), and 1 kn, from which ASTM F1093 expects substantial loss
DESIGN_SPEED, GROSS_SPEED = 0.31, 0.51
IF_THERE = (
    "fed",
    "recovered",
    "skimmer",
    "deployed",
    "connected",
)  # criteria that only an exercise with a funnel, skimmer, berth or waiting tie has
CAP = "D"  # the best grade if a decisive criterion is missed


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """A criterion by which an exercise is judged.

    good, acceptable  limits: met up to the first, partly met up to the second; their order tells whether more or less is better
    what              text for the trainer: the quantity that is measured, and why it matters
    measure           computes the value from a history, in the unit shown; None if it cannot be computed
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
    """The letter, none if no criterion was judged, its share of the points, why the letter is lower than these, and all findings."""

    letter: str
    share: float
    capped_by: str
    findings: tuple[Finding, ...]


_STATISTICS: Mapping[Statistic, Callable[[Array], Any]] = {
    "end": lambda values: values[-1],
    "mean": np.mean,
    "largest": np.max,
    "smallest": np.min,
}


def _of_series(history: BoomHistory, name: str, statistic: Statistic) -> float | None:
    """Measure a recorded series once the boom is settled; None if the recording does not have it."""
    series = history.series.get(name)
    if series is None or not history.settled.any():
        return None
    values = series.value[series.time >= history.time[history.settled.argmax()]]
    return float(_STATISTICS[statistic](values)) if len(values) else None


def _known(
    key: str,
    title: str,
    unit: str,
    measure: Callable[[BoomHistory], float | None],
    *,
    what: str,
    decisive: bool = False,
) -> Criterion:
    """Create a criterion of the program's own, with its usual limits."""
    good, acceptable, weight = LIMITS[key]
    return Criterion(
        key=key, title=title, unit=unit, good=good, acceptable=acceptable, weight=weight, what=what, measure=measure, decisive=decisive
    )  # fmt: skip


_OWN = (
    _known(
        "held", "Oil held", "%", measures.held, decisive=True,
        what="Share of the oil held at the end, of all oil that was ever in the boom. Holding oil is the boom's "
        "purpose. Lost oil counts until it is taken back.",
    ),
    _known(
        "encountered", "Oil met", "%", measures.met,
        what="Share of the oil that got into the boom, of that and the oil that it went past; oil still ahead does not count. "
        "A sweep must meet the slick: check position, heading and opening of the U.",
    ),
    _known(
        "fed", "Oil met of what the funnel passed on", "%", measures.fed,
        what="Share of the oil that came out of the funnel ahead which this boom met. Who follows stays right behind the opening: "
        "there the oil is in a band as wide as the opening.",
    ),
    _known(
        "passed_on", "Oil passed on", "%", measures.passed_on,
        what="Share of the oil that left the boom which went on beyond its free end, to the boom that follows. The rest went under the "
        "skirt, and is lost to it. Oil that the boom still leads is on its way.",
    ),
    _known(
        "clean", "Oil in the protected water", "%", measures.most_in_area, decisive=True,
        what="Largest share of all oil that was in the protected water at any time. The boom is there to keep it clean.",
    ),
    _known(
        "led", "Oil led to the pocket", "%", measures.led, decisive=True,
        what="Share of all oil that was in the recovery pocket at the end. The boom is there to lead the oil to it.",
    ),
    _known(
        "speed", "Time over 0.7 kn", "%", partial(measures.time_over, speed=PRACTICE_SPEED),
        what="Share of the time in which water kept running against a twentieth of the boom's length at more than 0.7 knots "
        "normal to it. Above this speed booms lose oil. The speed is averaged over the time in which the water passes "
        "the skirt's depth, because a shorter swing draws no oil under, and in waves over ten of them.",
    ),
    _known(
        "design_speed", "Time over 0.6 kn", "%", partial(measures.time_over, speed=DESIGN_SPEED),
        what="Share of the time in which water kept running against a twentieth of the boom's length at more than 0.31 m/s normal to "
        "it, for which booms are designed to leak nothing.",
    ),
    _known(
        "gross_speed", "Time over 1 kn", "%", partial(measures.time_over, speed=GROSS_SPEED),
        what="Share of the time in which water kept running against a twentieth of the boom's length at more than 0.51 m/s normal to "
        "it. Losses are massive there.",
    ),
    _known(
        "recovered", "Oil recovered", "%", measures.recovered,
        what="Share of the oil that skimmers took, of all oil that the boom met. Oil in the boom is not yet off the water.",
    ),
    _known(
        "skimmer", "Skimmer off the oil", "m", measures.skimmer,
        what="Mean distance of the skimmer's mouth from the middle of the nearest oil that a boom holds. A skimmer works in the "
        "pool or not at all.",
    ),
    _known(
        "deployed", "Time to deploy", "s", measures.deployed,
        what="Time from which on the second end of the boom lay at its berth. Oil does not wait for the boom.",
    ),
    _known(
        "connected", "Time to connect", "s", measures.connected, decisive=True,
        what="Time at which the last tie that waits at this boom was made fast. A boom that ends beside the next one is a gate.",
    ),
    _known(
        "strength", "Load of the boom", "%", measures.strength,
        what="Largest tension in the boom, as a share of what it bears there. Waves and jerks need the reserve.",
    ),
    _known(
        "gap", "Gap ratio, distance from 1:3", "%", measures.gap,
        what="Distance of the mean gap ratio under way from one third. A wider gap raises speed and tension in "
        "the apex; a narrower gap sweeps less.",
    ),
    _known(
        "lean", "Lean of the skirt", "deg", measures.lean,
        what="Lean of the skirt that 95 % of the boom's length and time do not exceed; in waves the mean over a wave. A leaning skirt "
        "has less draft, and the water slips under it.",
    ),
    _known(
        "draft", "Draft of the skirt", "%", measures.draft,
        what="Draft as a share of the skirt's depth, kept by 95 % of the boom's length and time; in waves the mean over a wave. "
        "Lean and lift reduce it.",
    ),
    _known(
        "snatch", "Snatch loads", "times", measures.snatch,
        what="Peak of the tow tension over its mean, under way. Jerks break lines and shake oil out of the boom. "
        "Change speed slowly.",
    ),
    _known(
        "sharing", "Uneven pull", "%", measures.sharing,
        what="Difference of the mean tension at the two ends, under way. Vessels that are abreast and on station "
        "pull equally.",
    ),
)  # fmt: skip
CRITERIA: Mapping[str, Criterion] = {criterion.key: criterion for criterion in _OWN}


def criteria_for(deployment: str, settings: Mapping[str, CriterionSettings]) -> tuple[Criterion, ...]:
    """Return the criteria that count for a kind of deployment, with what `settings` change and add, in the order of the page."""
    usual = CRITERIA_OF.get(deployment, CRITERIA_OF["sweep"])
    keys = [*usual, *(key for key in settings if key not in usual)]
    chosen = (_with_settings(key, settings.get(key)) for key in keys)
    return tuple(criterion for criterion in chosen if criterion.weight > 0.0)


def _with_settings(key: str, settings: CriterionSettings | None) -> Criterion:
    """Return a criterion of the program with a scenario's limits and weight, or a scenario's own one."""
    good, acceptable, weight = limits_of(key, settings)
    if key in CRITERIA:
        return replace(CRITERIA[key], good=good, acceptable=acceptable, weight=weight)
    assert settings is not None and settings.series is not None  # `criteria_problems` has looked
    return Criterion(
        key=key,
        title=settings.title or key,
        unit=settings.unit,
        good=good,
        acceptable=acceptable,
        weight=weight,
        what=settings.why or f"Series {settings.series} of the recording: {settings.statistic}.",
        measure=partial(_of_series, name=settings.series, statistic=settings.statistic),
    )


def grade(history: BoomHistory, settings: Mapping[str, CriterionSettings] | None = None) -> Grade:
    """Judge one boom's exercise by the criteria of its deployment; criteria that cannot be measured do not count."""
    findings = []
    own = {key: one for key, one in (settings or {}).items() if one.boom in (None, history.boom.name)}
    for criterion in criteria_for(history.boom.deployment, own):
        value = criterion.measure(history)
        if value is None and criterion.key in IF_THERE:
            continue
        verdict = None if value is None else criterion.verdict(value)
        findings.append(Finding(criterion=criterion, value=value, verdict=verdict))
    judged = [(finding.criterion.weight, finding.verdict) for finding in findings if finding.verdict is not None]
    total = sum(weight for weight, _ in judged)
    if not total:
        return Grade(letter="", share=0.0, capped_by="", findings=tuple(findings))
    share = sum(weight * _POINTS[verdict] for weight, verdict in judged) / total
    letter = next(letter for letter, least in LETTERS if share >= least)
    best, why = _best(history, findings)
    capped = letter < best
    return Grade(
        letter=best if capped else letter, share=share, capped_by=why if capped else "", findings=tuple(findings)
    )


def _best(history: BoomHistory, findings: Sequence[Finding]) -> tuple[str, str]:
    """Return the best letter that the exercise can have, and why."""
    worst = LETTERS[-1][0]
    if not history.crew_acted:
        return worst, "nobody acted: the exercise needs orders, and no vessel, line or skimmer was given one"
    if history.boom.deployment == "sweep" and measures.met(history) == 0.0:
        return worst, "the boom met no oil"
    missed = [f.criterion.title for f in findings if f.criterion.decisive and f.verdict == "missed"]
    return (CAP, f"a decisive criterion was missed: {missed[0]}") if missed else (LETTERS[0][0], "")


def grades_of(replay: Replay) -> dict[str, Grade]:
    """Return the grades of a recorded exercise by its booms' names, judged by the criteria of its scenario."""
    exercise = replay.run.exercise
    criteria = {} if exercise is None else criteria_from(exercise.criteria, str(replay.path))
    return {history.boom.name: grade(history, criteria) for history in boom_histories(replay)}


def exercise_grade(grades: Mapping[str, Grade]) -> tuple[str, Grade] | None:
    """Return the grade of an exercise, and the boom whose it is: the lowest one, since oil goes where the weakest boom lets it.

    grades: of all booms, by name. None if none has a letter.
    """
    judged = [(name, one) for name, one in grades.items() if one.letter]
    return max(judged, key=lambda pair: (pair[1].letter, -pair[1].share), default=None)


def read_criteria(path: Path) -> dict[str, CriterionSettings]:
    """Read criteria from a TOML file with a table for each, by the key that the page shows: [held] good = 90, acceptable = 70, weight = 2.

    Raises ScenarioError with everything that is wrong in the file.
    """
    try:
        _, tables = read_toml_file(path)
    except OSError as error:
        raise ScenarioError([Problem("file", f"cannot be read: {error.strerror or error}")], str(path)) from error
    except ValueError as error:
        raise ScenarioError([Problem("file", f"is not valid TOML: {error}")], str(path)) from error
    return criteria_from(tables, str(path))


def criteria_from(tables: Mapping[str, Any], source: str) -> dict[str, CriterionSettings]:
    """Create the settings of criteria from plain tables; ScenarioError with everything that is wrong in `source`."""
    found, problems = dict[str, CriterionSettings](), list[Problem]()
    for key, table in tables.items():
        try:
            found[key] = structure(table, CriterionSettings)
        except ScenarioError as error:
            problems += [problem.below(key) for problem in error.problems]
    problems += criteria_problems(found)
    if problems:
        raise ScenarioError(problems, source)
    return found

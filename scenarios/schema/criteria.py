"""The criteria by which an exercise is graded: which count for which kind of deployment, their limits, and a scenario's own; prices too.

The page of a debrief shows each criterion with its key, and a scenario, or a trainer's file, changes it by that key.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from oilsim.core.quantity import quantity
from scenarios.schema.parsing.quantity_fields import Section
from scenarios.schema.parsing.relations import Relation, needed_with, reference
from scenarios.text.problems import Problem, suggestion

Deployment = Literal["sweep", "funnel", "containment", "exclusion", "diversion", "trial"]
Statistic = Literal["end", "mean", "largest", "smallest"]

# key: limit up to which it is met, limit up to which it is partly met, weight
LIMITS: Mapping[str, tuple[float, float, float]] = {
    "held": (95.0, 80.0, 3.0),
    "encountered": (90.0, 60.0, 2.0),
    "fed": (90.0, 60.0, 3.0),
    "passed_on": (95.0, 80.0, 3.0),
    "clean": (1.0, 5.0, 3.0),
    "led": (90.0, 60.0, 3.0),
    "recovered": (60.0, 30.0, 2.0),
    "skimmer": (5.0, 10.0, 1.0),
    "deployed": (300.0, 600.0, 2.0),
    "connected": (300.0, 600.0, 2.0),
    "strength": (50.0, 80.0, 1.0),
    "speed": (0.0, 10.0, 2.0),
    "design_speed": (10.0, 40.0, 1.0),
    "gross_speed": (0.0, 1.0, 2.0),
    "gap": (8.0, 15.0, 1.0),
    "lean": (20.0, 35.0, 1.0),
    "draft": (80.0, 60.0, 1.0),
    "snatch": (2.0, 3.0, 1.0),
    "sharing": (15.0, 30.0, 1.0),
}
_ANY_BOOM = ("speed", "lean", "draft", "snatch")
CRITERIA_OF: Mapping[str, tuple[str, ...]] = {
    "sweep": (
        "held",
        "encountered",
        "fed",
        "recovered",
        "skimmer",
        "deployed",
        "connected",
        "speed",
        "gap",
        "lean",
        "draft",
        "snatch",
        "sharing",
    ),
    "funnel": ("passed_on", *_ANY_BOOM),
    "containment": ("held", "deployed", "connected", *_ANY_BOOM),
    "exclusion": ("clean", *_ANY_BOOM),
    "diversion": ("led", *_ANY_BOOM),
    "trial": (),
}
"""Keys of the criteria that count for each kind of deployment, in the order of the page; a trial rates the boom, not the crew."""


@dataclass(frozen=True, kw_only=True)
class CriterionSettings(Section):
    """A change to a criterion, or a criterion of the scenario's own, which measures a recorded series.

    A key of the page changes that criterion's limits or weight, and adds it where the deployment does not have it; the weight 0 leaves it
    out. Any other key is a new criterion: it needs `series`, `good` and `acceptable`.

    good        limit up to which the criterion is met
    acceptable  limit up to which it is partly met; it is above `good` if less is better
    weight      in the grade, beside 1 to 3 of the program's own
    series      name of a series of the recording, such as ``oil_lost/around_ends`` or ``probes/gauge``, in its own unit
    statistic   value of the series that counts: at the end, or its mean, largest or smallest value once the boom is settled
    boom        name of the one boom whose grade it changes; by default those of all booms
    title, unit, why  text for the page
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (needed_with("good acceptable", "series"),)
    good: float | None = quantity("", default=None)
    acceptable: float | None = quantity("", default=None)
    weight: float | None = quantity("", default=None, at_least=0.0)
    series: str | None = None
    statistic: Statistic = "end"
    boom: str | None = reference("booms", default=None)
    title: str | None = None
    unit: str = ""
    why: str = ""


def limits_of(key: str, settings: CriterionSettings | None) -> tuple[float, float, float]:
    """Return the limits and the weight of a criterion as a scenario sets them."""
    good, acceptable, weight = LIMITS.get(key, (0.0, 0.0, 1.0))
    if settings is None:
        return good, acceptable, weight
    return (
        good if settings.good is None else settings.good,
        acceptable if settings.acceptable is None else settings.acceptable,
        weight if settings.weight is None else settings.weight,
    )


def criteria_problems(criteria: Mapping[str, CriterionSettings]) -> Iterator[Problem]:
    """Yield problems of a scenario's criteria together with the program's own."""
    for key, settings in criteria.items():
        good, acceptable, _ = limits_of(key, settings)
        if key not in LIMITS and settings.series is None:
            hint = suggestion(key, LIMITS) or ","
            yield Problem(key, f"is unknown{hint} allowed: {', '.join(sorted(LIMITS))}, or another key with a series")
        elif key in LIMITS and settings.series is not None:
            yield Problem(f"{key}.series", "is given, allowed: only for a key that the program does not have itself")
        elif good == acceptable:
            yield Problem(key, "has equal limits `good` and `acceptable`, allowed: two different limits")
        elif key in LIMITS and (good > acceptable) != (LIMITS[key][0] > LIMITS[key][1]):
            better = "above" if LIMITS[key][0] > LIMITS[key][1] else "below"
            text = f"has good = {good:g} and acceptable = {acceptable:g}, allowed: `good` {better} `acceptable`"
            yield Problem(key, f"{text}; {'more' if better == 'above' else 'less'} is better here")


@dataclass(frozen=True, kw_only=True)
class PriceSettings(Section):
    """Prices of the operation, in one currency. What has no price is not counted, and the report says so.

    currency          name or sign, such as "EUR"
    vessel_hour       of a vessel with crew and fuel, for an hour
    skimmer_hour      of a skimmer with its crew, for an hour
    boom_metre_day    of a metre of boom, for a day
    recovered_m3      to take one cubic metre of recovered fluid, oil and water, ashore and dispose of it
    lost_m3           damage by one cubic metre of oil that booms have lost and none holds
    stranded_m3       to clean one cubic metre of oil from a shore
    """

    currency: str
    vessel_hour: float | None = quantity("", default=None, at_least=0.0)
    skimmer_hour: float | None = quantity("", default=None, at_least=0.0)
    boom_metre_day: float | None = quantity("", default=None, at_least=0.0)
    recovered_m3: float | None = quantity("", default=None, at_least=0.0)
    lost_m3: float | None = quantity("", default=None, at_least=0.0)
    stranded_m3: float | None = quantity("", default=None, at_least=0.0)

"""Prices of an operation, by the hour, by the metre of boom and by the cubic metre of oil, for the reports of an exercise."""

from __future__ import annotations

from dataclasses import dataclass

from oilsim.core.quantity import quantity
from scenarios.schema.parsing.quantity_fields import Section


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

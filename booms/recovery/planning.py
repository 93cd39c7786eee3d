"""Planning formulas for skimming systems, after the Response Options Calculator (ROC) of NOAA and Genwest; SI units.

Q = w V h is the oil that a swath w meets at a speed V in a slick of thickness h. A skimmer takes the share TE of it (throughput efficiency)
in a fluid of which the share RE is oil (recovery efficiency); the fluid is Q TE / RE, at most the nameplate N of the pump. Where the pump
limits it, TE falls to N RE / Q. The effective daily recovery capacity is N x 24 h x 20 % (33 CFR 155 appendix B, 30 CFR 254.44).
"""

from __future__ import annotations

from typing import NamedTuple

DERATING = 0.2  # [-] of a nameplate, for the effective daily recovery capacity (33 CFR 155 appendix B)
DAY = 86400.0  # [s]


class RecoveryRates(NamedTuple):
    """Rates of a skimming system [m3/s]: oil met, oil taken, fluid pumped, free water in it; and the throughput efficiency [-] reached."""

    encountered: float
    oil: float
    fluid: float
    water: float
    throughput_efficiency: float


def recovery_rates(
    encountered: float, *, throughput_efficiency: float, recovery_efficiency: float, nameplate: float
) -> RecoveryRates:
    """Compute the rates of a system that meets `encountered` [m3/s] of oil; nameplate [m3/s] is of fluid, oil and water together."""
    oil = min(encountered * throughput_efficiency, nameplate * recovery_efficiency)
    fluid = oil / recovery_efficiency
    reached = oil / encountered if encountered > 0.0 else throughput_efficiency
    return RecoveryRates(encountered, oil, fluid, fluid - oil, reached)


def widest_swath(
    thickness: float, speed: float, *, throughput_efficiency: float, recovery_efficiency: float, nameplate: float
) -> float:
    """Compute the swath [m] at which the pump is just busy: N RE / (V h TE); thickness [m], speed [m/s], nameplate [m3/s]."""
    return nameplate * recovery_efficiency / (speed * thickness * throughput_efficiency)


def daily_capacity(nameplate: float) -> float:
    """Compute the effective daily recovery capacity [m3 a day] of a nameplate [m3/s]."""
    return nameplate * DAY * DERATING

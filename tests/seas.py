"""Simple seas for tests of loads."""

from __future__ import annotations

import math

from oilsim.sea import (
    CurrentProfile,
    KaimalGusts,
    RegularWaves,
    Sea,
    SeaDescription,
    SeaForcing,
    SteadyFlow,
    WindDrift,
    WindField,
    Zone,
)


def steady(flow: tuple[float, float]) -> SteadyFlow:
    """A flow with these components [m/s]."""
    return SteadyFlow(speed=math.hypot(*flow), direction=math.atan2(flow[1], flow[0]))


def shallow_sea(
    depth: float,
    *,
    level: float | None = None,
    current: tuple[float, float] | None = None,
    wind: tuple[float, float] | None = None,
    waves: RegularWaves | None = None,
    gusts: KaimalGusts | None = None,
    drift: WindDrift | None = None,
    density: float = 1025.0,
) -> Sea:
    """The sea of a tank of a depth [m], by default with its floor at 0."""
    return Sea(
        SeaDescription(
            depth=depth,
            level=depth if level is None else level,
            density=density,
            waves=waves,
            current=None if current is None else CurrentProfile(flow=steady(current)),
            wind=None if wind is None else WindField(flow=steady(wind), gusts=gusts, drift=drift),
        )
    )


def current_in(zone: Zone, current: tuple[float, float], depth: float = 1.0) -> SeaForcing:
    """A current (2,) [m/s] that a zone of a tank renews."""
    return SeaForcing(shallow_sea(depth, current=current), spacing=0.1, zones=[zone])


def steady_sea(current=(0.0, 0.0), wind=(0.0, 0.0), density=1027.0, waves=None) -> Sea:
    """A deep sea with a uniform current and wind (2,) [m/s]; the wind does not drag the water."""
    flows = [steady(flow) for flow in (current, wind)]
    return Sea(
        SeaDescription(
            depth=1000.0,
            density=density,
            waves=waves,
            current=CurrentProfile(flow=flows[0]),
            wind=WindField(flow=flows[1], drift=None),
        )
    )

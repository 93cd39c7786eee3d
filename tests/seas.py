"""Simple seas for tests of loads."""

from __future__ import annotations

import math

from oilsim.sea import CurrentProfile, Sea, SeaDescription, SteadyFlow, WindField


def steady_sea(current=(0.0, 0.0), wind=(0.0, 0.0), density=1027.0, waves=None) -> Sea:
    """A deep sea with a uniform current and wind (2,) [m/s]; the wind does not drag the water."""
    flows = [SteadyFlow(speed=math.hypot(*flow), direction=math.atan2(flow[1], flow[0])) for flow in (current, wind)]
    return Sea(
        SeaDescription(
            depth=1000.0,
            density=density,
            waves=waves,
            current=CurrentProfile(flow=flows[0]),
            wind=WindField(flow=flows[1], drift=None),
        )
    )

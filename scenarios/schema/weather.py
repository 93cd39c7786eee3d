"""Wind, waves and current of a scenario, with the limits, units and defaults of `oilsim.forcing`.

Directions are where wind, waves and current go **to**, counter-clockwise about z from +x: 180 degrees is along -x.
Waves and current act in a zone, a box between `lower` and `upper` [m]; without one, in the whole tank. In its zone the
velocity is drawn to the wave's or the current's within `relaxation_time` [s]; outside, the sea runs freely.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from oilsim.core.quantity import quantity_of
from oilsim.forcing import AiryWaves, Current, Wind, Zone, heading
from scenarios.problems import Problem
from scenarios.schema.parsing.quantity_fields import Section, Vector, above_lower


@dataclass(frozen=True, kw_only=True)
class WindSettings(Section):
    """A wind that drags on the surface of the liquid, with gusts that follow from the run's seed.

    speed             [m/s] mean, at 10 m height
    direction         [rad] it blows to
    gustiness         standard deviation of the speed / its mean
    gust_time         [s] correlation time of the gusts
    drag_coefficient  C_D in stress = rho_air C_D |U - v| (U - v)
    """

    COMPASS: ClassVar[str | None] = "from_compass"
    speed: float = quantity_of(Wind, "speed")
    direction: float = quantity_of(Wind, "direction", default=0.0)
    gustiness: float = quantity_of(Wind, "gustiness")
    gust_time: float = quantity_of(Wind, "gust_time")
    drag_coefficient: float = quantity_of(Wind, "drag_coefficient")


@dataclass(frozen=True, kw_only=True)
class ZoneSettings(Section):
    """The zone in which a forcing acts, and how fast it acts.

    edge  [m] in which it rises smoothly from nothing at those sides across x and y that lie within the tank: a graded sponge
    """

    lower: Vector | None = quantity_of(Zone, "lower", default=None)
    upper: Vector | None = quantity_of(Zone, "upper", default=None)
    relaxation_time: float = quantity_of(Zone, "relaxation_time", default=0.5)
    edge: float = quantity_of(Zone, "edge")

    def problems(self) -> Iterator[Problem]:
        """Check that a zone has both corners and a volume, or no corner."""
        if (self.lower is None) != (self.upper is None):
            missing = "lower" if self.lower is None else "upper"
            yield Problem(missing, "is missing, allowed: both corners of the zone, or neither for the whole tank")
        elif self.lower is not None and self.upper is not None:
            yield from above_lower(self.lower, self.upper)
        elif self.edge > 0.0:
            yield Problem("edge", f"is {self.edge:g}, allowed: only with a zone, from lower to upper")


@dataclass(frozen=True, kw_only=True)
class WaveSettings(ZoneSettings):
    """A regular wave train of linear (Airy) theory.

    height     [m] crest to trough
    period     [s] as seen from the water, which a current carries along with its waves
    direction  [rad] it runs to
    level      [m] height of the still water; the default is that of the water at the start
    """

    COMPASS: ClassVar[str | None] = "from_compass"
    height: float = quantity_of(AiryWaves, "height")
    period: float = quantity_of(AiryWaves, "period")
    direction: float = quantity_of(AiryWaves, "direction", default=0.0)
    level: float | None = quantity_of(AiryWaves, "level", default=None)


@dataclass(frozen=True, kw_only=True)
class CurrentSettings(ZoneSettings):
    """A steady, uniform current: speed [m/s] and the direction [rad] it runs to."""

    COMPASS: ClassVar[str | None] = "toward_compass"
    speed: float = quantity_of(Current, "speed")
    direction: float = quantity_of(Current, "direction", default=0.0)


@dataclass(frozen=True, kw_only=True)
class ForcingSettings(Section):
    """Forces on the liquid beside gravity; one that is left out does not act and costs nothing."""

    wind: WindSettings | None = None
    waves: WaveSettings | None = None
    current: CurrentSettings | None = None


def horizontal(speed: float, direction: float) -> Vector:
    """Compute the horizontal velocity (3,) [m/s] of something that goes to `direction` [rad from +x]."""
    x, y = heading(direction)
    return speed * x, speed * y, 0.0

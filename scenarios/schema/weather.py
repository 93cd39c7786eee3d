"""Wind, waves and current of a scenario.

A direction is the one that wind, waves and current go **to**, counter-clockwise about z from +x: 180 degrees is along -x. Waves and
current act in a zone, a box between `lower` and `upper` [m]; without a zone, in the whole tank. In the zone the velocity approaches that
of the wave or current within `relaxation_time` [s]; outside, the sea moves freely.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from oilsim.forcing import heading
from scenarios.problems import Problem
from scenarios.schema.quantity_fields import Section, Vector, above_lower, quantity


@dataclass(frozen=True, kw_only=True)
class WindSettings(Section):
    """A wind that drags on the surface of the liquid, with gusts that follow from the run's seed.

    speed             [m/s] mean, at 10 m height
    direction         [rad] it blows to
    gustiness         standard deviation of the speed / its mean
    gust_time         [s] correlation time of the gusts
    drag_coefficient  C_D in stress = rho_air C_D |U - v| (U - v)
    """

    speed: float = quantity("m/s", at_least=0.0, at_most=100.0)
    direction: float = quantity("rad", default=0.0)
    gustiness: float = quantity("", default=0.0, at_least=0.0, at_most=1.0)
    gust_time: float = quantity("s", default=3.0, above=0.0)
    drag_coefficient: float = quantity("", default=1.3e-3, above=0.0)


@dataclass(frozen=True, kw_only=True)
class ZoneSettings(Section):
    """The zone in which a forcing acts, and how fast it acts."""

    lower: Vector | None = quantity("m", default=None)
    upper: Vector | None = quantity("m", default=None)
    relaxation_time: float = quantity("s", default=0.5, above=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that a zone has both corners and a volume, or no corner."""
        if (self.lower is None) != (self.upper is None):
            missing = "lower" if self.lower is None else "upper"
            yield Problem(missing, "is missing, allowed: both corners of the zone, or neither for the whole tank")
        elif self.lower is not None and self.upper is not None:
            yield from above_lower(self.lower, self.upper)


@dataclass(frozen=True, kw_only=True)
class WaveSettings(ZoneSettings):
    """A regular wave train of linear (Airy) theory.

    height     [m] crest to trough
    period     [s] as seen from the water, which a current carries along with its waves
    direction  [rad] it runs to
    level      [m] height of the still water; the default is that of the water at the start
    """

    height: float = quantity("m", above=0.0)
    period: float = quantity("s", above=0.0)
    direction: float = quantity("rad", default=0.0)
    level: float | None = quantity("m", default=None)


@dataclass(frozen=True, kw_only=True)
class CurrentSettings(ZoneSettings):
    """A steady, uniform current: speed [m/s] and the direction [rad] it runs to."""

    speed: float = quantity("m/s", at_least=0.0, at_most=20.0)
    direction: float = quantity("rad", default=0.0)


@dataclass(frozen=True, kw_only=True)
class ForcingSettings(Section):
    """The forces on the liquid beside gravity; a table that is left out has no effect and no cost."""

    wind: WindSettings | None = None
    waves: WaveSettings | None = None
    current: CurrentSettings | None = None


def horizontal(speed: float, direction: float) -> Vector:
    """Compute the horizontal velocity (3,) [m/s] of something that goes to `direction` [rad from +x]."""
    x, y = heading(direction)
    return speed * x, speed * y, 0.0

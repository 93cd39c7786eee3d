"""Size and resolution of a window."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from oilsim.core.config import SHORTEST_WAVE
from oilsim.core.physical_constants import GRAVITY
from oilsim.core.quantity import quantity, require

# [1] steps in the period of the shortest wave that particles carry; theory; its period is then 1.4 % off, (omega dt)^2 / 24
STEPS_A_PERIOD = 11.0
# [1] share of the size that the rim takes on each side; numerical; half of the box is left in the middle
RIM_SHARE = 0.25
# [d] along a side at least; numerical; three supports, so that no particle meets an image of itself
SIDE = 9.0
# settings of `FluidConfig` that a window takes as they are; its scheme is "split", its gravity that of the sea
SOLVER_OPTIONS = ("divergence_tolerance", "viscosity_correction", "minimum_time_step", "maximum_time_step")


@dataclass(frozen=True, kw_only=True)
class WindowSettings:
    """Size and resolution of a window.

    size       (2,) [m] along x and y, rounded to whole spacings
    depth      [m] of its water
    spacing    [m] between particles
    rim        [m] width of the zone along each side in which disturbances end; None: RIM_SHARE of the smaller size
    sleep_speed  [m/s] below which water sleeps; 0: it never does
    dimension  3, or 2 for a plane case in x and z
    solver     values of SOLVER_OPTIONS, by name; `FluidConfig` has their units and limits
    Raises ValueError for values that are not allowed.
    """

    size: tuple[float, float]
    depth: float = quantity("m", above=0.0)
    spacing: float = quantity("m", above=0.0)
    rim: float | None = quantity("m", default=None, above=0.0)
    sleep_speed: float = quantity("m/s", default=0.0, at_least=0.0)
    dimension: int = quantity("", default=3, at_least=2, at_most=3, whole=True)
    solver: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require("window", WindowSettings, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        if not (np.shape(self.size) == (2,) and all(math.isfinite(side) and side > 0.0 for side in self.size)):
            yield f"size is {self.size} m, allowed: two finite numbers above 0"
            return
        if min(self.whole_size[: len(self.sides)]) < SIDE * self.spacing:
            yield f"size is {self.size} m, allowed: {SIDE:g} spacings of {self.spacing:g} m or more"
        if self.depth < 4.0 * self.spacing:
            yield f"depth is {self.depth:g} m, allowed: 4 spacings of {self.spacing:g} m or more"
        if not 2.0 * self.width < min(self.sides):
            yield f"rim is {self.width:g} m on each side, allowed: less than half of the size, {0.5 * min(self.sides):g} m"
        for name in self.solver:
            if name not in SOLVER_OPTIONS:
                yield f"solver has {name!r}, allowed: {', '.join(SOLVER_OPTIONS)}"

    def longest_time_step(self, gravity: float) -> float:
        """Return the longest time step [s]: the one that is set, or else STEPS_A_PERIOD of them in the period of the shortest wave.

        The sea's own waves are none of the particles', only what bodies and oil add is. gravity [m/s2].
        """
        if self.solver.get("maximum_time_step") is not None:
            return float(self.solver["maximum_time_step"])
        return math.sqrt(2.0 * math.pi * SHORTEST_WAVE * self.spacing / (gravity or GRAVITY)) / STEPS_A_PERIOD

    @property
    def sides(self) -> tuple[float, ...]:
        """Size along the axes that there are [m]."""
        return self.size if self.dimension == 3 else self.size[:1]

    @property
    def whole_size(self) -> tuple[float, float]:
        """Size [m] in whole spacings."""
        x, y = (self.spacing * max(1, round(side / self.spacing)) for side in self.size)
        return x, y

    @property
    def layers(self) -> int:
        """Layers of particles."""
        return max(1, round(self.depth / self.spacing))

    @property
    def particle_count(self) -> int:
        """Particles of water without bodies."""
        return self.layers * math.prod(round(side / self.spacing) for side in self.sides)

    @property
    def width(self) -> float:
        """Width of the rim [m]."""
        return RIM_SHARE * min(self.sides) if self.rim is None else self.rim


def fluid_steps(settings: WindowSettings, gravity: Sequence[float], step: float) -> int:
    """Return the steps that the particles make in a communication step [s] under a gravity (3,) [m/s2]."""
    return max(1, math.ceil(step / settings.longest_time_step(float(np.linalg.norm(gravity))) - 1e-9))

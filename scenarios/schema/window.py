"""The window of a scenario: a box of particles that follows a target through the sea of [sea]."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from oilsim.core.quantity import quantity
from oilsim.window.settings import SOLVER_OPTIONS, WindowSettings
from scenarios.schema.liquid import FluidSettings
from scenarios.schema.parsing.quantity_fields import Point2, Section
from scenarios.schema.parsing.relations import reference
from scenarios.text.problems import Problem


@dataclass(frozen=True, kw_only=True)
class WindowTable(Section):
    """A box of particles inside the sea, which has rims for walls; all other water is formulas (docs/window.md).

    It takes the place of a [tank].

    target  name of a boom, whose middle the box follows, of a skimmer, which it follows by what carries it, of a vessel or of a body; or a
             place (x, y) [m]
    spacing  [m] of the particles, by default fluid.particle_spacing; "live": the finest that this machine computes in real time;
             "fine": 8 to a skirt. With it, size and depth may be left out: they are 21 and 2.7 drafts of the target
    size    [m] along x and y
    depth   [m] of its water; the sea's own motion feels no floor there
    rim     [m] width of the zone along each side where what bodies add comes to rest; by default a quarter of the smaller size
    """

    target: str | Point2 = reference("booms", "skimmers", "vessels", "bodies")
    spacing: Literal["live", "fine"] | float | None = None
    size: Point2 | None = quantity("m", default=None)
    depth: float | None = quantity("m", default=None, above=0.0)
    rim: float | None = quantity("m", default=None, above=0.0)

    def spacing_in(self, fluid: FluidSettings) -> float:
        """Return the spacing [m] of the particles: the own one if it is a number, else that of [fluid]."""
        return self.spacing if isinstance(self.spacing, float) else fluid.particle_spacing

    def settings(self, fluid: FluidSettings) -> WindowSettings:
        """Return the description of the window, with particles as [fluid] has them; ValueError for what cannot be."""
        if self.size is None or self.depth is None:
            raise ValueError("window: size and depth are not both given, allowed: both, or spacing")
        return WindowSettings(
            size=self.size,
            depth=self.depth,
            spacing=self.spacing_in(fluid),
            rim=self.rim,
            sleep_speed=fluid.sleep_speed,
            dimension=fluid.dimension,
            solver={name: getattr(fluid, name) for name in SOLVER_OPTIONS},
        )

    def problems(self) -> Iterator[Problem]:
        """Yield a spacing that cannot be."""
        if isinstance(self.spacing, float) and not (math.isfinite(self.spacing) and self.spacing > 0.0):
            yield Problem("spacing", f'is {self.spacing} m, allowed: "live", "fine", or above 0')

    def problems_with(self, fluid: FluidSettings) -> Iterator[Problem]:
        """Yield what is wrong with the window for these particles; one that `spacing` will size is looked at when it is."""
        if self.spacing is not None and (isinstance(self.spacing, str) or self.size is None or self.depth is None):
            return
        try:
            self.settings(fluid)
        except ValueError as error:
            yield Problem("", str(error).removeprefix("window: "))

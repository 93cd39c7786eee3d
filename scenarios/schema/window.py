"""The window of a scenario: a box of particles that follows a target through the sea of [sea]."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from oilsim.quantity import quantity
from oilsim.window.settings import WindowSettings
from scenarios.problems import Problem
from scenarios.schema.liquid import FluidSettings
from scenarios.schema.quantity_fields import Point2, Section


@dataclass(frozen=True, kw_only=True)
class WindowTable(Section):
    """A box of particles inside the sea, of runs with run.detail = "window"; all other water is formulas (docs/window.md).

    target  name of a boom, whose middle segment the box follows, of a vessel or of a body; or a place (x, y) [m]
    size    [m] along x and y
    depth   [m] of its water; the sea's own motion feels no floor there
    rim     [m] width of the zone along each side where what bodies add comes to rest; by default a quarter of the smaller size
    """

    target: str | Point2
    size: Point2 = quantity("m")
    depth: float = quantity("m", above=0.0)
    rim: float | None = quantity("m", default=None, above=0.0)

    def settings(self, fluid: FluidSettings) -> WindowSettings:
        """Return the description of the window, with particles as [fluid] has them; ValueError for what cannot be."""
        return WindowSettings(
            size=self.size,
            depth=self.depth,
            spacing=fluid.particle_spacing,
            rim=self.rim,
            sleep_speed=fluid.sleep_speed,
            dimension=fluid.dimension,
        )

    def problems_with(self, fluid: FluidSettings) -> Iterator[Problem]:
        """Yield what is wrong with the window for these particles."""
        try:
            self.settings(fluid)
        except ValueError as error:
            yield Problem("window", str(error).removeprefix("window: "))

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
class OuterWindow(Section):
    """A larger window of coarser particles around the window, in whose water that lies; both have one middle and one depth.

    spacing  [m] of its particles
    size     [m] along x and y
    """

    spacing: float = quantity("m", above=0.0)
    size: Point2


@dataclass(frozen=True, kw_only=True)
class WindowTable(Section):
    """A box of particles inside the sea, which has rims for walls; all other water is formulas (docs/window.md).

    It takes the place of a [tank].

    target  name of a boom, whose middle the box follows, of a skimmer, which it follows by what carries it, of a vessel or of a body; or a
             place (x, y) [m]
    spacing  [m] of the particles, by default fluid.particle_spacing; "live": the finest that this machine computes in real time;
             "fine": 8 to a skirt. With these words size and depth may be left out. They are then 21 and 2.7 drafts of the target. A
             "fine" window without size, depth and outer is 10 drafts wide, and its outer window 21, with 4 particles to a skirt
    size    [m] along x and y
    depth   [m] of its water; the sea's own motion feels no floor there
    rim     [m] width of the zone along each side where what bodies add comes to rest, or to the motion of the outer window; by default a
             quarter of the smaller size
    outer   a larger and coarser window around it, in place of the sea by formulas; by default none
    """

    target: str | Point2 = reference("booms", "skimmers", "vessels", "bodies")
    spacing: Literal["live", "fine"] | float | None = None
    size: Point2 | None = quantity("m", default=None)
    depth: float | None = quantity("m", default=None, above=0.0)
    rim: float | None = quantity("m", default=None, above=0.0)
    outer: OuterWindow | None = None

    def spacing_in(self, fluid: FluidSettings) -> float:
        """Return the spacing [m] of the particles: the own one if it is a number, else that of [fluid]."""
        return self.spacing if isinstance(self.spacing, float) else fluid.particle_spacing

    def settings(self, fluid: FluidSettings) -> WindowSettings:
        """Return the description of the window, with particles as [fluid] has them; ValueError for what cannot be."""
        if self.size is None or self.depth is None:
            raise ValueError("window: size and depth are not both given, allowed: both, or spacing")
        return _settings(self.size, self.depth, self.spacing_in(fluid), self.rim, fluid)

    def boxes(self, fluid: FluidSettings) -> tuple[WindowSettings, ...]:
        """Return the descriptions of the window and, if there is one, of its outer one; ValueError for what cannot be."""
        outer = self._outer_settings(fluid)
        return (self.settings(fluid),) if outer is None else (self.settings(fluid), outer)

    def _outer_settings(self, fluid: FluidSettings) -> WindowSettings | None:
        """Return the description of the outer window, None without one; ValueError for what cannot be."""
        if self.outer is None:
            return None
        outer, own = self.outer, self.settings(fluid)
        if own.depth < 4.0 * outer.spacing:
            text = f"is {outer.spacing:g} m, allowed: up to a quarter of the depth of both, {0.25 * own.depth:g} m"
            raise ValueError(f"window: outer: spacing {text}")
        try:
            found = _settings(outer.size, own.depth, outer.spacing, None, fluid)
        except ValueError as error:
            raise ValueError(str(error).replace("window: ", "window: outer: ")) from error
        middle = [side - 2.0 * found.width for side in found.sides]
        if any(side > around for side, around in zip(own.sides, middle, strict=True)):
            text = " by ".join(f"{side:g}" for side in middle)
            raise ValueError(f"window: outer.size leaves {text} m between its rims, allowed: the window's size or more")
        if outer.spacing < own.spacing:
            text = f"is {outer.spacing:g} m, allowed: {own.spacing:g} m, the window's, or more"
            raise ValueError(f"window: outer.spacing {text}")
        return found

    def problems(self) -> Iterator[Problem]:
        """Yield a spacing that cannot be."""
        if isinstance(self.spacing, float) and not (math.isfinite(self.spacing) and self.spacing > 0.0):
            yield Problem("spacing", f'is {self.spacing} m, allowed: "live", "fine", or above 0')

    def problems_with(self, fluid: FluidSettings) -> Iterator[Problem]:
        """Yield what is wrong with the window for these particles; one that `spacing` will size is looked at when it is."""
        if self.spacing is not None and (isinstance(self.spacing, str) or self.size is None or self.depth is None):
            return
        try:
            self.boxes(fluid)
        except ValueError as error:
            yield problem_of(error)


def problem_of(error: ValueError) -> Problem:
    """Tell what cannot be, at the window or at its outer one."""
    text = str(error).removeprefix("window: ")
    return Problem("outer", text.removeprefix("outer: ")) if text.startswith("outer: ") else Problem("", text)


def _settings(size: Point2, depth: float, spacing: float, rim: float | None, fluid: FluidSettings) -> WindowSettings:
    """Return the description of a box of particles as [fluid] has them; ValueError for what cannot be."""
    return WindowSettings(
        size=size,
        depth=depth,
        spacing=spacing,
        rim=rim,
        sleep_speed=fluid.sleep_speed,
        dimension=fluid.dimension,
        solver={name: getattr(fluid, name) for name in SOLVER_OPTIONS},
    )

"""Boom classes by size, with the speeds up to which they are used.

The skirts, freeboards and speeds of the harbour classes, and the ranges of the sea-going classes, follow manufacturers' practice.
Buoyancy-to-weight ratios in practice lie between 5:1 and 52:1, and 10:1 or more is advised at sea. `maximum_speed` is the speed that
the boom withstands. It holds oil only up to about 0.7 knots normal to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from scipy.constants import inch, knot

from booms.boom import Boom, BoomDesign
from oilsim.physical_constants import SEA_WATER_DENSITY


@dataclass(frozen=True, kw_only=True)
class BoomClass:
    """A size of boom: skirt_depth, freeboard, skirt_thickness [m], buoyancy_to_weight [-], maximum_speed [m/s]."""

    name: str
    skirt_depth: float
    freeboard: float
    buoyancy_to_weight: float
    maximum_speed: float
    skirt_thickness: float = 0.005

    def boom(
        self, length: float, segment_count: int, *, scale: float = 1.0, water_density: float = SEA_WATER_DENSITY
    ) -> Boom:
        """Design a boom of this class, `length` [m] long; `scale` multiplies the section (1 / 4 for a quarter-scale model)."""
        return BoomDesign(
            length=length,
            segment_count=segment_count,
            skirt_depth=scale * self.skirt_depth,
            freeboard=scale * self.freeboard,
            buoyancy_to_weight=self.buoyancy_to_weight,
            skirt_thickness=scale * self.skirt_thickness,
            water_density=water_density,
        ).boom()

    def maximum_speed_at(self, scale: float) -> float:
        """Return the highest speed [m/s] at a model scale; equal Froude numbers V / sqrt(g depth) make V grow with sqrt(scale)."""
        return self.maximum_speed * scale**0.5


BOOM_CLASSES: Mapping[str, BoomClass] = MappingProxyType(
    {
        entry.name: entry
        for entry in (
            BoomClass(
                name="harbour-light",
                skirt_depth=8 * inch,
                freeboard=4 * inch,
                buoyancy_to_weight=5.0,
                maximum_speed=1.0 * knot,
            ),
            BoomClass(
                name="harbour",
                skirt_depth=16 * inch,
                freeboard=8 * inch,
                buoyancy_to_weight=7.0,
                maximum_speed=1.5 * knot,
            ),
            BoomClass(
                name="harbour-heavy",
                skirt_depth=24 * inch,
                freeboard=12 * inch,
                buoyancy_to_weight=8.0,
                maximum_speed=2.0 * knot,
            ),
            BoomClass(
                name="coastal", skirt_depth=0.6, freeboard=0.4, buoyancy_to_weight=10.0, maximum_speed=2.0 * knot
            ),
            BoomClass(
                name="sea-going", skirt_depth=1.1, freeboard=0.8, buoyancy_to_weight=12.0, maximum_speed=3.0 * knot
            ),
            BoomClass(
                name="sea-going-heavy",
                skirt_depth=1.5,
                freeboard=1.2,
                buoyancy_to_weight=15.0,
                maximum_speed=3.0 * knot,
            ),
        )
    }
)


def boom_class(name: str) -> BoomClass:
    """Return the class of that name; ValueError names the known classes."""
    if name not in BOOM_CLASSES:
        raise ValueError(f"boom class {name!r} is unknown, allowed: {', '.join(BOOM_CLASSES)}")
    return BOOM_CLASSES[name]

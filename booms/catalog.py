"""Boom classes by size, with the speeds up to which they are used.

Skirt and freeboard of the harbour classes in inches and their speeds, and the ranges of sea-going booms, are those of
manufacturers' practice; buoyancy-to-weight ratios lie in the range 5:1 to 52:1 met in practice, of which 10 or more is
advised at sea. Speeds are those the boom stands, not those at which it holds oil: that is about 0.7 knots normal to it.
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
    """A size of boom: skirt_depth, freeboard, skirt_thickness [m], buoyancy_to_weight, maximum_speed [m/s]."""

    name: str
    skirt_depth: float
    freeboard: float
    buoyancy_to_weight: float
    maximum_speed: float
    skirt_thickness: float = 0.005

    def boom(
        self, length: float, segment_count: int, *, scale: float = 1.0, water_density: float = SEA_WATER_DENSITY
    ) -> Boom:
        """A boom of this class, `length` [m] long; `scale` multiplies the section (1 / 4 for a quarter-scale model)."""
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
        """Highest speed [m/s] at a model scale: V / sqrt(g depth) is kept (Froude), so V goes with sqrt(scale)."""
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
    """The class of that name."""
    if name not in BOOM_CLASSES:
        raise ValueError(f"boom class {name!r} is unknown, allowed: {', '.join(BOOM_CLASSES)}")
    return BOOM_CLASSES[name]

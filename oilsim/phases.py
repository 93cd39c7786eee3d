"""The liquids of a run and their material constants."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any

EXPLICIT_UP_TO = (
    0.2  # nu dt / d^2: by Eq. 25 beside walls noise then neither grows nor fades, by the split scheme's weights at 0.26
)


def _is_finite(value: Any) -> bool:
    return isinstance(value, Real) and math.isfinite(value)


@dataclass(frozen=True, kw_only=True)
class Phase:
    """One liquid.

    rest_density       [kg/m3]  density at rest
    dynamic_viscosity  [Pa s]   Newtonian viscosity; 0 is an inviscid liquid
    adhesion           [J/m2]   work of adhesion to walls and bodies, the work that separates one square metre of contact
    """

    name: str
    rest_density: float
    dynamic_viscosity: float = 0.0
    adhesion: float = 0.0

    def __post_init__(self) -> None:
        if not (_is_finite(self.rest_density) and self.rest_density > 0.0):
            raise ValueError(f"phase {self.name!r}: rest_density is {self.rest_density!r} kg/m3, allowed: above 0")
        for key in ("dynamic_viscosity", "adhesion"):
            value = getattr(self, key)
            if not (_is_finite(value) and value >= 0.0):
                raise ValueError(f"phase {self.name!r}: {key} is {value!r}, allowed: 0 or more")

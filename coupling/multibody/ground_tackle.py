"""The parts of a mooring leg and its anchor, as plain records: a check of a file needs no kernel for them."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class LegPart:
    """A stretch of chain or rope: length [m], weight in water [N/m], axial stiffness EA [N], breaking load [N]."""

    length: float
    weight: float
    stiffness: float
    breaking_load: float = math.inf


@dataclass(frozen=True, kw_only=True)
class Anchor:
    """An anchor on the ground.

    place (3,) [m]; holding: power [N] under a level pull; angle_loss [1/rad] and friction [-]: see the module.
    """

    place: tuple[float, float, float]
    holding: float = math.inf
    angle_loss: float = 0.0
    friction: float = 0.0

    def power(self, horizontal: float, upward: float) -> float:
        """Return the holding power [N] while the leg pulls `horizontal` and `upward` [N] at the anchor."""
        if math.isinf(self.holding):
            return math.inf
        angle = math.atan2(upward, horizontal)
        return max(0.0, self.holding * (1.0 - self.angle_loss * angle) - self.friction * upward)

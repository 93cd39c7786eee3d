"""Parts of a boom that have tables of their own: pockets and reels."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from booms.fast_water import Pocket
from oilsim.core.quantity import quantity, quantity_of
from scenarios.schema.parsing.quantity_fields import Section


@dataclass(frozen=True, kw_only=True)
class PocketSettings(Section):
    """A covered bag at the middle of a boom, in which the water is slower (*modelled*).

    length       [m] of boom that it takes, at least a segment
    speed_ratio  of the water in it to that outside
    volume       [m3] of oil that it holds
    """

    length: float = quantity_of(Pocket, "length")
    speed_ratio: float = quantity_of(Pocket, "speed_ratio")
    volume: float = quantity_of(Pocket, "volume")

    def built(self) -> Pocket:
        """Return the pocket."""
        return Pocket(**asdict(self))


@dataclass(frozen=True, kw_only=True)
class ReelSettings(Section):
    """A reel on a quay, at the boom's first end, from which the boom runs out straight to its second end (*modelled*).

    stiffness    [N] axial stiffness EA of the line that stands for the brake; it holds the boom's inner end
    winch_speed  [m/s] at which the reel pays out, or takes in
    paid_out     [m] of boom outside the mouth that is ordered; without it, as laid: from the mouth to the second end
    """

    stiffness: float = quantity("N", default=4e5, above=0.0)
    winch_speed: float = quantity("m/s", default=0.4, above=0.0)
    paid_out: float | None = quantity("m", default=None, above=0.0)


def from_catalogue(value: Any) -> Any:
    """Return a value of the catalogue as a scenario has it: a pocket as its table."""
    return PocketSettings(**asdict(value)) if isinstance(value, Pocket) else value

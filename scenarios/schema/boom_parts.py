"""Parts of a boom that have tables of their own: bridles, nets, pockets and reels."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Literal

from booms.fast_water.net import Net
from booms.fast_water.pocket import Pocket
from oilsim.quantity import quantity, quantity_of
from scenarios.problems import Problem
from scenarios.schema.parsing.quantity_fields import Point2, Section


@dataclass(frozen=True, kw_only=True)
class NetSettings(Section):
    """A net below the float in the place of the skirt (*modelled*).

    solidity      share of the net's area that is twine
    mesh_opening  [m] between two twines of its square meshes
    """

    solidity: float = quantity_of(Net, "solidity")
    mesh_opening: float = quantity_of(Net, "mesh_opening")

    def built(self) -> Net:
        """Return the net."""
        return Net(**asdict(self))


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
    """Return a value of the catalogue as a scenario has it: nets and pockets as their tables."""
    if isinstance(value, Net):
        return NetSettings(**asdict(value))
    return PocketSettings(**asdict(value)) if isinstance(value, Pocket) else value


@dataclass(frozen=True, kw_only=True)
class BridleSettings(Section):
    """Two legs in which each elastic tow line of a boom ends; they meet in a junction, from which one line goes on.

    at      "boom": the legs come from the top and the foot of the boom's end; "vessel": from both sides of the vessel's tow point
    legs    [m] lengths of the legs, from the top and the foot, or from port and starboard
    spread  [m] at a vessel, between the two points that the legs come from, at most the beam
    """

    at: Literal["boom", "vessel"] = "boom"
    legs: Point2 = quantity("m", above=0.0)
    spread: float | None = quantity("m", default=None, above=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that a spread is given where it is free, and that legs from there can be taut together."""
        if self.at == "boom" and self.spread is not None:
            yield Problem("spread", 'is given, allowed: only with at = "vessel"; at a boom it is the height of the end')
        if self.at == "vessel":
            yield from (
                _legs_meet("legs", self.legs, self.spread)
                if self.spread
                else (Problem("spread", 'is missing, allowed: above 0 m with at = "vessel"'),)
            )

    def problems_at(self, height: float, tow_line: float) -> Iterator[Problem]:
        """Yield problems with a boom's end of that height [m], and with the length [m] from end to vessel."""
        if self.at == "boom":
            yield from _legs_meet("bridle.legs", self.legs, height)
        if max(self.legs) >= tow_line:
            yield Problem("bridle.legs", f"are {list(self.legs)} m, allowed: below tow_line = {tow_line:g} m")


def _legs_meet(path: str, legs: Point2, spread: float) -> Iterator[Problem]:
    """Yield a problem if legs [m] from points `spread` [m] apart cannot be taut together."""
    if not abs(legs[0] - legs[1]) < spread < sum(legs):
        text = f"are {list(legs)} m from points {spread:g} m apart, allowed: more than that together, and less than that in difference"
        yield Problem(path, text)

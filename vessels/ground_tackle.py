"""Ground tackle: how much anchors hold in which ground, and what chains and ropes weigh, give and bear.

Holding power of anchors that dig in is a multiple of their weight; that of a weight is its friction on the ground. All of these are
*modelled*: one number stands for a kind of anchor in a kind of ground, where tests of single drops differ by half and more (Chang 2003
measured 6 to 12 times the weight for Danforth anchors of 20 kg, and 8 to 17 times for 30 kg, besides drops that did not take hold).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from coupling.multibody.ground_tackle import Anchor, LegPart
from oilsim.core.physical_constants import GRAVITY
from oilsim.core.quantity import quantity, require

Ground = Literal["sand", "mud", "clay", "rock"]
AnchorKind = Literal["fluke", "stockless", "weight", "fixed"]
Material = Literal["chain", "wire", "polyester", "nylon", "polypropylene"]

# [1] holding power over weight of anchors that dig in; fluke: ITOPF Technical Information Paper 3, Danforth type of 15 to 35 kg, least of
# its table; stockless: UFC 4-159-03, table 5-4, movable fluke of 4.5 t in soft and hard soil, smaller ones hold more of their weight
HOLDING: Mapping[str, Mapping[str, float]] = {
    "fluke": {"mud": 13.0, "sand": 16.0, "clay": 20.0},
    "stockless": {"mud": 2.4, "sand": 4.4, "clay": 4.4},
}
# [1] friction of a weight on the ground; concrete on mud as soft clay, on sand, on stiff clay and rock: NAVFAC DM-7.2, table of
# interface friction, lower half of its ranges
FRICTION: Mapping[str, float] = {"mud": 0.3, "sand": 0.5, "clay": 0.4, "rock": 0.6}
# [1/rad] share of holding power lost by the angle of the pull at an anchor that digs in: a quarter at 5 degrees and half at 15 are the
# rule of seamanship; this straight line loses half at 15 and all at 30
ANGLE_LOSS = 0.5 / math.radians(15.0)
# [1] weight in water over that in air of concrete, 2400 kg/m3
CONCRETE_IN_WATER = 0.57


@dataclass(frozen=True, kw_only=True)
class Stuff:
    """Properties of chain or rope of diameter d [m]: mass in water over d^2 [kg/m3], EA over d^2 [Pa], breaking load over d^2 [Pa].

    For a chain d is that of its bar, and its breaking load falls a little with d.
    """

    mass_in_water: float
    stiffness: float
    strength: float
    strength_loss: float = 0.0


# Stud-less chain of grade 2: DNV-OS-E302, 13.7 d^2 (44 - 80 d) kN/m2. Wire of 6 x 19 with a fibre core, polyester and nylon of 8 strands,
# and polypropylene: as the tables of rope makers, collected in the manual of OrcaFlex (Orcina), "Line types". Polypropylene floats; its
# lift is left out.
STUFF: Mapping[str, Stuff] = {
    "chain": Stuff(mass_in_water=17.3e3, stiffness=8.54e10, strength=6.03e8, strength_loss=1.096e9),
    "wire": Stuff(mass_in_water=3.1e3, stiffness=3.67e10, strength=5.84e8),
    "polyester": Stuff(mass_in_water=200.0, stiffness=1.09e9, strength=1.70e8),
    "nylon": Stuff(mass_in_water=66.0, stiffness=1.18e8, strength=1.39e8),
    "polypropylene": Stuff(mass_in_water=0.0, stiffness=1.06e9, strength=1.06e8),
}


@dataclass(frozen=True, kw_only=True)
class Rope:
    """A length of chain or rope: length [m] and diameter [m], of a chain that of its bar; ValueError for ones that do not exist."""

    length: float = quantity("m", above=0.0, at_most=2000.0)
    diameter: float = quantity("m", at_least=0.004, at_most=0.15)

    def __post_init__(self) -> None:
        require("rope", Rope, vars(self))


@dataclass(frozen=True, kw_only=True)
class AnchorSize:
    """Mass [kg] of an anchor or weight; ValueError for one that is not above 0."""

    mass: float = quantity("kg", above=0.0, at_most=50000.0)

    def __post_init__(self) -> None:
        require("anchor", AnchorSize, vars(self))


def leg_part(material: Material, rope: Rope, breaking_load: float | None = None) -> LegPart:
    """Return the part of a mooring leg that a rope is; `breaking_load` [N] replaces that of new rope."""
    stuff, square = STUFF[material], rope.diameter**2
    strength = square * (stuff.strength - stuff.strength_loss * rope.diameter)
    return LegPart(
        length=rope.length,
        weight=stuff.mass_in_water * square * GRAVITY,
        stiffness=stuff.stiffness * square,
        breaking_load=strength if breaking_load is None else breaking_load,
    )


def laid_anchor(
    kind: AnchorKind, mass: float, ground: Ground, place: tuple[float, float, float], holding: float | None = None
) -> Anchor:
    """Return an anchor of `mass` [kg] at `place` (3,) [m] on the ground; `holding` [N], as tested, replaces the table's.

    A fixed one (a pile, a rock bolt, a ring ashore) holds `holding`, or anything. Raises ValueError for an anchor that finds no hold.
    """
    if kind == "fixed":
        return Anchor(place=place, holding=math.inf if holding is None else holding)
    if kind == "weight":
        friction = FRICTION[ground]
        stated = friction * CONCRETE_IN_WATER * mass * GRAVITY
        return Anchor(place=place, holding=stated if holding is None else holding, friction=friction)
    if ground not in HOLDING[kind] and holding is None:
        raise ValueError(f"an anchor of the kind {kind!r} finds no hold in {ground}")
    stated = 0.0 if holding is not None else HOLDING[kind][ground] * mass * GRAVITY
    return Anchor(place=place, holding=stated if holding is None else holding, angle_loss=ANGLE_LOSS)

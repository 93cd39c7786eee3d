"""The solid bodies of a scenario: shape, mass, pose and motion.

A body's `position` is that of its shape's origin: the middle of a primitive, or the origin of a mesh file. Its `rotation` is roll, pitch
and yaw [rad] about the fixed x, y and z axes, in this order.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar

from oilsim.core.phases import Wetting
from oilsim.core.quantity import quantity, quantity_of
from scenarios.schema.parsing.quantity_fields import Point2, Section, Vector
from scenarios.schema.parsing.relations import Relation, at_most_one, directed
from scenarios.text.problems import Problem

FASTEST = 90.0  # [m/s] a component of a body at the start: at 100 a run is taken for blown up, and a body may fall


@dataclass(frozen=True, kw_only=True)
class Free(Section):
    """The body moves freely under forces; it needs a mass or a density."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "free")


@dataclass(frozen=True, kw_only=True)
class Fixed(Section):
    """The body never moves."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "fixed")


@dataclass(frozen=True, kw_only=True)
class SineMotion(Section):
    """A wave maker's stroke along `direction`: amplitude sin(2 pi t / period) [m].

    rise_time  [s] in which the amplitude grows smoothly from 0
    """

    TAG: ClassVar[tuple[str, str]] = ("kind", "sine")
    RELATIONS: ClassVar[tuple[Relation, ...]] = (directed,)
    direction: Vector = quantity("")
    amplitude: float = quantity("m", above=0.0)
    period: float = quantity("s", above=0.0)
    rise_time: float = quantity("s", default=0.0, at_least=0.0)


Motion = Free | Fixed | SineMotion


@dataclass(frozen=True, kw_only=True)
class BodySettings(Section):
    """Settings that every body has, whatever its shape.

    mass, density     [kg] or [kg/m3]; a free body needs one of them
    velocity          [m/s] of a free body at the start
    contact           whether it collides with other bodies and the tank
    no_slip           whether liquids stick to its surface
    contact_angle     [deg] at which oil meets it in water, through the oil; it needs `fluid.interfacial_tension`
    color             red, green, blue, opacity, each 0 to 255
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (at_most_one("mass", "density"),)
    position: Vector = quantity("m")
    rotation: Vector = quantity("rad", default=(0.0, 0.0, 0.0))
    motion: Motion = field(default_factory=Free)
    mass: float | None = quantity("kg", default=None, above=0.0)
    density: float | None = quantity("kg/m3", default=None, above=0.0)
    velocity: Vector = quantity("m/s", default=(0.0, 0.0, 0.0), at_least=-FASTEST, at_most=FASTEST)
    contact: bool = True
    no_slip: bool = False
    contact_angle: float = quantity_of(Wetting, "contact_angle")
    color: tuple[int, int, int, int] | None = quantity("", default=None, at_least=0, at_most=255, whole=True)

    def problems(self) -> Iterator[Problem]:
        """Check that a free body has a mass, and that only a free body has a velocity."""
        if isinstance(self.motion, Free) and self.mass is None and self.density is None:
            yield Problem("density", "is missing, allowed: mass or density, one of which a free body needs")
        if any(self.velocity) and not isinstance(self.motion, Free):
            yield Problem("velocity", "is given, allowed: only for a free body")


@dataclass(frozen=True, kw_only=True)
class MeshBody(BodySettings):
    """A closed surface from a file (STL, OBJ, PLY, GLB); a relative path starts at the scenario file's folder.

    Parts of the file that overlap or touch are one solid. Parts that are wound inwards are turned, unless they lie in another part: those
    are sealed hollows, which hold no mass and stay dry. Density is that of the matter between the
    surfaces. `oilsim check` and a run tell what was mended; holes, sheets without thickness and surfaces that cross themselves are refused.

    scale  metres per unit of the file
    hull   whether it is a ship's hull, drawn upright with its bow along x: without particles, water along it makes friction alone
    """

    TAG: ClassVar[tuple[str, str]] = ("shape", "mesh")
    file: str
    scale: float = quantity("m per unit", default=1.0, above=0.0)
    hull: bool = False


@dataclass(frozen=True, kw_only=True)
class BoxBody(BodySettings):
    """A box with edges `size` (3,) [m]."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "box")
    size: Vector = quantity("m", above=0.0)


def crosses_itself(outline: tuple[Point2, ...]) -> bool:
    """Tell whether two sides of a closed polygon that are no neighbours meet, or two neighbours fold back."""

    def turn(p: Point2, q: Point2, r: Point2) -> float:
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    def within(p: Point2, q: Point2, r: Point2) -> bool:  # r, which is in line with p and q, between them
        return min(p[0], q[0]) <= r[0] <= max(p[0], q[0]) and min(p[1], q[1]) <= r[1] <= max(p[1], q[1])

    def meet(a: Point2, b: Point2, c: Point2, d: Point2) -> bool:
        one, two, three, four = turn(a, b, c), turn(a, b, d), turn(c, d, a), turn(c, d, b)
        touching = ((one, a, b, c), (two, a, b, d), (three, c, d, a), (four, c, d, b))
        return (one * two < 0.0 and three * four < 0.0) or any(t == 0.0 and within(p, q, r) for t, p, q, r in touching)

    sides = list(pairwise([*outline, outline[0]]))
    count = len(sides)
    apart = ((i, j) for i in range(count) for j in range(i + 2, count) if (i, j) != (0, count - 1))
    folded = (
        (turn(a, b, c) == 0.0 and within(a, b, c)) or a == b
        for (a, b), (_, c) in zip(sides, sides[1:] + sides[:1], strict=True)
    )
    return any(meet(*sides[i], *sides[j]) for i, j in apart) or any(folded)


@dataclass(frozen=True, kw_only=True)
class CylinderBody(BodySettings):
    """A cylinder of `radius` and `height` [m] with its axis along its own z."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "cylinder")
    radius: float = quantity("m", above=0.0)
    height: float = quantity("m", above=0.0)


@dataclass(frozen=True, kw_only=True)
class SphereBody(BodySettings):
    """A ball of `radius` [m]."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "sphere")
    radius: float = quantity("m", above=0.0)


@dataclass(frozen=True, kw_only=True)
class RockBody(BodySettings):
    """A weathered boulder: an ellipsoid of extents `size` (3,) [m] with smooth random bumps.

    roughness  height of the bumps over the local radius
    seed       chooses the boulder
    """

    TAG: ClassVar[tuple[str, str]] = ("shape", "rock")
    size: Vector = quantity("m", above=0.0)
    roughness: float = quantity("", default=0.15, at_least=0.0, at_most=0.4)
    seed: int = quantity("", default=1, at_least=0, whole=True)


Body = MeshBody | BoxBody | CylinderBody | SphereBody | RockBody

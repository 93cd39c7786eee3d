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
from scenarios.schema.parsing.quantity_fields import Point2, Section, Vector, directed, exactly_one
from scenarios.text.problems import Problem
from vessels.hull_size import HullSize

FASTEST = 90.0  # [m/s] a component of a body at the start: at 100 a run is taken for blown up, and a body may fall


@dataclass(frozen=True, kw_only=True)
class Free(Section):
    """The body moves freely under forces; it needs a mass or a density.

    release  [s] until which it is held where it starts
    """

    TAG: ClassVar[tuple[str, str]] = ("kind", "free")
    release: float = quantity("s", default=0.0, at_least=0.0)


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
    direction: Vector = quantity("")
    amplitude: float = quantity("m", above=0.0)
    period: float = quantity("s", above=0.0)
    rise_time: float = quantity("s", default=0.0, at_least=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that the stroke has a direction."""
        yield from directed("direction", self.direction)


@dataclass(frozen=True, kw_only=True)
class RampMotion(Section):
    """A towed plate's motion: from rest to `velocity` within `rise_time`, then steady, from `start` until `end`.

    velocity  (3,) [m/s]
    end       [s] at which the body stops at once; without it, the motion goes on
    """

    TAG: ClassVar[tuple[str, str]] = ("kind", "ramp")
    velocity: Vector = quantity("m/s")
    start: float = quantity("s", default=0.0, at_least=0.0)
    rise_time: float = quantity("s", default=0.0, at_least=0.0)
    end: float | None = quantity("s", default=None, above=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that the motion ends after its rise."""
        if self.end is not None and self.end <= self.start + self.rise_time:
            risen = self.start + self.rise_time
            yield Problem("end", f"is {self.end:g}, allowed: above start + rise_time = {risen:g} s")


@dataclass(frozen=True, kw_only=True)
class TableMotion(Section):
    """A measured motion: displacements (n, 3) [m] at times (n,) [s], linear in between, at rest before and after."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "table")
    time: tuple[float, ...] = quantity("s", at_least=0.0)
    displacement: tuple[Vector, ...] = quantity("m")

    def problems(self) -> Iterator[Problem]:
        """Check that times increase, and that each has a displacement."""
        if len(self.time) < 2:
            yield Problem("time", f"has {len(self.time)} times, allowed: 2 or more")
        if any(later <= earlier for earlier, later in pairwise(self.time)):
            yield Problem("time", "does not increase, allowed: each time above the one before")
        if len(self.displacement) != len(self.time):
            count = len(self.displacement)
            yield Problem("displacement", f"has {count} displacements, allowed: {len(self.time)}, one for each time")


@dataclass(frozen=True, kw_only=True)
class RotationMotion(Section):
    """A turn about an axis: steady at `rate`, as of a rotor, or to and fro by `amplitude` sin(2 pi t / period), as of a flap in a flume.

    axis       direction of the axis; the turn is counter-clockwise seen from its tip
    center     [m] a point of the axis in the world; the default is the body's centre of mass
    rate       [rad/s] of a steady turn
    amplitude  [rad] and
    period     [s] of a swing
    start      [s] before which the body rests
    rise_time  [s] in which the rate, or the amplitude, grows smoothly from 0
    """

    TAG: ClassVar[tuple[str, str]] = ("kind", "rotation")
    axis: Vector = quantity("")
    center: Vector | None = quantity("m", default=None)
    rate: float | None = quantity("rad/s", default=None)
    amplitude: float | None = quantity("rad", default=None, above=0.0)
    period: float | None = quantity("s", default=None, above=0.0)
    start: float = quantity("s", default=0.0, at_least=0.0)
    rise_time: float = quantity("s", default=0.0, at_least=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that the axis has a direction, and that the turn is either steady or a swing."""
        yield from directed("axis", self.axis)
        yield from exactly_one(self, "rate", "amplitude")
        if (self.amplitude is None) != (self.period is None):
            missing = "period" if self.period is None else "amplitude"
            yield Problem(missing, "is missing, allowed: amplitude and period together, for a swing")


Motion = Free | Fixed | SineMotion | RampMotion | TableMotion | RotationMotion


@dataclass(frozen=True, kw_only=True)
class BodySettings(Section):
    """Settings that every body has, whatever its shape.

    mass, density     [kg] or [kg/m3]; a free body needs one of them
    velocity          [m/s] and
    angular_velocity  [rad/s] of a free body at the start
    contact           whether it collides with other bodies and the tank
    no_slip           whether liquids stick to its surface
    contact_angle     [deg] at which oil meets it in water, through the oil; it needs `fluid.interfacial_tension`
    color             red, green, blue, opacity, each 0 to 255
    """

    position: Vector = quantity("m")
    rotation: Vector = quantity("rad", default=(0.0, 0.0, 0.0))
    motion: Motion = field(default_factory=Free)
    mass: float | None = quantity("kg", default=None, above=0.0)
    density: float | None = quantity("kg/m3", default=None, above=0.0)
    velocity: Vector = quantity("m/s", default=(0.0, 0.0, 0.0), at_least=-FASTEST, at_most=FASTEST)
    angular_velocity: Vector = quantity("rad/s", default=(0.0, 0.0, 0.0))
    contact: bool = True
    no_slip: bool = False
    contact_angle: float = quantity_of(Wetting, "contact_angle")
    color: tuple[int, int, int, int] | None = quantity("", default=None, at_least=0, at_most=255, whole=True)

    def problems(self) -> Iterator[Problem]:
        """Check that a free body has one mass, and that only a free body has a velocity."""
        if self.mass is not None and self.density is not None:
            yield Problem("density", "is given beside mass, allowed: one of mass or density")
        if isinstance(self.motion, Free) and self.mass is None and self.density is None:
            yield Problem("density", "is missing, allowed: mass or density, one of which a free body needs")
        if isinstance(self.motion, Free) and self.motion.release == 0.0:
            return
        for name in ("velocity", "angular_velocity"):
            if any(getattr(self, name)):
                yield Problem(name, "is given, allowed: only for a body that is free from the start")


@dataclass(frozen=True, kw_only=True)
class MeshBody(BodySettings):
    """A closed surface from a file (STL, OBJ, PLY, GLB); a relative path starts at the scenario file's folder.

    Parts of the file that overlap or touch are one solid. Parts that are wound inwards are turned, unless they lie in another part: those
    are sealed hollows, which hold no mass and stay dry, unless a fill says `inside`. Density is that of the matter between the
    surfaces. `oilsim check` and a run tell what was mended; holes, sheets without thickness and surfaces that cross themselves are refused.

    scale  metres per unit of the file
    """

    TAG: ClassVar[tuple[str, str]] = ("shape", "mesh")
    file: str
    scale: float = quantity("m per unit", default=1.0, above=0.0)


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
class PolygonBody(BodySettings):
    """A prism over a polygon: `outline` corners (x, z) [m], three or more in order, and `width` [m] along y; such as a wedge or a slope.

    The outline may be concave, but must not cross itself. The origin of the shape is that of the outline, in the middle of the width.
    """

    TAG: ClassVar[tuple[str, str]] = ("shape", "polygon")
    outline: tuple[Point2, ...] = quantity("m")
    width: float = quantity("m", above=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that the outline has an area."""
        yield from super().problems()
        if len(self.outline) < 3:
            yield Problem("outline", f"has {len(self.outline)} corners, allowed: 3 or more")
            return
        x, z = zip(*self.outline, strict=True)
        area = 0.5 * sum(x[k - 1] * z[k] - x[k] * z[k - 1] for k in range(len(x)))
        if abs(area) <= 1e-9 * (max(x) - min(x)) * (max(z) - min(z)):
            yield Problem("outline", "has no area, allowed: corners that do not lie on one line")
        elif crosses_itself(self.outline):
            yield Problem("outline", "crosses or touches itself, allowed: a simple polygon")


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
class CapsuleBody(BodySettings):
    """A cylinder of `radius` and `height` [m] along its own z, with half balls on both ends."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "capsule")
    radius: float = quantity("m", above=0.0)
    height: float = quantity("m", above=0.0)


@dataclass(frozen=True, kw_only=True)
class WigleyBody(BodySettings):
    """Wigley's parabolic hull, with its origin at midships in the design waterline and x forward; lengths in m."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "wigley")
    length: float = quantity_of(HullSize, "length")
    beam: float = quantity_of(HullSize, "beam")
    draft: float = quantity_of(HullSize, "draft")
    depth: float = quantity_of(HullSize, "depth")

    def problems(self) -> Iterator[Problem]:
        """Check that the deck lies above the waterline."""
        yield from super().problems()
        if self.depth <= self.draft:
            yield Problem("depth", f"is {self.depth:g}, allowed: above draft = {self.draft:g} m")


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


Body = MeshBody | BoxBody | PolygonBody | CylinderBody | SphereBody | CapsuleBody | WigleyBody | RockBody

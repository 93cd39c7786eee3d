"""A boom: a chain of equal rigid segments, each a float over a skirt with ballast at its foot.

Section, in the design frame of a segment (x along the boom, z up from the design waterline): the float from
-float_draft to freeboard, the skirt plate from there down to -skirt_depth.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from oilsim.physical_constants import SEA_WATER_DENSITY
from oilsim.quantity import quantity, quantity_of, require

Array = NDArray[np.float64]
FloatShape = Literal["cylinder", "box"]

END_TAPER = 0.01  # of a segment's length


@dataclass(frozen=True, kw_only=True)
class Boom:
    """Dimensions of a boom; all lengths in m.

    length, segment_count: the boom and how many rigid segments stand for it; skirt_depth: skirt below the waterline;
    freeboard: above it; float_width, float_draft: breadth of the float and how deep it sits; skirt_thickness: as it is
    simulated; design_skirt_thickness: as it is built (see `resolved_by`); float_shape: "cylinder" is round below and
    above (an ellipse if its width is not its height), "box" is square. ballast_fraction: part of the mass that is a
    chain along the skirt's foot. joint_height: where neighbours and tow lines are joined, above the waterline; by
    default at half the skirt's depth, where the water's resistance attacks, so that towing does not heel the skirt.
    maximum_turn [rad]: largest angle between neighbours at which a boom is laid.
    """

    length: float = quantity("m", above=0.0)
    segment_count: int = quantity("", at_least=1, at_most=500, whole=True)
    skirt_depth: float = quantity("m", above=0.0)
    freeboard: float = quantity("m", above=0.0)
    float_width: float = quantity("m", above=0.0)
    float_draft: float = quantity("m", above=0.0)
    skirt_thickness: float = quantity("m", above=0.0)
    design_skirt_thickness: float = quantity("m", above=0.0)
    float_shape: FloatShape = "cylinder"
    ballast_fraction: float = quantity("", default=0.35, at_least=0.0, below=1.0)
    joint_height: float | None = quantity("m", default=None)
    maximum_turn: float = quantity("rad", default=math.radians(75.0), above=0.0, below=math.pi)
    water_density: float = quantity("kg/m3", default=SEA_WATER_DENSITY, above=0.0)

    def __post_init__(self) -> None:
        require("boom", Boom, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        """Say which dimensions do not go together."""
        if self.float_draft >= self.skirt_depth:
            yield f"float_draft is {self.float_draft:g} m, allowed: below skirt_depth = {self.skirt_depth:g} m"
        if self.skirt_thickness > self.float_width:
            yield f"skirt_thickness is {self.skirt_thickness:g} m, allowed: up to float_width = {self.float_width:g} m"

    @property
    def segment_length(self) -> float:
        """From joint to joint [m]."""
        return self.length / self.segment_count

    @property
    def taper(self) -> float:
        """Length [m] over which each end narrows to its edge, a hundredth of the segment: nearly flat ends.

        A skirt is one sheet. Neighbours abut when the boom is straight and overlap where it bends; ends pointed so as never to
        overlap leave wedges as wide as the float, and oil leaks through them before it goes under the skirt.
        """
        return END_TAPER * self.segment_length

    @property
    def height_of_joints(self) -> float:
        """Height [m] of the joints above the design waterline."""
        return -0.5 * self.skirt_depth if self.joint_height is None else self.joint_height

    @property
    def is_thickened(self) -> bool:
        """Whether the skirt is simulated thicker than it is built."""
        return self.skirt_thickness > self.design_skirt_thickness

    def profile(self) -> Array:
        """Starboard half of the section, from the top down: (K, 2) of half breadth and height [m]."""
        bottom = np.array([[0.5 * self.skirt_thickness, -self.skirt_depth]])
        return np.concatenate([self._float_profile(), bottom])

    def _float_profile(self) -> Array:
        """Half breadth and height of the float from its top to where the skirt leaves it."""
        half_width, half_skirt = 0.5 * self.float_width, 0.5 * self.skirt_thickness
        if self.float_shape == "box":
            low = -self.float_draft
            return np.array([[half_width, self.freeboard], [half_width, low], [half_skirt, low]])
        half_height = 0.5 * (self.freeboard + self.float_draft)
        last = math.pi - math.asin(min(1.0, half_skirt / half_width))
        angle = np.linspace(0.0, last, 13)
        breadth = half_width * np.sin(angle)
        return np.stack([breadth, self.freeboard - half_height * (1.0 - np.cos(angle))], axis=1)

    def resolved_by(self, particle_spacing: float) -> Boom:
        """The boom that a fluid of this particle spacing [m] can feel: skirt and float at least one spacing thick.

        Depth, freeboard and the waterline stay as built: the mass that the thicker skirt displaces is added to the
        ballast at the foot, b' = 1 - (1 - b) m / m', and buoyancy_to_weight falls. `is_thickened` and
        `design_skirt_thickness` tell.
        """
        thickness = max(self.skirt_thickness, minimum_thickness(particle_spacing))
        thick = replace(self, skirt_thickness=thickness, float_width=max(self.float_width, thickness))
        mass_ratio = section_area(self, 0.0) / section_area(thick, 0.0)
        return replace(thick, ballast_fraction=1.0 - (1.0 - self.ballast_fraction) * mass_ratio)


def minimum_thickness(particle_spacing: float) -> float:
    """Thinnest plate [m] that keeps the fluid's two sides apart: one particle spacing."""
    return particle_spacing


def section_area(boom: Boom, height: float) -> float:
    """Area [m2] of the section below `height` [m], by trapezoids between the points of the profile (exact)."""
    profile = boom.profile()[::-1]
    top = float(np.clip(height, profile[0, 1], profile[-1, 1]))
    inside = profile[:, 1] < top
    breadth = float(np.interp(top, profile[:, 1], profile[:, 0]))
    points = np.concatenate([profile[inside], [[breadth, top]]])
    return float(2.0 * np.trapezoid(points[:, 0], points[:, 1]))


def section_buoyancy_to_weight(boom: Boom) -> float:
    """Gross buoyancy over weight of the prismatic section: area of all of it / area below the waterline."""
    return section_area(boom, boom.freeboard) / section_area(boom, 0.0)


@dataclass(frozen=True, kw_only=True)
class BoomDesign:
    """A boom as it is ordered: its size and its reserve buoyancy, from which `boom` sizes the float.

    length, segment_count, skirt_depth, freeboard, float_shape, ballast_fraction, water_density: see `Boom`;
    buoyancy_to_weight: gross, volume of the whole boom over the volume that displaces its weight; skirt_thickness [m]: as built.
    """

    length: float = quantity_of(Boom, "length")
    segment_count: int = quantity_of(Boom, "segment_count")
    skirt_depth: float = quantity_of(Boom, "skirt_depth")
    freeboard: float = quantity_of(Boom, "freeboard")
    buoyancy_to_weight: float = quantity("", above=1.0)
    skirt_thickness: float = quantity_of(Boom, "design_skirt_thickness")
    float_shape: FloatShape = "cylinder"
    ballast_fraction: float = quantity_of(Boom, "ballast_fraction")
    water_density: float = quantity_of(Boom, "water_density")

    def __post_init__(self) -> None:
        require("boom", BoomDesign, vars(self))

    def boom(self) -> Boom:
        """Return the boom whose float, as wide as high, gives it the buoyancy that is asked for.

        The float's draft e solves A(all) / A(below the waterline) = buoyancy_to_weight, with the float's height and width
        freeboard + e. The ratio falls from a largest value, at which the skirt alone displaces the weight, as e grows.
        ValueError for a ratio that no float of this freeboard and skirt has.
        """
        smallest, largest = 1e-3 * self.freeboard, 0.95 * self.skirt_depth
        highest, lowest = (section_buoyancy_to_weight(self._with_draft(e)) for e in (smallest, largest))
        wanted = self.buoyancy_to_weight
        if not lowest <= wanted <= highest:
            raise ValueError(
                f"buoyancy_to_weight is {wanted:g}, allowed: {lowest:.3g} to {highest:.3g} for this freeboard"
                f" ({self.freeboard:g} m), skirt depth ({self.skirt_depth:g} m) and skirt thickness ({self.skirt_thickness:g} m)"
            )
        draft = _bisect(lambda e: wanted - section_buoyancy_to_weight(self._with_draft(e)), smallest, largest)
        return replace(self._with_draft(draft), length=self.length, segment_count=self.segment_count)

    def _with_draft(self, float_draft: float) -> Boom:
        """Return a boom of this section with a float of that draft [m], long enough for any that is tried."""
        return Boom(
            length=100.0 * (self.freeboard + self.skirt_depth),
            segment_count=1,
            skirt_depth=self.skirt_depth,
            freeboard=self.freeboard,
            float_width=self.freeboard + float_draft,
            float_draft=float_draft,
            skirt_thickness=self.skirt_thickness,
            design_skirt_thickness=self.skirt_thickness,
            float_shape=self.float_shape,
            ballast_fraction=self.ballast_fraction,
            water_density=self.water_density,
        )


def _bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the root of an increasing function between low and high."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        if function(middle) < 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)

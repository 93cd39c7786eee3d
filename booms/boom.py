"""A boom is a chain of equal rigid segments; each has a float, and below it a skirt with ballast at its foot.

The section is given in the design frame of a segment (x along the boom, z up from the design waterline): the float reaches from
-float_draft to freeboard, and the skirt plate from there down to -skirt_depth.

A boom for fast water has a pocket: a covered bag at the apex, in which the water is slower than the tow (*modelled*). Two guide booms lead
the oil into it. A net bottom and the pocket's outlets slow the water in it to a share of the speed outside, so every closure acts there at
the slower speed normal to the segments. Its cover keeps waves from carrying oil over it. Oil beyond its volume leaves through the outlets
at the bottom, in the time in which the slowed water passes the pocket. The water around the guides is that of any boom, and the pocket is
dragged as a skirt is: a bag that slows the water to 0.2 has a drag coefficient of 1.7 by the law of screens (Loeland 1991), a skirt 1.88.

The catalogue of classes and products by name is `catalogue.toml`; its `maximum_speed_kn` is the speed that a boom withstands. It holds oil
only up to about 0.7 knots normal to it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

import numpy as np

from oilsim.backend.arrays import Array
from oilsim.core.catalogue import CatalogueEntry, read_catalogue
from oilsim.core.physical_constants import SEA_WATER_DENSITY
from oilsim.core.quantity import quantity, quantity_of, require


@dataclass(frozen=True, kw_only=True)
class Pocket:
    """A covered bag at the middle of a boom, in which the water is slower (*modelled*).

    length       [m] of boom that it takes, at least a segment
    speed_ratio  of the water in it to that outside
    volume       [m3] of oil that it holds
    Raises ValueError for values out of range.
    """

    length: float = quantity("m", above=0.0)
    speed_ratio: float = quantity("", above=0.0, below=1.0)
    volume: float = quantity("m3", above=0.0)

    def __post_init__(self) -> None:
        require("pocket", Pocket, vars(self))

    def segments(self, boom_length: float, count: int) -> slice:
        """Return the segments of a boom that are the pocket: those whose middles lie within it, an empty slice if it has none.

        boom_length [m]; count: of the boom's segments.
        """
        middles = ((np.arange(count) + 0.5) / count - 0.5) * boom_length
        inside = np.flatnonzero(np.abs(middles) <= 0.5 * self.length * (1.0 + 1e-9))
        return slice(int(inside[0]), int(inside[-1]) + 1) if len(inside) else slice(0, 0)

    def flow_shares(self, boom_length: float, count: int) -> Array:
        """Return the share (count,) [-] of the water's speed at each segment of a boom; arguments as of `segments`."""
        shares = np.ones(count)
        shares[self.segments(boom_length, count)] = self.speed_ratio
        return shares

    def overflow(self, held: float, speed: float) -> float:
        """Compute the oil [m3/s] that leaves an overfull pocket, (V - V_pocket) u / length; 0 while it is not full.

        held V [m3] in the pocket; speed u [m/s] of the water in it.
        """
        return max(0.0, held - self.volume) * max(0.0, speed) / self.length


FloatShape = Literal["cylinder", "box"]

END_TAPER = 0.01  # of a segment's length
# [N/m] shear stiffness of coated fabric in its plane; assumed; polyester coated with PVC, order of magnitude 5 to 50 kN/m
FABRIC_SHEAR = 10_000.0
# [s] relaxation time of coated fabric; assumed; a loss factor of 0.1 at the 5 rad/s of a rolling boom
FABRIC_RELAXATION = 0.02


@dataclass(frozen=True, kw_only=True)
class Boom:
    """The dimensions of a boom; all lengths in m.

    length, segment_count   length of the boom, and the number of rigid segments it is divided into
    skirt_depth, freeboard  extent of the section below and above the design waterline
    float_width, float_draft  breadth of the float, and its depth below the waterline
    skirt_thickness         thickness of the skirt in the simulation
    design_skirt_thickness  thickness of the skirt as built; see `resolved_by`
    float_shape             "cylinder" is round (an ellipse if width and height differ), "box" is rectangular
    ballast_fraction        fraction of the mass that is a chain along the skirt's foot
    maximum_turn            largest angle [rad] between neighbours when the boom is laid out
    water_density           density [kg/m3] of the water in which the boom floats at its design waterline
    pocket                  of a boom for fast water, see `Pocket`

    Raises ValueError for dimensions that no boom can have.
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
    maximum_turn: float = quantity("rad", default=math.radians(75.0), above=0.0, below=math.pi)
    water_density: float = quantity("kg/m3", default=SEA_WATER_DENSITY, above=0.0)
    pocket: Pocket | None = None

    def __post_init__(self) -> None:
        require("boom", Boom, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        """Say which dimensions do not go together."""
        if self.float_draft >= self.skirt_depth:
            yield f"float_draft is {self.float_draft:g} m, allowed: below skirt_depth = {self.skirt_depth:g} m"
        if self.skirt_thickness > self.float_width:
            yield f"skirt_thickness is {self.skirt_thickness:g} m, allowed: up to float_width = {self.float_width:g} m"
        if self.pocket is not None and not self.flow_shares.min() < 1.0:
            yield f"pocket.length is {self.pocket.length:g} m, allowed: {self.segment_length:g} m or more, a segment"

    @property
    def segment_length(self) -> float:
        """Length of a segment from joint to joint [m]."""
        return self.length / self.segment_count

    @property
    def flow_shares(self) -> Array:
        """Share (segment_count,) [-] of the water's speed at each segment: 1, less in a pocket."""
        shares = np.ones(self.segment_count)
        return shares if self.pocket is None else self.pocket.flow_shares(self.length, self.segment_count)

    @property
    def twisting_stiffness(self) -> float:
        """Stiffness [N m/rad] with which the fabric resists that a segment rolls against the next one.

        Bredt's formula for a closed tube, the float's cover: 4 A^2 G t / (s L), with the section A, its girth s, the fabric's shear
        stiffness G t (`FABRIC_SHEAR`), and L from the middle of one segment to that of the next. The flat skirt adds nothing.
        """
        width, height = self.float_width, self.freeboard + self.float_draft
        if self.float_shape == "box":
            area, girth = width * height, 2.0 * (width + height)
        else:
            area, girth = 0.25 * math.pi * width * height, 0.5 * math.pi * (width + height)
        return 4.0 * area**2 * FABRIC_SHEAR / (girth * self.segment_length)

    @property
    def taper(self) -> float:
        """Length [m] over which each end of a segment narrows to an edge; it is a hundredth of the segment, so the ends are nearly flat.

        A skirt is one sheet. Neighbours touch when the boom is straight and overlap where it bends. Ends that are tapered so far that they
        never overlap would leave wedges as wide as the float, and oil would leak through the wedges before it goes under the skirt.
        """
        return END_TAPER * self.segment_length

    @property
    def height_of_joints(self) -> float:
        """Height [m] above the design waterline at which neighbours and tow lines are joined.

        It is the centre of the water's resistance, half the skirt's depth down, so that towing does not heel the skirt.
        """
        return -0.5 * self.skirt_depth

    def profile(self) -> Array:
        """Return the starboard half of the section from the top down: half breadth and height [m], (K, 2)."""
        bottom = np.array([[0.5 * self.skirt_thickness, -self.skirt_depth]])
        return np.concatenate([self._float_profile(), bottom])

    def _float_profile(self) -> Array:
        """Return half breadth and height (K, 2) [m] of the float, from its top to the point where the skirt begins."""
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
        """Return the boom as a fluid of this particle spacing [m] can resolve it: skirt and float at least one spacing thick.

        Depth, freeboard and waterline stay as built. The mass that the thicker skirt displaces is added to the ballast at the foot,
        b' = 1 - (1 - b) m / m', and buoyancy_to_weight falls. `design_skirt_thickness` keeps what was built.
        """
        thickness = max(self.skirt_thickness, minimum_thickness(particle_spacing))
        thick = replace(self, skirt_thickness=thickness, float_width=max(self.float_width, thickness))
        mass_ratio = section_area(self, 0.0) / section_area(thick, 0.0)
        return replace(thick, ballast_fraction=1.0 - (1.0 - self.ballast_fraction) * mass_ratio)


def minimum_thickness(particle_spacing: float) -> float:
    """Return the thickness [m] of the thinnest plate that keeps the fluid on its two sides apart: one particle spacing."""
    return particle_spacing


def section_area(boom: Boom, height: float) -> float:
    """Integrate the area [m2] of the section below `height` [m]; trapezoids between the points of the profile are exact."""
    profile = boom.profile()[::-1]
    top = float(np.clip(height, profile[0, 1], profile[-1, 1]))
    inside = profile[:, 1] < top
    breadth = float(np.interp(top, profile[:, 1], profile[:, 0]))
    points = np.concatenate([profile[inside], [[breadth, top]]])
    return float(2.0 * np.trapezoid(points[:, 0], points[:, 1]))


def section_buoyancy_to_weight(boom: Boom) -> float:
    """Compute gross buoyancy over weight of the prismatic section: its whole area / its area below the waterline."""
    return section_area(boom, boom.freeboard) / section_area(boom, 0.0)


@dataclass(frozen=True, kw_only=True)
class BoomDesign:
    """A boom as it is ordered: its size and its reserve buoyancy, from which `boom` sizes the float.

    length, segment_count, skirt_depth, freeboard, float_shape, ballast_fraction, water_density: see `Boom`;
    buoyancy_to_weight: gross, volume of the whole boom over the volume that displaces its weight; skirt_thickness [m]: as built;
    base_width [m]: of the two tubes full of water of a shore-sealing boom, which take the place of skirt and ballast;
    pocket: see `Boom`.
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
    base_width: float | None = quantity("m", default=None, above=0.0)
    pocket: Pocket | None = None

    def __post_init__(self) -> None:
        require("boom", BoomDesign, vars(self))

    def boom(self) -> Boom:
        """Return the boom whose float, as wide as high, gives it the buoyancy that is asked for.

        The float's draft e solves A(all) / A(below the waterline) = buoyancy_to_weight, with the float's height and width
        freeboard + e. The ratio falls from a largest value, at which the skirt alone displaces the weight, as e grows.
        ValueError for a ratio that no float of this freeboard and skirt has.
        """
        from scipy.optimize import brentq  # a third of a second, for those who need it

        if self.base_width is not None:
            return self._on_tubes(self.base_width)
        smallest, largest = 1e-3 * self.freeboard, 0.95 * self.skirt_depth
        highest, lowest = (section_buoyancy_to_weight(self._with_draft(e)) for e in (smallest, largest))
        wanted = self.buoyancy_to_weight
        if not lowest <= wanted <= highest:
            raise ValueError(
                f"buoyancy_to_weight is {wanted:g}, allowed: {lowest:.3g} to {highest:.3g} for this freeboard"
                f" ({self.freeboard:g} m), skirt depth ({self.skirt_depth:g} m) and skirt thickness ({self.skirt_thickness:g} m)"
            )
        draft = brentq(lambda e: wanted - section_buoyancy_to_weight(self._with_draft(e)), smallest, largest)
        return replace(
            self._with_draft(draft),
            length=self.length,
            segment_count=self.segment_count,
            pocket=self.pocket,
        )

    def _on_tubes(self, width: float) -> Boom:
        """Return a boom of a box of that width [m]: water-filled tubes below the waterline, an air tube above; its weight is the water's.

        ValueError for another buoyancy_to_weight than that of this section, (freeboard + skirt_depth) / skirt_depth.
        """
        ratio = (self.freeboard + self.skirt_depth) / self.skirt_depth
        if not math.isclose(self.buoyancy_to_weight, ratio, rel_tol=1e-3):
            raise ValueError(
                f"buoyancy_to_weight is {self.buoyancy_to_weight:g}, allowed with base_width: {ratio:.4g}, because the tubes weigh"
                " what they displace"
            )
        return Boom(
            length=self.length,
            segment_count=self.segment_count,
            skirt_depth=self.skirt_depth,
            freeboard=self.freeboard,
            float_width=width,
            float_draft=0.5 * self.skirt_depth,
            skirt_thickness=width,
            design_skirt_thickness=width,
            float_shape="box",
            ballast_fraction=self.ballast_fraction,
            water_density=self.water_density,
            pocket=self.pocket,
        )

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


Kind = Literal["fence", "curtain", "inflatable", "shore-sealing", "high-speed"]


@dataclass(frozen=True, kw_only=True)
class CatalogueBoom(CatalogueEntry):
    """A boom of the catalogue.

    skirt_depth, freeboard, base_width [m]; buoyancy_to_weight (gross), ballast_fraction [-]; section_length [m] between connectors;
    strength, connector_strength [N] at which it and its connectors part; maximum_speed_kn [kn]; pocket: of a boom for fast water.
    """

    kind: Kind
    skirt_depth: float
    freeboard: float
    buoyancy_to_weight: float
    ballast_fraction: float = 0.35
    base_width: float | None = None
    section_length: float | None = None
    connector: str = ""
    strength: float | None = None
    connector_strength: float | None = None
    maximum_speed_kn: float | None = None
    pocket: Pocket | None = None


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, CatalogueBoom]:
    """Read the catalogue, by name."""
    return read_catalogue("booms", CatalogueBoom, pocket=Pocket)

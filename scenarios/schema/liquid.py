"""The liquid of a scenario: how it is solved, its phases, its tank, where it starts and where it flows in.

Settings that the fluid core takes as they are have its limits, units and defaults (`oilsim.core.quantity.quantity_of`).
SI units, world frame with z up. A field in m/s may be written with the suffix ``_kn`` in a file, a field in rad with
``_deg``; the fields here hold SI values.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal, get_args

from booms.losses.liquids import OilOnWater
from oilsim import FluidConfig, Phase, PipeEmitter
from oilsim.core.config import contradictions
from oilsim.core.phases import Wetting
from oilsim.core.quantity import quantity, quantity_of
from scenarios.oils.library import fault_of, oil_named
from scenarios.oils.properties import MOST_EVAPORATED, MOST_WATER
from scenarios.schema.parsing.quantity_fields import Section, Vector
from scenarios.schema.parsing.relations import Relation, above, at_least_one, directed, only_with, reference, together
from scenarios.text.problems import Problem

Axis = Literal["x", "y"]
Side = Literal["-x", "+x", "-y", "+y", "-z", "+z"]
LIGHTEST_WATER = 990.0  # [kg/m3]; fresh water at 20 C has 998
COLDEST, WARMEST = -2.0, 40.0  # [degrees C] of the sea
LABORATORY = 15.0  # [degrees C] at which a named oil is taken if no temperature is given
LEAK_MARGIN = 1.0  # spacings behind a closed side after which a particle counts as lost
Extent = tuple[Vector, Vector]
SIDES: tuple[Side, ...] = get_args(Side)
LIGHTEST, HEAVIEST = (
    100.0,
    25000.0,
)  # [kg/m3] of liquids: boiling hydrogen has 71, molten osmium 20,000; finds density in g/cm3
THICKEST = 1e9  # [Pa s]; pitch has 2e8 in its century-long experiment
HARDEST_PULL = 1000.0  # [m/s2] of gravity: a hundred times that of the Earth, as in a centrifuge
AFLOAT = (
    1.0  # [m] from the still surface within which oil without particles starts: a thick slick and its freeboard fit in
)
AIR_TENSION = 0.0728  # [N/m] of clean water in air at 20 C


@dataclass(frozen=True, kw_only=True)
class FluidSettings(Section):
    """Resolution and solver of the liquid.

    particle_spacing      [m] edge d of a particle's rest volume; the paper's particle radius is d / 2
    dimension             3, or 2 for a plane case in x and z, a slice one metre thick at y = 0
    scheme                "split" (default) or "paper" (Qiu et al. 2021, Alg. 3)
    viscosity_correction  gamma of the paper's Eq. 29; 1 is physical, the paper used 1e4
    relaxation            omega of the paper's Eq. 23
    divergence_tolerance  mean compression per step that the pressure may leave
    interfacial_tension   whether interfaces pull: between oils and water with the tension of each oil, between liquids and air with
                          that of the air; it shortens steps to sqrt((rho_1 + rho_2) d^3 / (4 pi sigma)), with air to less, and matters
                          where ripples of a few spacings do
    sleep_speed           [m/s] regions that move more slowly fall asleep until something disturbs them; 0: none does
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (
        only_with("interfacial_tension", "scheme", "split"),
        only_with("interfacial_tension", "sleep_speed", 0.0),
    )
    particle_spacing: float = quantity_of(FluidConfig, "particle_spacing")
    dimension: int = quantity_of(FluidConfig, "dimension")
    scheme: Literal["split", "paper"] = "split"
    gravity: Vector = quantity_of(FluidConfig, "gravity")
    divergence_tolerance: float = quantity_of(FluidConfig, "divergence_tolerance")
    relaxation: float = quantity_of(FluidConfig, "relaxation")
    viscosity_correction: float = quantity_of(FluidConfig, "viscosity_correction")
    minimum_time_step: float = quantity_of(FluidConfig, "minimum_time_step")
    maximum_time_step: float | None = quantity_of(FluidConfig, "maximum_time_step")
    interfacial_tension: bool = False
    sleep_speed: float = quantity_of(FluidConfig, "sleep_speed")

    def problems(self) -> Iterator[Problem]:
        """Find settings that do not go together."""
        yield from (Problem(key, text) for key, text in contradictions(self))


@dataclass(frozen=True, kw_only=True)
class PhaseSettings(Section):
    """One liquid: an oil by its name (`oilsim oils SEARCH`), with or without changed values, or a liquid or air by its own values.

    oil                short name, record or full name of an oil of the ADIOS library, which gives the values that are not stated here
    temperature        [degrees C] of a named oil; without it, 15
    evaporated         share of a named oil's mass that has evaporated before the start: it makes the oil denser and more viscous
    water_content      share of sea water in the volume of a named oil that has become an emulsion (Mooney 1951); the scores count the
                       emulsion as oil
    density            [kg/m3] at rest
    dynamic_viscosity  [Pa s]
    adhesion           [J/m2] work of adhesion to walls and bodies; with 0 the liquid does not stick
    interfacial_tension  [N/m] of an oil on water, by which booms lose droplets; without it, a named oil has that of the library, if it was
                       measured, else 0.020 is assumed, and the run says so. Between particles it acts with `fluid.interfacial_tension`.
                       Air has that on water, 0.0728 if it is left out
    role               how the scores count it; the default is oil if it is a named oil or lighter than 990 kg/m3. "air" fills the rest of a
                       closed tank, so that drops, bubbles and fronts have surface tension
    color              red, green, blue, opacity, each 0 to 255
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (
        at_least_one("density", "oil"),
        at_least_one("dynamic_viscosity", "oil"),
        only_with("temperature evaporated water_content", "oil"),
    )
    oil: str | None = None
    temperature: float | None = quantity("degrees C", default=None, at_least=COLDEST, at_most=WARMEST)
    evaporated: float = quantity("", default=0.0, at_least=0.0, at_most=MOST_EVAPORATED)
    water_content: float = quantity("", default=0.0, at_least=0.0, at_most=MOST_WATER)
    density: float | None = quantity_of(Phase, "rest_density", default=None)
    dynamic_viscosity: float | None = quantity_of(Phase, "dynamic_viscosity", default=None)
    adhesion: float = quantity_of(Phase, "adhesion")
    interfacial_tension: float | None = quantity_of(OilOnWater, "interfacial_tension", default=None)
    role: Literal["water", "oil", "air"] | None = None
    color: tuple[int, int, int, int] | None = quantity("", default=None, at_least=0, at_most=255, whole=True)

    def problems(self) -> Iterator[Problem]:
        """Check that the oil is known, and that a tension is that of an oil or of air."""
        if self.oil is not None and (fault := fault_of(self.oil)):
            yield Problem("oil", f"is {self.oil!r}, which {fault}")
        if self.oil is None and None in (self.density, self.dynamic_viscosity):
            return
        if self.interfacial_tension is not None and not (self.is_oil or self.is_air):
            yield Problem("interfacial_tension", f"is {self.interfacial_tension:g}, allowed: only of an oil or of air")
        if self.is_air and self.oil is not None:
            yield Problem("role", 'is "air", allowed of an oil: "oil" or "water"')

    @property
    def rest_density(self) -> float:
        """Density at rest [kg/m3], stated or from the library of oils."""
        return self._of_library("density_at") if self.density is None else self.density

    @property
    def viscosity(self) -> float:
        """Dynamic viscosity [Pa s], stated or from the library of oils."""
        return self._of_library("viscosity_at") if self.dynamic_viscosity is None else self.dynamic_viscosity

    @property
    def tension(self) -> float | None:
        """Interfacial tension [N/m] with water: stated, of the library of oils, or of clean water in air; None if it is not known."""
        if self.interfacial_tension is None and self.is_air:
            return AIR_TENSION
        if self.interfacial_tension is not None or self.oil is None:
            return self.interfacial_tension
        return oil_named(self.oil).interfacial_tension

    def _of_library(self, quantity: Literal["density_at", "viscosity_at"]) -> float:
        """Return a quantity of the named oil in its state at the start."""
        temperature = LABORATORY if self.temperature is None else self.temperature
        state = {"evaporated": self.evaporated, "water_content": self.water_content}
        return float(getattr(oil_named(str(self.oil)), quantity)(temperature, **state))

    @property
    def is_oil(self) -> bool:
        """True if the scores count this phase as oil."""
        if self.role is not None:
            return self.role == "oil"
        return self.oil is not None or self.rest_density < LIGHTEST_WATER

    @property
    def is_air(self) -> bool:
        """True if this phase fills what liquids leave of a closed tank."""
        return self.role == "air"


@dataclass(frozen=True, kw_only=True)
class ZoneSettings(Section):
    """A box between `lower` and `upper` [m] in which the water is drawn to the velocity of the sea; outside, it runs freely.

    Without both corners it is the whole tank. A particle in several zones belongs to the first of them.

    relaxation_time  [s] in which the difference falls by the factor e
    edge             [m] in which a zone rises smoothly from nothing at those sides across x and y that lie within the tank: a sponge
    waves            true: it follows the waves and the current; false: the current alone, and the water's swing is left alone
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (
        together("lower", "upper"),
        above("upper", "lower"),
        only_with("edge", "lower"),
    )
    lower: Vector | None = quantity("m", default=None)
    upper: Vector | None = quantity("m", default=None)
    relaxation_time: float = quantity("s", default=0.5, above=0.0)
    edge: float = quantity("m", default=0.0, at_least=0.0)
    waves: bool = True


@dataclass(frozen=True, kw_only=True)
class Tank(Section):
    """The box that holds the liquid [m]; in two dimensions its y extent has no effect.

    open      sides without a wall; liquid that leaves through one is removed and counted. For bodies, closed sides are infinite planes
    periodic  axes on which liquid that leaves one side enters the other; the liquid also meets bodies across it, but bodies do not meet
              each other across it
    no_slip   true: the liquid sticks to the walls; false: it slides along them
    contact_angle  [deg] at which oil meets the walls in water, through the oil, or air, through the air; it needs
                   `fluid.interfacial_tension`
    zones     in which the water follows the sea, by name; without any, waves and current drive the whole tank
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (above("upper", "lower"),)
    lower: Vector = quantity("m")
    upper: Vector = quantity("m")
    open: tuple[Side, ...] = ()
    periodic: tuple[Axis, ...] = ()
    no_slip: bool = False
    contact_angle: float = quantity_of(Wetting, "contact_angle")
    zones: Mapping[str, ZoneSettings] = field(default_factory=dict)

    def problems(self) -> Iterator[Problem]:
        """Check that no side is named twice, or both open and periodic."""
        for name in ("open", "periodic"):
            entries = getattr(self, name)
            twice = sorted({one for one in entries if entries.count(one) > 1})
            if twice:
                yield Problem(name, f"has {', '.join(map(repr, twice))} twice, allowed: each once")
        for side in self.open:
            if side[1] in self.periodic:
                yield Problem("open", f"has {side!r}, but {side[1]} is periodic; allowed: one of the two")

    @property
    def period(self) -> tuple[float, float]:
        """Length [m] along x and y after which the liquid repeats; 0 where it does not."""
        x, y = (high - low for low, high in zip(self.lower[:2], self.upper[:2], strict=True))
        return (x if "x" in self.periodic else 0.0, y if "y" in self.periodic else 0.0)

    @property
    def closed_sides(self) -> tuple[Side, ...]:
        """The sides that have a wall."""
        return tuple(side for side in SIDES if side not in self.open and side[1] not in self.periodic)


# a box with walls, where only heights in it count
SOMEWHERE = Tank(lower=(-1.0, -1.0, -1.0), upper=(1.0, 1.0, 1.0))


def light_problems(phases: Mapping[str, PhaseSettings]) -> Iterator[Problem]:
    """Yield liquids that are lighter than any liquid is."""
    for name, phase in phases.items():
        if phase.density is not None and not phase.is_air and phase.density < LIGHTEST:
            text = f"is {phase.density:g} kg/m3, allowed of a liquid: {LIGHTEST:g} kg/m3 or more; sea water has 1025"
            yield Problem(f"phases.{name}.density", text)


def air_problems(
    phases: Mapping[str, PhaseSettings], fluid: FluidSettings, tank: Tank, tables: Collection[str]
) -> Iterator[Problem]:
    """Find what does not go together with air among the phases; `tables` of the scenario that need water under an open sky."""
    for allowed in (f"allowed with the air {name!r}" for name, phase in phases.items() if phase.is_air):
        if not fluid.interfacial_tension:
            yield Problem("fluid.interfacial_tension", f"is false, {allowed}: true")
        if tank.open:
            yield Problem("tank.open", f"has {', '.join(tank.open)}, {allowed}: no side")
        for table in tables:
            yield Problem(table, f"has entries, {allowed}: none, as they need water under an open sky")


@dataclass(frozen=True, kw_only=True)
class FillSettings(Section):
    """Liquid that is there at the start; a later region replaces earlier ones where they overlap, bodies replace all.

    `oilsim check` and the start of a run tell how much of a region the bodies displace, of oil as a warning; some of it must be left.

    phase     which liquid
    velocity  [m/s] at the start; None: that of a current that runs through the whole tank, else at rest
    """

    phase: str = reference("phases")
    velocity: Vector | None = quantity("m/s", default=None)


@dataclass(frozen=True, kw_only=True)
class BlockFill(FillSettings):
    """A box of liquid between two corners [m], on a lattice that stands on the lower face and is centred sideways.

    inset  free space on each side, in particle spacings: round(extent / d - 2 inset) particles fit on an axis.
           The paper's blocks leave half a spacing: 4.0 m at d = 0.03 m hold 132.
    """

    TAG: ClassVar[tuple[str, str]] = ("shape", "block")
    RELATIONS: ClassVar[tuple[Relation, ...]] = (above("upper", "lower"),)
    lower: Vector = quantity("m")
    upper: Vector = quantity("m")
    inset: float = quantity("spacings", default=0.0, at_least=0.0, at_most=10.0)

    def extent(self, tank: Tank) -> Extent:
        """Return its lower and upper corner [m]."""
        return self.lower, self.upper


@dataclass(frozen=True, kw_only=True)
class SlabFill(FillSettings):
    """A level layer that covers the whole tank between two heights [m]."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "slab")
    RELATIONS: ClassVar[tuple[Relation, ...]] = (above("top", "bottom"),)
    bottom: float = quantity("m")
    top: float = quantity("m")

    def extent(self, tank: Tank) -> Extent:
        """Return its lower and upper corner [m] in a tank."""
        return (*tank.lower[:2], self.bottom), (*tank.upper[:2], self.top)


@dataclass(frozen=True, kw_only=True)
class CylinderFill(FillSettings):
    """An upright cylinder of liquid, such as a round slick: centre of its base, radius and height [m]."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "cylinder")
    base: Vector = quantity("m")
    radius: float = quantity("m", above=0.0)
    height: float = quantity("m", above=0.0)

    def extent(self, tank: Tank) -> Extent:
        """Return lower and upper corner [m] of the box around it."""
        (x, y, z), r = self.base, self.radius
        return (x - r, y - r, z), (x + r, y + r, z + self.height)


Fill = BlockFill | SlabFill | CylinderFill


@dataclass(frozen=True, kw_only=True)
class PipeEmitterSettings(Section):
    """A round pipe through which a phase flows in.

    on         a vessel that it stays with, without particles: then `mouth` is ahead and to port of midships
    mouth      [m] centre of its mouth; the pipe extends three spacings behind it, and lies inside the tank and in no body
    direction  of the flow, of any length
    radius     [m] of the pipe
    speed      [m/s] of the flow; at 0 the pipe is shut until an order opens it
    start      [s] at which it opens
    volume     [m3] after which it closes; without it, the pipe stays open
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (directed,)
    phase: str = reference("phases")
    on: str | None = reference("vessels", default=None)
    mouth: Vector = quantity_of(PipeEmitter, "mouth")
    direction: Vector = quantity_of(PipeEmitter, "direction", default=(0.0, 0.0, -1.0))
    radius: float = quantity_of(PipeEmitter, "radius")
    speed: float = quantity_of(PipeEmitter, "speed")
    start: float = quantity_of(PipeEmitter, "start")
    volume: float | None = quantity_of(PipeEmitter, "volume")


def top_of_water(fills: Mapping[str, Fill], phases: Mapping[str, PhaseSettings]) -> float | None:
    """Return the height [m] of the top of liquid that is not oil, in slabs and blocks; None without any."""
    waters = [fill for fill in fills.values() if fill.phase in phases and not phases[fill.phase].is_oil]
    tops = [fill.top for fill in waters if isinstance(fill, SlabFill)]
    return max(tops + [fill.upper[2] for fill in waters if isinstance(fill, BlockFill)], default=None)


def afloat_problems(fills: Mapping[str, Fill], phases: Mapping[str, PhaseSettings], level: float) -> Iterator[Problem]:
    """Yield oil that starts far from the surface of a sea of formulas, on which it floats; `level` of the still water [m]."""
    for name, fill in fills.items():
        (*_, low), (*_, high) = fill.extent(SOMEWHERE)
        if fill.phase in phases and phases[fill.phase].is_oil and not level - AFLOAT <= high <= level + AFLOAT:
            text = (
                f"reaches from z = {low:g} to {high:g} m, allowed of oil without particles: a top within {AFLOAT:g} m"
            )
            yield Problem(f"fill.{name}", f"{text} of the water's surface, {level:g} m")


def lost_oil_problems(phases: Mapping[str, PhaseSettings], booms: Collection[str]) -> Iterator[Problem]:
    """Yield where oil does not float, by the names of the `booms` whose closures go by it."""
    waters = [phase.rest_density for phase in phases.values() if not phase.is_oil]
    for name in booms:
        for oil, phase in phases.items():
            if waters and phase.is_oil and phase.rest_density >= waters[0]:
                text = f'is "closures" with {oil!r} of {phase.rest_density:g} kg/m3 on water of {waters[0]:g}'
                yield Problem(f"booms.{name}.losses", f'{text}, allowed: with lighter oil, else "resolved"')


def floating_oil_problems(phases: Mapping[str, PhaseSettings], used: Collection[str], told: bool) -> Iterator[Problem]:
    """Yield where oil does not float on a sea of formulas; the sea is of the first phase that is no oil, else of the first of all.

    used: the phases that the run fills in or pours; told: whether `lost_oil_problems` says so of oil on water.
    """
    waters = [phase.rest_density for phase in phases.values() if not phase.is_oil]
    for name, phase in phases.items():
        sea = (waters or [one.rest_density for one in phases.values()])[0]
        if name not in used or not phase.is_oil or phase.rest_density < sea:
            continue
        density, allowed = f"{phase.rest_density:g} kg/m3", "allowed without a tank"
        if not waters:
            text = f"holds no water under the oil {name!r} of {density}, {allowed}: with a phase of water, denser than this oil"
            yield Problem("phases", text)
            return
        if not told:
            yield Problem(f"phases.{name}", f"is oil of {density} on water of {sea:g}, {allowed}: lighter oil")

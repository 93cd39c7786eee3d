"""The liquid of a scenario: its solver, its phases, its tank, where it is at the start, and where it flows in.

SI units, world frame with z up. In a file, a field in m/s may be written with the suffix ``_kn``, a field in rad with ``_deg``; the
fields here hold SI values.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal

from scenarios.problems import Problem, unknown
from scenarios.schema import oils
from scenarios.schema.quantity_fields import Section, Vector, above_lower, directed, quantity

Axis = Literal["x", "y"]
Side = Literal["-x", "+x", "-y", "+y", "-z", "+z"]
LIGHTEST_WATER = 990.0  # [kg/m3]; fresh water at 20 C has 998
SIDES: tuple[Side, ...] = ("-x", "+x", "-y", "+y", "-z", "+z")


@dataclass(frozen=True, kw_only=True)
class FluidSettings(Section):
    """Resolution and solver of the liquid.

    particle_spacing      [m] edge d of a particle's rest volume; the paper's particle radius is d / 2
    dimension             3, or 2 for a plane case in x and z, a slice one metre thick at y = 0
    scheme                "split" (default) or "paper" (Qiu et al. 2021, Alg. 3)
    viscosity_correction  gamma of the paper's Eq. 29; 1 is physical, the paper used 1e4
    relaxation            omega of the paper's Eq. 23
    tolerances            mean relative compression, mean compression per step, relative residual
    cfl                   largest motion of a particle in one sub-step, in spacings
    sleep_speed           [m/s] regions that move more slowly fall asleep until something disturbs them; 0: none does
    """

    particle_spacing: float = quantity("m", above=0.0)
    dimension: int = quantity("", default=3, at_least=2, at_most=3, whole=True)
    scheme: Literal["split", "paper"] = "split"
    gravity: Vector = quantity("m/s2", default=(0.0, 0.0, -9.81))
    density_tolerance: float = quantity("", default=1e-3, above=0.0, at_most=0.05)
    divergence_tolerance: float = quantity("", default=1e-4, above=0.0, at_most=0.05)
    viscosity_tolerance: float = quantity("", default=1e-4, above=0.0, at_most=0.05)
    density_iterations: int = quantity("", default=50, at_least=1, whole=True)
    divergence_iterations: int = quantity("", default=100, at_least=1, whole=True)
    viscosity_iterations: int = quantity("", default=200, at_least=1, whole=True)
    relaxation: float = quantity("", default=0.1, at_least=0.0, at_most=1.0)
    viscosity_correction: float = quantity("", default=1.0, above=0.0)
    explicit_viscosity: bool = False
    minimum_time_step: float = quantity("s", default=1e-4, above=0.0)
    maximum_time_step: float = quantity("s", default=1e-2, above=0.0)
    cfl: float = quantity("", default=0.4, above=0.0, at_most=1.0)
    sleep_speed: float = quantity("m/s", default=0.0, at_least=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check the limits of the time step, and that only liquid under gravity may sleep."""
        if self.minimum_time_step > self.maximum_time_step:
            yield Problem(
                "minimum_time_step",
                f"is {self.minimum_time_step:g} s, allowed: up to maximum_time_step = {self.maximum_time_step:g} s",
            )
        if self.sleep_speed > 0.0 and (self.scheme == "paper" or not any(self.gravity)):
            yield Problem(
                "sleep_speed", f"is {self.sleep_speed:g} m/s, allowed: 0 in the paper's scheme and without gravity"
            )


@dataclass(frozen=True, kw_only=True)
class PhaseSettings(Section):
    """One liquid: an oil by its name (`scenarios.schema.oils`), with or without changed values, or a liquid by its own values.

    oil                name in the table of oils, which gives the values that are not stated here
    density            [kg/m3] at rest
    dynamic_viscosity  [Pa s]
    adhesion           [J/m2] work of adhesion to walls and bodies; with 0 the liquid does not stick
    role               how the scores count it; the default is oil if it is a named oil or lighter than 990 kg/m3
    color              red, green, blue, opacity, each 0 to 255
    """

    oil: str | None = None
    density: float | None = quantity("kg/m3", default=None, above=0.0)
    dynamic_viscosity: float | None = quantity("Pa s", default=None, at_least=0.0)
    adhesion: float = quantity("J/m2", default=0.0, at_least=0.0)
    role: Literal["water", "oil"] | None = None
    color: tuple[int, int, int, int] | None = quantity("", default=None, at_least=0, at_most=255, whole=True)

    def problems(self) -> Iterator[Problem]:
        """Check that density and viscosity are known, from the table or stated."""
        if self.oil is not None and self.oil not in oils.OILS:
            yield Problem("oil", f"is {self.oil!r}, which {unknown(self.oil, oils.OILS, 'oil of the table')}")
        elif self.oil is None:
            for name in ("density", "dynamic_viscosity"):
                if getattr(self, name) is None:
                    yield Problem(name, "is missing, allowed: a value, or the name of an oil")

    @property
    def rest_density(self) -> float:
        """Density at rest [kg/m3], stated or from the oils table."""
        return self.density if self.density is not None else oils.OILS[str(self.oil)].density

    @property
    def viscosity(self) -> float:
        """Dynamic viscosity [Pa s], stated or from the oils table."""
        if self.dynamic_viscosity is not None:
            return self.dynamic_viscosity
        return oils.OILS[str(self.oil)].dynamic_viscosity

    @property
    def is_oil(self) -> bool:
        """True if the scores count this phase as oil."""
        if self.role is not None:
            return self.role == "oil"
        return self.oil is not None or self.rest_density < LIGHTEST_WATER


@dataclass(frozen=True, kw_only=True)
class Tank(Section):
    """The box that holds the liquid [m]; in two dimensions its y extent has no effect.

    open      sides without a wall; liquid that leaves through one is removed and counted. For bodies, closed sides are infinite planes
    periodic  axes on which liquid that leaves one side enters the other; the liquid also meets bodies across it, but bodies do not meet
              each other across it
    no_slip   true: the liquid sticks to the walls; false: it slides along them
    """

    lower: Vector = quantity("m")
    upper: Vector = quantity("m")
    open: tuple[Side, ...] = ()
    periodic: tuple[Axis, ...] = ()
    no_slip: bool = False

    def problems(self) -> Iterator[Problem]:
        """Check that the box has a volume, and that no side is both open and periodic."""
        yield from above_lower(self.lower, self.upper)
        for side in self.open:
            if side[1] in self.periodic:
                yield Problem("open", f"has {side!r}, but {side[1]} is periodic; allowed: one of the two")

    @property
    def closed_sides(self) -> tuple[Side, ...]:
        """The sides that have a wall."""
        return tuple(side for side in SIDES if side not in self.open and side[1] not in self.periodic)


@dataclass(frozen=True, kw_only=True)
class FillSettings(Section):
    """Liquid that is in the tank at the start. Where regions overlap, a later one replaces earlier ones; bodies replace all.

    `oilsim check`, and the start of a run, tell how much of a region bodies take; for oil this is a warning. Bodies must leave some of it.

    phase     name of the liquid
    velocity  [m/s] at the start; the default is that of a current through the whole tank, or else rest
    """

    phase: str
    velocity: Vector | None = quantity("m/s", default=None)


@dataclass(frozen=True, kw_only=True)
class BlockFill(FillSettings):
    """A box of liquid between two corners [m], on a lattice that stands on the lower face and is centred sideways.

    inset  free space on each side, in particle spacings: round(extent / d - 2 inset) particles fit on an axis.
           The paper's blocks leave half a spacing: 4.0 m at d = 0.03 m hold 132.
    """

    TAG: ClassVar[tuple[str, str]] = ("shape", "block")
    lower: Vector = quantity("m")
    upper: Vector = quantity("m")
    inset: float = quantity("spacings", default=0.0, at_least=0.0, at_most=10.0)

    def problems(self) -> Iterator[Problem]:
        """Check that the box has a volume."""
        yield from above_lower(self.lower, self.upper)


@dataclass(frozen=True, kw_only=True)
class SlabFill(FillSettings):
    """A level layer that covers the whole tank between two heights [m]."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "slab")
    bottom: float = quantity("m")
    top: float = quantity("m")

    def problems(self) -> Iterator[Problem]:
        """Check that the layer has a thickness."""
        if not self.top > self.bottom:
            yield Problem("top", f"is {self.top:g}, allowed: above bottom = {self.bottom:g} m")


@dataclass(frozen=True, kw_only=True)
class CylinderFill(FillSettings):
    """A cylinder of liquid: centre of its base, direction of its axis, radius and height [m]."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "cylinder")
    base: Vector = quantity("m")
    axis: Vector = quantity("", default=(0.0, 0.0, 1.0))
    radius: float = quantity("m", above=0.0)
    height: float = quantity("m", above=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that the axis has a direction."""
        yield from directed("axis", self.axis)


@dataclass(frozen=True, kw_only=True)
class SphereFill(FillSettings):
    """A ball of liquid: centre and radius [m]."""

    TAG: ClassVar[tuple[str, str]] = ("shape", "sphere")
    center: Vector = quantity("m")
    radius: float = quantity("m", above=0.0)


Fill = BlockFill | SlabFill | CylinderFill | SphereFill


@dataclass(frozen=True, kw_only=True)
class PipeEmitterSettings(Section):
    """A round pipe through which a phase flows in.

    mouth      [m] centre of its mouth; the pipe extends three spacings behind it, and lies inside the tank and in no body
    direction  of the flow, of any length
    radius     [m] of the pipe
    speed      [m/s] of the flow; at 0 the pipe is shut until an order opens it
    start      [s] at which it opens
    volume     [m3] after which it closes; without it, the pipe stays open
    """

    phase: str
    mouth: Vector = quantity("m")
    direction: Vector = quantity("", default=(0.0, 0.0, -1.0))
    radius: float = quantity("m", above=0.0)
    speed: float = quantity("m/s", at_least=0.0)
    start: float = quantity("s", default=0.0, at_least=0.0)
    volume: float | None = quantity("m3", default=None, above=0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that the flow has a direction."""
        yield from directed("direction", self.direction)

"""The sea of a scenario, with the limits, units and defaults of `oilsim.sea`.

Directions are where wind, waves and current go **to**, counter-clockwise about z from +x: 180 degrees is along -x.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal

from oilsim.core.quantity import quantity, quantity_of
from oilsim.sea import (
    CurrentProfile,
    JonswapWaves,
    KaimalGusts,
    LangmuirCells,
    RegularWaves,
    SeaDescription,
    SteadyFlow,
    TidalFlow,
    Tide,
)
from oilsim.sea.flows import heading
from scenarios.schema.parsing.quantity_fields import Point2, Section, Vector
from scenarios.schema.parsing.relations import Relation, only_with
from scenarios.text.problems import Problem


@dataclass(frozen=True, kw_only=True)
class SeaWaveSettings(Section):
    """The keys that all kinds of waves share.

    direction   [rad] they run to
    seen_from   "water": periods are seen from the water, which carries its waves along; "ground": from a place at rest, on a steady current
    build_up    [s] since the start, over which the waves grow from nothing
    """

    COMPASS: ClassVar[str | None] = "from_compass"
    direction: float = quantity_of(RegularWaves, "direction")
    seen_from: Literal["water", "ground"] = "water"
    build_up: float = quantity_of(SeaDescription, "build_up")


@dataclass(frozen=True, kw_only=True)
class RegularSeaWaves(SeaWaveSettings):
    """A regular wave train.

    height  [m] crest to trough
    period  [s]
    """

    TAG: ClassVar[tuple[str, str]] = ("kind", "regular")
    USUAL: ClassVar[bool] = True
    height: float = quantity_of(RegularWaves, "height")
    period: float = quantity_of(RegularWaves, "period")


@dataclass(frozen=True, kw_only=True)
class JonswapSeaWaves(SeaWaveSettings):
    """A sea of many linear waves with a JONSWAP spectrum; phases and directions follow from the run's seed.

    significant_height  [m]
    peak_period         [s]
    peakedness          gamma; 1: Pierson-Moskowitz
    spread              s of the spreading cos^2s(theta / 2); long-crested without it
    """

    TAG: ClassVar[tuple[str, str]] = ("kind", "jonswap")
    significant_height: float = quantity_of(JonswapWaves, "significant_height")
    peak_period: float = quantity_of(JonswapWaves, "peak_period")
    peakedness: float = quantity_of(JonswapWaves, "peakedness")
    spread: float | None = quantity_of(JonswapWaves, "spread")


@dataclass(frozen=True, kw_only=True)
class SeaCurrentSettings(Section):
    """The keys that all kinds of currents share.

    shear_exponent  n of the profile (1 + z / depth)^n; 0: uniform, 1/7: a turbulent stream
    """

    shear_exponent: float = quantity_of(CurrentProfile, "shear_exponent")


@dataclass(frozen=True, kw_only=True)
class SteadySeaCurrent(SeaCurrentSettings, SteadyFlow):
    """A steady current: speed [m/s] at the surface and direction [rad] it runs to."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "steady")
    USUAL: ClassVar[bool] = True
    COMPASS: ClassVar[str | None] = "toward_compass"


@dataclass(frozen=True, kw_only=True)
class TidalSeaCurrent(SeaCurrentSettings, TidalFlow):
    """A tide whose speed is a sine of time.

    speed      [m/s] at the surface, the largest
    direction  [rad] it runs to in the half period after the turn
    turn       [s] time of slack water
    period     [s] by default 12.42 h, so that the current turns every 6.21 h
    """

    TAG: ClassVar[tuple[str, str]] = ("kind", "tide")
    COMPASS: ClassVar[str | None] = "toward_compass"


@dataclass(frozen=True, kw_only=True)
class FileSeaCurrent(SeaCurrentSettings):
    """A current at the surface from a table of times.

    file  CSV or CF NetCDF, see the page "Sea" of the documentation; a relative path starts at the scenario file's folder
    """

    TAG: ClassVar[tuple[str, str]] = ("kind", "file")
    file: str


@dataclass(frozen=True, kw_only=True)
class SeaWindSettings(Section):
    """The keys that all kinds of winds share.

    gust_intensity  standard deviation of the speed over its mean, Kaimal's spectrum; the gusts follow from the run's seed; 0: no gusts
    """

    gust_intensity: float = quantity_of(KaimalGusts, "intensity", default=0.0)


@dataclass(frozen=True, kw_only=True)
class SteadySeaWind(SeaWindSettings, SteadyFlow):
    """A wind of one mean: speed [m/s] at 10 m height and direction [rad] it blows to."""

    TAG: ClassVar[tuple[str, str]] = ("kind", "steady")
    USUAL: ClassVar[bool] = True
    COMPASS: ClassVar[str | None] = "from_compass"


@dataclass(frozen=True, kw_only=True)
class FileSeaWind(SeaWindSettings):
    """A mean wind at 10 m height from a table of times.

    file  CSV or CF NetCDF, see the page "Sea" of the documentation; a relative path starts at the scenario file's folder
    """

    TAG: ClassVar[tuple[str, str]] = ("kind", "file")
    file: str


@dataclass(frozen=True, kw_only=True)
class LangmuirSettings(Section):
    """Langmuir cells: rows along the wind into which the surface converges.

    spacing  [m] between rows
    """

    spacing: float = quantity_of(LangmuirCells, "spacing")


@dataclass(frozen=True, kw_only=True)
class ShoreSettings(Section):
    """A straight shore of one slope, at the fidelity none: bodies and booms run aground on it, and oil strands at its waterline.

    Current and waves do not feel it: the stream is that of the open water up to the waterline (*modelled*).

    waterline  (x, y) [m] a point of the waterline at the start
    seaward    [rad] direction from the land out to sea
    slope      rise over run
    width      [m] of the shore, half of it to each side of `waterline`
    capacity   [m3/m] oil that a metre of the waterline takes
    """

    waterline: Point2 = quantity("m")
    seaward: float = quantity("rad")
    slope: float = quantity("", at_least=1e-4, at_most=1.0)
    width: float = quantity("m", default=200.0, above=1.0)
    capacity: float = quantity("m3/m", default=0.02, at_least=0.0)


@dataclass(frozen=True, kw_only=True)
class AreaSettings(Section):
    """A sensitive area, as a reed bed or a water intake, at the fidelity none: plans show it, and the oil in it is told.

    outline   (x, y) [m] of its corners in order
    file      GeoJSON of polygons in degrees of longitude and latitude, in the place of `outline`; [site] says where
              they lie, and holes in them belong to it
    """

    outline: tuple[Point2, ...] = quantity("m", default=())
    file: str = ""

    def problems(self) -> Iterator[Problem]:
        """Check that there is one outline, of three or more corners."""
        if bool(self.outline) == bool(self.file):
            yield Problem("outline", "and file are both given, or both missing, allowed: one of them")
        elif self.outline and len(self.outline) < 3:
            yield Problem("outline", f"has {len(self.outline)} corners, allowed: 3 or more")


@dataclass(frozen=True, kw_only=True)
class LandSettings(AreaSettings):
    """Land or a shoal with steep sides, at the fidelity none: the stream runs along it, vessels and booms run aground on it.

    `sea.current` is the current far out. Along land and over shoals it is a potential flow of their depths, without friction and without
    eddies (*modelled*; page "Sea"). Oil strands on dry land. Waves and wind feel neither.

    outline, file  as of [areas.NAME]; holes in polygons are land
    depth          [m] of the still water over it at the start; 0: dry land. Polygons of a file have their own as the property `depth` (or
                   `DRVAL1` of electronic charts); those as deep as the sea are left out
    capacity       [m3/m] oil that a metre of the edge of dry land takes
    """

    depth: float = quantity("m", default=0.0, at_least=0.0)
    capacity: float = quantity("m3/m", default=0.02, at_least=0.0)


SeaWaves = RegularSeaWaves | JonswapSeaWaves
SeaCurrent = SteadySeaCurrent | TidalSeaCurrent | FileSeaCurrent
SeaWind = SteadySeaWind | FileSeaWind


@dataclass(frozen=True, kw_only=True)
class SeaSettings(Section):
    """The motion of undisturbed water, by formulas; one that is left out of waves, current and wind is calm.

    depth        [m] of the still water; by default that of the water in the tank
    level        [m] height of the still water; by default that of the water at the start
    diffusivity  [m2/s] of turbulence, which disperses floating oil in all horizontal directions
    visibility   [m] from a crew to what its page shows: in fog or at night the rest of its plan is veiled; of no effect on the run
    within       [s] over which wind, current, waves and visibility go from what they are to what an order or inject asks for; 0: at once

    It loads bodies and carries oil where no particles are, and moves the particles of windows. In a tank of particles its waves and its
    current drive the water in the zones of the tank, or everywhere without zones, and its wind drags on the surface.
    """

    RELATIONS: ClassVar[tuple[Relation, ...]] = (only_with("langmuir", "wind"), only_with("langmuir", "waves"))
    depth: float | None = quantity_of(SeaDescription, "depth", default=None)
    level: float | None = quantity_of(SeaDescription, "level", default=None)
    waves: SeaWaves | None = None
    current: SeaCurrent | None = None
    wind: SeaWind | None = None
    langmuir: LangmuirSettings | None = None
    diffusivity: float = quantity_of(SeaDescription, "diffusivity")
    tide: Tide | None = None
    visibility: float = quantity("m", default=2e4, at_least=10.0)
    within: float = quantity("s", default=0.0, at_least=0.0)

    @property
    def height_and_period(self) -> tuple[float, float]:
        """Height [m] and period [s] of the waves, of a spectrum the significant one and that of its peak; 0 without waves."""
        if self.waves is None:
            return 0.0, 0.0
        if isinstance(self.waves, JonswapSeaWaves):
            return self.waves.significant_height, self.waves.peak_period
        return self.waves.height, self.waves.period

    @property
    def steady_current(self) -> tuple[float, float]:
        """Speed [m/s] and direction [rad] of a steady current at the surface; 0 of another, and without one."""
        current = self.current
        return (current.speed, current.direction) if isinstance(current, SteadySeaCurrent) else (0.0, 0.0)

    def problems(self) -> Iterator[Problem]:
        """Check that waves that are seen from the ground run on a current that stays."""
        from_ground = self.waves is not None and self.waves.seen_from == "ground"
        if from_ground and not isinstance(self.current, SteadySeaCurrent | None):
            yield Problem("waves.seen_from", "is 'ground', allowed: 'water' on a current that changes with time")


def horizontal(speed: float, direction: float) -> Vector:
    """Compute the horizontal velocity (3,) [m/s] of something that goes to `direction` [rad from +x]."""
    x, y = heading(direction)
    return speed * x, speed * y, 0.0

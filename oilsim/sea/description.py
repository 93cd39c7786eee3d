"""Description of a sea: frozen, checked when it is made, without any state; and what it takes over from the sea before it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from oilsim.core.physical_constants import GRAVITY, SEA_WATER_DENSITY
from oilsim.core.quantity import quantity, require
from oilsim.sea.flows import Flow, FlowTable, SteadyFlow, TidalFlow, Tide
from oilsim.sea.jonswap import JonswapWaves
from oilsim.sea.regular_waves import RegularWaves
from oilsim.sea.stream import Stream, StreamTable
from oilsim.sea.wave_components import StillWater
from oilsim.sea.wind_stress import KaimalGusts, LangmuirCells, WindDrift

FLOWS = (SteadyFlow, TidalFlow, FlowTable)


def of_kind(name: str, value: Any, *kinds: type) -> Iterator[str]:
    """Yield a problem if a value is of none of these classes."""
    if not isinstance(value, kinds):
        names = ", ".join("None" if kind is type(None) else kind.__name__ for kind in kinds)
        yield f"{name} is a {type(value).__name__}, allowed: {names}"


@dataclass(frozen=True, kw_only=True)
class Continuation:
    """The lead of the patterns of a sea over those of a sea of the same description that began at time 0.

    way      (2,) [m] more that the current has carried the waves
    lead     [s] by which gusts are early
    turn     (M,) [rad] by which the phase of each component leads; none where their lengths are those at the start
    made_in  the current in which periods seen from the ground became wave lengths, which no later current changes; None: the sea's own
    Raises ValueError for values that are not allowed.
    """

    way: tuple[float, float] = quantity("m", default=(0.0, 0.0))
    lead: float = quantity("s", default=0.0)
    turn: tuple[float, ...] = quantity("rad", default=())
    made_in: SteadyFlow | None = None

    def __post_init__(self) -> None:
        require("continuation", Continuation, vars(self))


@dataclass(frozen=True, kw_only=True)
class CurrentProfile:
    """A current U(z, t) = flow(t) (1 + z / h)^shear_exponent, with z from the surface (0) to the bottom (-h).

    flow            SteadyFlow, TidalFlow or FlowTable: the current at the surface
    shear_exponent  [-] 0: uniform; 1/7: the profile of a turbulent stream
    Raises ValueError for values that are not allowed.
    """

    flow: Flow
    shear_exponent: float = quantity("", default=0.0, at_least=0.0, at_most=1.0)

    def __post_init__(self) -> None:
        require("current", CurrentProfile, vars(self), of_kind("flow", self.flow, *FLOWS))


@dataclass(frozen=True, kw_only=True)
class WindField:
    """A wind at 10 m above the sea, equal everywhere but for its gusts.

    flow   SteadyFlow, TidalFlow or FlowTable: the mean wind, to where it blows
    gusts  KaimalGusts, or None
    drift  WindDrift of the upper layer of the sea, or None
    Raises ValueError for values that are not allowed.
    """

    flow: Flow
    gusts: KaimalGusts | None = None
    drift: WindDrift | None = field(default_factory=WindDrift)

    def __post_init__(self) -> None:
        require("wind", WindField, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        kinds = [*of_kind("flow", self.flow, *FLOWS), *of_kind("gusts", self.gusts, KaimalGusts, type(None))]
        yield from kinds
        yield from of_kind("drift", self.drift, WindDrift, type(None))
        if not kinds and self.gusts is not None and not math.hypot(*self.flow.mean()) > 0.0:
            yield "flow has the mean 0 m/s, allowed with gusts: above 0, since the mean wind carries them"


@dataclass(frozen=True, kw_only=True)
class SeaDescription:
    """A sea of one depth, without end.

    depth       [m] of the still water
    level       [m] height of the still water in the world
    density     [kg/m3] of the water
    gravity     [m/s2]; waves need it
    waves       RegularWaves, JonswapWaves, or None
    build_up    [s] since time 0, over which the waves grow from nothing; see `growth`
    current     CurrentProfile, or None
    wind        WindField, or None
    langmuir    LangmuirCells, or None; they need wind and waves
    diffusivity [m2/s] of the turbulence that disperses what floats, in all horizontal directions; 0.1 to 10 at sea
    tide        Tide, or None: the surface stays at `level`, but for its waves
    stream      Stream or StreamTable: how the current differs from place to place, `current` is that far out, or at the origin; or None
    carried     Continuation of the sea before this one; by default there is none
    Raises ValueError for values that are not allowed; `oilsim.sea.Sea` raises it for waves that cannot be.
    """

    depth: float = quantity("m", above=0.0, at_most=12000.0)
    level: float = quantity("m", default=0.0)
    density: float = quantity("kg/m3", default=SEA_WATER_DENSITY, above=0.0)
    gravity: float = quantity("m/s2", default=GRAVITY, at_least=0.0)
    waves: RegularWaves | JonswapWaves | None = None
    current: CurrentProfile | None = None
    wind: WindField | None = None
    langmuir: LangmuirCells | None = None
    diffusivity: float = quantity("m2/s", default=0.0, at_least=0.0)
    tide: Tide | None = None
    stream: Stream | StreamTable | None = None
    build_up: float = quantity("s", default=0.0, at_least=0.0)
    carried: Continuation = field(default_factory=Continuation)

    def __post_init__(self) -> None:
        require("sea", SeaDescription, vars(self), self._problems())

    def _problems(self) -> Iterator[str]:
        none = type(None)
        yield from of_kind("waves", self.waves, RegularWaves, JonswapWaves, none)
        yield from of_kind("current", self.current, CurrentProfile, none)
        yield from of_kind("wind", self.wind, WindField, none)
        yield from of_kind("langmuir", self.langmuir, LangmuirCells, none)
        yield from of_kind("tide", self.tide, Tide, none)
        yield from of_kind("stream", self.stream, Stream, StreamTable, none)
        yield from of_kind("carried", self.carried, Continuation)
        if self.waves is not None and self.gravity == 0.0:
            yield "gravity is 0 m/s2, allowed with waves: above 0 m/s2"
        if self.langmuir is not None and (self.wind is None or self.waves is None):
            yield "langmuir is given without wind and waves, allowed: with both, which make the cells"

    def growth(self, time: float) -> tuple[float, float]:
        """Return the share of their height that the waves have at `time` [s], and its rate [1/s]: sin^2(pi t / 2 T) while they build up.

        A body at rest that meets full waves at once keeps the difference to the water's motion as a drift. Programs for moored bodies
        therefore let waves grow over a period or more.
        """
        if time >= self.build_up:
            return 1.0, 0.0
        angle = math.pi * max(time, 0.0) / self.build_up
        return math.sin(0.5 * angle) ** 2, 0.5 * math.pi / self.build_up * math.sin(angle)

    @property
    def water(self) -> StillWater:
        """The still water."""
        return StillWater(float(self.depth), float(self.level), float(self.density), float(self.gravity))

    @property
    def surface_current(self) -> Flow | None:
        """The current at the surface; None without one."""
        return self.current.flow if self.current else None

    @property
    def shear_exponent(self) -> float:
        """The exponent of the current's profile; 0 without one."""
        return self.current.shear_exponent if self.current else 0.0


def profile(stretched: np.ndarray, depth: float, shear_exponent: float) -> np.ndarray:
    """Compute (1 + s / h)^n (N,) [-] at heights s (N,) [m] between -h and 0."""
    return np.maximum(1.0 + stretched / depth, 0.0) ** shear_exponent

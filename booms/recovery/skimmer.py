"""A skimmer and its storage: how much of the oil at its mouth it takes in a step, and what it pumps with it. A closure: *modelled*.

Oil passes a round mouth of diameter w in the mean time pi w / (4 U). U is the larger of the water's speed past the mouth and
(g' h)^(1/2), at which oil of thickness h flows towards a mouth that stands still. The mouth takes the share TE of the oil that passes.
So it takes oil of volume V at the rate V U ln(1 / (1 - TE)) / (pi w / 4), and no more than N RE min(1, (h / 75 mm)^0.76), with N the
nameplate and RE the recovery efficiency: in a slick of half an inch weirs, drums and discs recovered less than 26 % of what they did in the
50 to 75 mm of their best (BSEE 1072; ASTM F2709 tests in 75 to 50 mm).

Planning formulas for skimming systems, after the Response Options Calculator (ROC) of NOAA and Genwest; SI units.

Q = w V h is the oil that a swath w meets at a speed V in a slick of thickness h. A skimmer takes the share TE of it (throughput efficiency)
in a fluid of which the share RE is oil (recovery efficiency); the fluid is Q TE / RE, at most the nameplate N of the pump. Where the pump
limits it, TE falls to N RE / Q. The effective daily recovery capacity is N x 24 h x 20 % (33 CFR 155 appendix B, 30 CFR 254.44).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from coupling.master.saved_fields import SavedFields
from oilsim.core.catalogue import CatalogueEntry, read_catalogue
from oilsim.core.physical_constants import GRAVITY, SEA_WATER_DENSITY
from oilsim.core.quantity import quantity, require

DERATING = 0.2  # [-] of a nameplate, for the effective daily recovery capacity (33 CFR 155 appendix B)
DAY = 86400.0  # [s]
# [m] thickness of a slick from which on a skimmer reaches its best rate; measured; BSEE 1072
BEST_THICKNESS = 0.075
# [-] power of the thickness by which the rate falls below that; measured; 0.26 at 12.7 mm, BSEE 1072
THIN_POWER = 0.76


def daily_capacity(nameplate: float) -> float:
    """Compute the effective daily recovery capacity [m3 a day] of a nameplate [m3/s]."""
    return nameplate * DAY * DERATING


def thin_share(thickness: float) -> float:
    """Return the share [-] of its best oil rate that a skimmer reaches in a slick of some thickness [m]."""
    return min(1.0, (thickness / BEST_THICKNESS) ** THIN_POWER)


SkimmerKind = Literal["weir", "brush", "disc"]
USUAL_EFFICIENCY: dict[str, tuple[float, float]] = {"weir": (0.75, 0.35), "brush": (0.75, 0.75), "disc": (0.75, 0.85)}
"""Throughput and recovery efficiency [-] of the kinds, where a scenario states none. Assumed: weirs take up more water than oil, oleophilic
skimmers less; a trial by ASTM F631 or F2709 gives those of a product."""


@dataclass(frozen=True, kw_only=True)
class SkimmerDesign:
    """A skimmer as it is ordered.

    kind        weir, brush or disc
    nameplate   [m3/s] of fluid, oil and water together
    swath       [m] diameter of its mouth
    throughput_efficiency, recovery_efficiency  [-] share of the oil that passes which is taken, and of oil in what is pumped
    storage     [m3] of fluid
    decanting   [m3/s] at which free water is let out of the storage
    offload_time  [s] to empty a full storage, during which the skimmer stops; 0: nobody empties it
    water_density  [kg/m3]

    Raises ValueError for a value that is not allowed.
    """

    kind: SkimmerKind = "weir"
    nameplate: float = quantity("m3/s", above=0.0)
    swath: float = quantity("m", above=0.0)
    throughput_efficiency: float = quantity("", above=0.0, below=1.0)
    recovery_efficiency: float = quantity("", above=0.0, at_most=1.0)
    storage: float = quantity("m3", above=0.0)
    decanting: float = quantity("m3/s", default=0.0, at_least=0.0)
    offload_time: float = quantity("s", default=0.0, at_least=0.0)
    water_density: float = quantity("kg/m3", default=SEA_WATER_DENSITY, above=0.0)

    def __post_init__(self) -> None:
        require("skimmer", SkimmerDesign, vars(self))


@dataclass
class SkimmerAccount:
    """Sums of a skimmer since the start [m3], and the time [s] for which it has pumped oil.

    encountered: oil that came to its mouth while it worked, each litre once, taken or not.
    """

    encountered: float = 0.0
    oil: float = 0.0
    water: float = 0.0
    decanted: float = 0.0
    offloaded: float = 0.0
    working: float = 0.0


class Skimmer(SavedFields):
    """A skimmer at work: `wanted` says how much oil it takes in a step, `take` books what it got."""

    STATE = ("is_running", "oil_aboard", "water_aboard", "ashore_until", "account")

    def __init__(self, design: SkimmerDesign) -> None:
        self.design = design
        self.account = SkimmerAccount()
        self.is_running = True
        self.oil_aboard = self.water_aboard = 0.0  # [m3] in the storage
        self.ashore_until: float | None = None  # [s] when a storage that is being emptied is back

    @property
    def room(self) -> float:
        """Room left in the storage [m3]."""
        return max(0.0, self.design.storage - self.oil_aboard - self.water_aboard)

    @property
    def is_full(self) -> bool:
        """True if less than a millionth of the storage is free."""
        return self.room <= 1e-6 * self.design.storage

    @property
    def works(self) -> bool:
        """True unless it is stopped, or its storage is full or ashore."""
        return self.is_running and self.ashore_until is None and not self.is_full

    def begin(self, time: float, duration: float) -> None:
        """Let water out, and bring back a storage that has been emptied, before a step from `time` [s]."""
        if self.ashore_until is not None and time >= self.ashore_until - 1e-9:
            self.account.offloaded += self.oil_aboard + self.water_aboard
            self.oil_aboard = self.water_aboard = 0.0
            self.ashore_until = None
        let_out = min(self.water_aboard, self.design.decanting * duration)
        self.water_aboard -= let_out
        self.account.decanted += let_out

    def wanted(self, volume: float, density: float, speed: float, duration: float) -> float:
        """Return the oil [m3] to take in a step, of `volume` [m3] of `density` [kg/m3] at the mouth; `speed` [m/s] of the water past it."""
        design = self.design
        if not self.works or volume <= 0.0:
            return 0.0
        thickness = volume / (0.25 * math.pi * design.swath**2)
        reduced = GRAVITY * max(0.0, 1.0 - density / design.water_density)
        passing = max(speed, math.sqrt(reduced * thickness)) / (0.25 * math.pi * design.swath)
        offered = volume * -math.expm1(passing * math.log1p(-design.throughput_efficiency) * duration)
        pumped = min(design.nameplate * duration * thin_share(thickness), self.room)
        return min(offered, pumped * design.recovery_efficiency)

    def take(self, oil: float, time: float, duration: float) -> None:
        """Add `oil` [m3] that was taken in the step that ends at `time` [s], with the free water that comes with it."""
        water = oil * (1.0 / self.design.recovery_efficiency - 1.0)
        self.oil_aboard += oil
        self.water_aboard += water
        account = self.account
        account.oil += oil
        account.water += water
        account.working += duration if oil > 0.0 else 0.0
        if self.is_full and self.ashore_until is None and self.design.offload_time > 0.0:
            self.ashore_until = time + self.design.offload_time

    def figures(self) -> dict[str, float | None]:
        """Return the figures of ASTM F631 and F2709: rates [m3/h] over the time of work, efficiencies [-]; None before any work."""
        account, design = self.account, self.design
        fluid, hours = account.oil + account.water, account.working / 3600.0
        return {
            "oil_recovery_rate_m3_h": account.oil / hours if hours > 0.0 else None,
            "fluid_recovery_rate_m3_h": fluid / hours if hours > 0.0 else None,
            "recovery_efficiency": account.oil / fluid if fluid > 0.0 else None,
            "throughput_efficiency": account.oil / account.encountered if account.encountered > 0.0 else None,
            "share_of_nameplate": fluid / account.working / design.nameplate if hours > 0.0 else None,
            "effective_daily_recovery_capacity_m3": daily_capacity(design.nameplate),
        }


@dataclass(frozen=True, kw_only=True)
class CatalogueSkimmer(CatalogueEntry):
    """A skimmer of the catalogue: nameplate [m3/h] of fluid, swath [m] of its mouth, storage [m3], and efficiencies [-] as tested."""

    kind: SkimmerKind
    nameplate: float
    swath: float | None = None
    throughput_efficiency: float | None = None
    recovery_efficiency: float | None = None
    storage: float | None = None


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, CatalogueSkimmer]:
    """Read the catalogue, by name."""
    return read_catalogue("booms.recovery", CatalogueSkimmer)
